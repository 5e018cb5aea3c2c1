# Copyright 2026 ahv developers, Apache-2.0
"""The probability of what is too rare to be counted: subset simulation.

Au and Beck (2001): the rare event is the last of a row of nested ones, each some ten times as rare
as the one before, and each is sampled by Markov chains that start in it. The chains are those of
Papaioannou, Betz, Zwirglmaier and Straub (2015), in the space of standard normal numbers, with a
spread that adapts. The interval comes from independent repetitions, and asks nothing of a chain.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.stats import t

from ahv_analysis.bag.rows import Array

SAMPLES = 960  # of a subset: sixty batches
SHARE = 0.1  # of them that begin the next one
MOST_SUBSETS = 12  # to one in a million million
ACCEPTED = 0.44  # share of moves that the spread of the chains is adapted to
CONFIDENCE = 0.95

Limit = Callable[[Array], Array]  # severities (N,) of standard normal numbers (N, K)


class Subsets(NamedTuple):
    """One repetition: the probability, and the nested events on the way."""

    probability: float  # [-]
    thresholds: list[float]  # severity that each event exceeds; the last is the rare one
    shares: list[float]  # [-] of each within the one before
    most_likely: Array | None  # (K,) of the rare event, that is nearest to the centre


class Rare(NamedTuple):
    """All repetitions together."""

    probability: float  # [-]
    low: float  # [-] 95 %
    high: float
    repetitions: list[Subsets]

    @property
    def found(self) -> bool:
        """Whether any repetition reached the rare event."""
        return self.probability > 0.0


def subset_simulation(
    limit: Limit, threshold: float, size: int, random: np.random.Generator
) -> Subsets:
    """Probability [-] that `limit` of `size` standard normal numbers exceeds `threshold`."""
    numbers = random.standard_normal((SAMPLES, size))
    values = limit(numbers)
    thresholds: list[float] = []
    shares: list[float] = []
    spread = 0.6
    while True:
        beyond = values > threshold
        level = float(np.quantile(values, 1.0 - SHARE, method="lower"))
        if level <= (thresholds[-1] if thresholds else -np.inf):
            # more than a tenth of them are the same: go past that value
            above = values[values > level]
            level = float(np.min(above)) if len(above) else level
            chosen = values >= level
        else:
            chosen = values > level
            if not chosen.any():
                chosen = values >= level
        stuck = not chosen.any() or chosen.all()
        if np.mean(beyond) >= SHARE or stuck or len(thresholds) == MOST_SUBSETS:
            thresholds.append(threshold)
            shares.append(float(np.mean(beyond)))
            nearest = None
            if beyond.any():
                reached = numbers[beyond]
                nearest = reached[np.argmin(np.sum(reached**2, axis=1))]
            return Subsets(float(np.prod(shares)), thresholds, shares, nearest)
        least = float(np.min(values[chosen]))
        thresholds.append(level)
        shares.append(float(np.mean(chosen)))
        numbers, values, spread = _chains(
            limit, numbers[chosen], values[chosen], least, spread, random
        )


def _chains(
    limit: Limit,
    seeds: Array,
    values: Array,
    least: float,
    spread: float,
    random: np.random.Generator,
) -> tuple[Array, Array, float]:
    """SAMPLES numbers whose limit is at least `least`, by chains from `seeds` (n, K).

    All chains take a step together: they are one batch. The seeds themselves are not among them.
    """
    order = random.permutation(len(seeds))[: round(SAMPLES * SHARE)]
    now, now_values = seeds[order].copy(), values[order].copy()
    kept: list[Array] = []
    kept_values: list[Array] = []
    steps = -(-SAMPLES // len(now))
    for step in range(1, steps + 1):
        share = min(spread, 1.0)
        moved = np.sqrt(1.0 - share**2) * now + share * random.standard_normal(now.shape)
        moved_values = limit(moved)
        accepted = moved_values >= least
        now[accepted], now_values[accepted] = moved[accepted], moved_values[accepted]
        kept.append(now.copy())
        kept_values.append(now_values.copy())
        spread *= float(np.exp((np.mean(accepted) - ACCEPTED) / np.sqrt(step)))
        spread = min(max(spread, 1e-3), 1.0)
    return np.concatenate(kept)[:SAMPLES], np.concatenate(kept_values)[:SAMPLES], spread


def combine(repetitions: list[Subsets]) -> Rare:
    """Mean of the repetitions with a 95 % interval: Student's t of the mean, on a log scale."""
    each = np.array([one.probability for one in repetitions])
    mean = float(np.mean(each))
    if mean == 0.0:
        return Rare(0.0, 0.0, 0.0, repetitions)
    error = float(np.std(each, ddof=1)) / np.sqrt(len(each)) / mean
    width = float(np.exp(t.ppf(0.5 + CONFIDENCE / 2, len(each) - 1) * error))
    return Rare(mean, mean / width, min(mean * width, 1.0), repetitions)
