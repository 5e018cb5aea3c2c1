# Copyright 2026 ahv developers, Apache-2.0
"""Which of what was drawn decides a quantity of a campaign.

Three views of each factor: its rank correlation (Spearman), its part in a regression, and an index
that asks for no shape, PAWN (Pianosi and Wagener, 2015): how far the distribution of the quantity
moves where the factor is held within a tenth of its range.

What chance alone makes of the index is found by permuting the runs, and of the largest over all
factors at once (Westfall and Young, 1993); of the rank correlation by its own test, times the
number of factors. So nine factors are no nine chances, nor are two tests two (Bonferroni).
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import rankdata, spearmanr

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.columns import LOST
from ahv_analysis.errors import CampaignError

SLICES = 10  # of a factor, with as many runs each
STEPS = 50  # of the quantity's distribution, in which it is looked at
PERMUTATIONS = 999
CONFIDENCE = 0.99  # beyond chance, for all factors together
FEWEST = 50  # runs from which a slice says anything
RIDGE = 1e-4  # keeps the regression of a verdict finite where a factor parts it cleanly
EXTREME = 0.1  # share of the runs at each end of a factor that a tornado shows


class Sensitivity(NamedTuple):
    """What one factor does to the quantity."""

    factor: str
    pawn: float  # [-] largest Kolmogorov-Smirnov distance of a slice from all, 0 to 1
    p_value: float  # [-] of index and rank correlation, for all factors together
    rank_correlation: float  # [-] Spearman's
    coefficient: float  # [-] of the regression, for a standard deviation of the factor
    at_low: float  # mean of the quantity over the tenth of the runs with the least of the factor
    at_high: float  # the same with the most
    decides: bool  # beyond chance


class Sensitivities(NamedTuple):
    """What all factors do, the most decisive first."""

    quantity: str
    runs: int
    chance: float  # [-] PAWN index that chance passes once in a hundred campaigns
    explained: float  # [-] by the regression: of the variance of ranks, or of the deviance
    factors: list[Sensitivity]
    sentence: str


def check_sensitivities(quantity: str, values: Array, factors: Mapping[str, Array]) -> None:
    """Raise CampaignError where there is nothing to be told: few runs, or one value."""
    values = values[np.isfinite(values)]
    if len(values) < FEWEST:
        raise CampaignError(
            f"{len(values)} runs with a {quantity} are too few: {FEWEST} are needed"
        )
    if np.ptp(values) == 0.0:
        same = "no run is lost" if values[0] == 0.0 else "every run is lost"
        said = same if quantity == LOST else f"{quantity} is {values[0]:g} in every run"
        raise CampaignError(f"nothing decides where nothing differs: {said}")
    if not factors:
        raise CampaignError("nothing was drawn: every run flies the same")


def sensitivities(
    quantity: str,
    values: Array,
    factors: Mapping[str, Array],
    seed: int = 0,
    progress: Callable[[int], None] = lambda done: None,
) -> Sensitivities:
    """What each of `factors` (N,) has to do with `values` (N,) of a quantity.

    `seed` is of the permutations, and `progress(done)` is called as they are made. What
    `check_sensitivities` raises has to be found out before.
    """
    there = np.isfinite(values)
    values, factors = values[there], {name: one[there] for name, one in factors.items()}
    indices, nulls = _pawn_beyond_chance(values, factors, seed, progress)
    chance = float(np.quantile(nulls, CONFIDENCE))
    coefficients, explained = regression(quantity, values, factors)
    found = []
    for name, one in factors.items():
        of_index = (1 + int(np.sum(nulls >= indices[name]))) / (1 + len(nulls))
        ranked = spearmanr(one, values)
        correlation = float(ranked.statistic)
        p_value = min(1.0, 2.0 * min(of_index, len(factors) * float(ranked.pvalue)))
        decides = p_value <= 1.0 - CONFIDENCE
        at = _extremes(one, values)
        found.append(
            Sensitivity(
                name, indices[name], p_value, correlation, coefficients[name], *at, decides
            )
        )
    found.sort(key=lambda one: -one.pawn)
    sentence = _sentence(quantity, values, factors, found, chance)
    return Sensitivities(quantity, len(values), chance, explained, found, sentence)


def pawn(values: Array, factor: Array) -> float:
    """PAWN index [-] of a `factor` (N,) for `values` (N,): the largest distance of a slice.

    Distributions are compared where those of all runs reach the multiples of 2 %.
    """
    return float(_distances(_slices(factor)[None, :], _steps(values))[0])


def _slices(factor: Array) -> Array:
    """Slice (N,) of each run, 0 to SLICES - 1, as many runs in each."""
    return np.argsort(np.argsort(factor, kind="stable"), kind="stable") * SLICES // len(factor)


def _steps(values: Array) -> Array:
    """Step (N,) of the distribution of all runs at which each is; equal values share one."""
    ranks = rankdata(values, method="max") / len(values)
    rising = np.sort(ranks)
    edges = np.unique(rising[np.searchsorted(rising, np.arange(1, STEPS) / STEPS)])
    found: Array = np.searchsorted(edges, ranks, side="left")
    return found


def _distances(slices: Array, steps: Array) -> Array:
    """Largest distances (K,) [-] of the distribution within a slice (K, N) from that of all."""
    width = int(steps.max()) + 1
    places = (np.arange(len(slices))[:, None] * SLICES + slices) * width + steps
    counts = np.bincount(places.ravel(), minlength=len(slices) * SLICES * width)
    counts = counts.reshape(len(slices), SLICES, width)
    of_all = np.cumsum(counts[0].sum(axis=0)) / len(steps)
    of_each = np.cumsum(counts, axis=2) / counts.sum(axis=2, keepdims=True)
    distances: Array = np.max(np.abs(of_each - of_all), axis=(1, 2))
    return distances


def _pawn_beyond_chance(
    values: Array, factors: Mapping[str, Array], seed: int, progress: Callable[[int], None]
) -> tuple[dict[str, float], Array]:
    """Index [-] of each factor, and (PERMUTATIONS,) the largest of any where runs are shuffled."""
    steps = _steps(values)
    slices = np.array([_slices(one) for one in factors.values()])
    indices = dict(zip(factors, _distances(slices, steps).tolist(), strict=True))
    random, nulls = np.random.default_rng(seed), np.empty(PERMUTATIONS)
    for place in range(PERMUTATIONS):
        shuffled = random.permutation(steps)
        nulls[place] = _distances(slices, shuffled).max()
        progress(place + 1)
    return indices, nulls


def regression(
    quantity: str, values: Array, factors: Mapping[str, Array]
) -> tuple[dict[str, float], float]:
    """Coefficient [-] of each factor, and the share [-] that the regression explains.

    Of the verdict: a logistic one, change of the log-odds of a loss for a standard deviation of
    the factor. Of all else: a linear one of ranks, in standard deviations for one.
    """
    table = np.column_stack([*factors.values()])
    if quantity == LOST:
        weights, explained = logistic(_standard(table), values)
        return dict(zip(factors, weights[1:].tolist(), strict=True)), explained
    ranks = _standard(np.column_stack([rankdata(column) for column in table.T]))
    target = _standard(rankdata(values)[:, None])[:, 0]
    weights, *_ = np.linalg.lstsq(ranks, target, rcond=None)
    explained = 1.0 - float(np.sum((target - ranks @ weights) ** 2) / np.sum(target**2))
    return dict(zip(factors, weights.tolist(), strict=True)), explained


def logistic(table: Array, lost: Array) -> tuple[Array, float]:
    """Weights (1 + K,) of a logistic regression on a `table` (N, K), and McFadden's share [-].

    The first weight is the constant; a small ridge keeps the others finite.
    """
    design = np.column_stack([np.ones(len(table)), table])

    def cost(weights: Array) -> tuple[float, Array]:
        odds = design @ weights
        loss = float(np.mean(np.logaddexp(0.0, odds) - lost * odds))
        slope = design.T @ (expit(odds) - lost) / len(lost)
        penalty = RIDGE * np.append(0.0, weights[1:])
        return loss + 0.5 * float(weights @ penalty), slope + penalty

    found = minimize(cost, np.zeros(design.shape[1]), jac=True, method="BFGS")
    share = float(np.mean(lost))
    nothing = -(share * np.log(share) + (1.0 - share) * np.log(1.0 - share))
    odds = design @ found.x
    loss = float(np.mean(np.logaddexp(0.0, odds) - lost * odds))
    return found.x, 1.0 - loss / nothing


def _standard(table: Array) -> Array:
    """Columns with mean 0 and deviation 1."""
    spread = table.std(axis=0)
    standard: Array = (table - table.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)
    return standard


def _extremes(factor: Array, values: Array) -> tuple[float, float]:
    """Mean of the values at the low and at the high end of a factor."""
    order, count = np.argsort(factor, kind="stable"), max(1, int(EXTREME * len(factor)))
    low, high = values[order[:count]], values[order[-count:]]
    return float(low.mean()), float(high.mean())


def _sentence(
    quantity: str,
    values: Array,
    factors: Mapping[str, Array],
    found: list[Sensitivity],
    chance: float,
) -> str:
    """What decides, in one sentence."""
    deciding = [one for one in found if one.decides]
    if not deciding:
        largest = f"{found[0].pawn:.2f} of {found[0].factor}"
        return (
            f"None of the {len(found)} factors has to do with what is {quantity}: the largest "
            f"index, {largest}, is what chance does, which reaches {chance:.2f}."
        )
    first, *others = deciding
    side = "low" if first.rank_correlation < 0.0 else "high"
    what = "which vehicles are lost" if quantity == LOST else quantity
    words = (
        f"{first.factor} decides {what}"
        f" (index {first.pawn:.2f}, chance {chance:.2f}; rank correlation "
        f"{first.rank_correlation:+.2f})"
    )
    words += f": a {side} {first.factor} loses them" if quantity == LOST else ""
    words += _bound(quantity, values, factors[first.factor], first.factor)
    if others:
        names = ", ".join(f"{one.factor} ({one.pawn:.2f})" for one in others)
        return f"{words}; beyond chance {'is' if len(others) == 1 else 'are'} also {names}."
    rest = len(found) - 1
    return f"{words}; of the other {rest} none is beyond chance."


def _bound(quantity: str, values: Array, factor: Array, name: str) -> str:
    """Where all lost runs lie, if that is not everywhere."""
    lost = values == 1.0
    if quantity != LOST or not lost.any():
        return ""
    at = factor[lost]
    low, high = factor.min(), factor.max()
    if at.max() < low + 0.75 * (high - low):
        return f", all {len(at)} of them with {name} <= {_up(at.max()):g}"
    if at.min() > high - 0.75 * (high - low):
        return f", all {len(at)} of them with {name} >= {_down(at.min()):g}"
    return ""


def _up(value: float) -> float:
    return float(np.ceil(value * 1000.0) / 1000.0)


def _down(value: float) -> float:
    return float(np.floor(value * 1000.0) / 1000.0)
