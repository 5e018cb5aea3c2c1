# Copyright 2026 ahv developers, Apache-2.0
"""The worst vehicle in a box of dispersions, and the largest box without a lost one.

Searched: the corners of the box first, all 512, then by differential evolution (Storn and Price,
1997; scipy's) from the worst of them and from random vehicles, and along the edges from the worst
that was found. A search proves nothing: what it does not find may be there.
"""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.vehicles import FACTORS, LOSS

POPULATION = 48  # vehicles of a generation: three batches
GENERATIONS = 14  # of a start
FINER_GENERATIONS = 8  # of a search that only asks whether one is lost
NAMED_CORNERS = POPULATION // 2  # worst corners that the first start begins with

Fly = Callable[[Array], Array]  # severities (N,) of vehicles with dispersions (N, 9)


class Start(NamedTuple):
    """What one start of the search came to."""

    words: str
    best: list[float]  # severity after each generation


class Worst(NamedTuple):
    """The worst vehicle that was found."""

    dispersion: Array  # (9,) multipliers [-]
    severity: float  # as `fly_vehicles` has it
    corner: Array  # (9,) the worst corner
    corner_severity: float
    lost_corners: int
    starts: list[Start]

    @property
    def lost(self) -> bool:
        """Whether it is lost."""
        return self.severity > LOSS


def corners(level: float) -> Array:
    """The 512 vehicles (512, 9) [-] with every multiplier at an end of its range."""
    return 1.0 + level * np.array(list(product((-1.0, 1.0), repeat=FACTORS)))


def find_worst(fly: Fly, level: float, starts: int, seed: int) -> Worst:
    """Search the box 1 + [-level, level] for the vehicle of greatest severity."""
    at_corners = corners(level)
    severities = fly(at_corners)
    order = np.argsort(-severities, kind="stable")
    best, value = at_corners[order[0]], float(severities[order[0]])
    corner, corner_value = best, value
    done = [Start("corners", [value])]
    for number in range(starts):
        random = np.random.default_rng((seed, number))
        population = random.uniform(1.0 - level, 1.0 + level, (POPULATION, FACTORS))
        if number == 0:
            population[:NAMED_CORNERS] = at_corners[order[:NAMED_CORNERS]]
        found, severity, history = _evolve(fly, level, population, GENERATIONS, random)
        found, severity = _along_edges(fly, level, found, severity)
        words = "from the worst corners" if number == 0 else f"from random vehicles {number}"
        done.append(Start(words, [*history, severity]))
        if severity > value:
            best, value = found, severity
    lost = int(np.sum(severities > LOSS))
    return Worst(best, value, corner, corner_value, lost, done)


def find_lost(fly: Fly, level: float, seed: int) -> tuple[Array, float]:
    """A lost vehicle (9,) of the box and its severity; the worst that was found if none is lost.

    The corners first; the search ends with the first loss.
    """
    at_corners = corners(level)
    severities = fly(at_corners)
    order = np.argsort(-severities, kind="stable")
    best, value = at_corners[order[0]], float(severities[order[0]])
    if value > LOSS or level == 0.0:
        return best, value
    random = np.random.default_rng(seed)
    population = random.uniform(1.0 - level, 1.0 + level, (POPULATION, FACTORS))
    population[:NAMED_CORNERS] = at_corners[order[:NAMED_CORNERS]]
    found, severity, _ = _evolve(fly, level, population, FINER_GENERATIONS, random)
    if severity <= LOSS:
        found, severity = _along_edges(fly, level, found, severity)
    return (found, severity) if severity > value else (best, value)


def _evolve(
    fly: Fly, level: float, population: Array, generations: int, random: np.random.Generator
) -> tuple[Array, float, list[float]]:
    """Best vehicle of an evolution, its severity, and the best of each generation."""
    history: list[float] = []

    def told(intermediate_result: object) -> None:
        history.append(-float(intermediate_result.fun))  # type: ignore[attr-defined]

    found = differential_evolution(
        lambda vehicles: -fly(vehicles.T),
        [(1.0 - level, 1.0 + level)] * FACTORS,
        strategy="currenttobest1bin",
        maxiter=generations,
        tol=0.0,  # it ends with the last generation
        init=population,
        polish=False,
        updating="deferred",
        vectorized=True,
        callback=told,
        rng=random,
    )
    return found.x, -float(found.fun), history


def _along_edges(fly: Fly, level: float, start: Array, severity: float) -> tuple[Array, float]:
    """Move one multiplier at a time to an end of its range for as long as that is worse."""
    best, value = start, severity
    while True:
        moved = np.array([best] * (2 * FACTORS))
        for place in range(FACTORS):
            moved[2 * place, place] = 1.0 - level
            moved[2 * place + 1, place] = 1.0 + level
        severities = fly(moved)
        place = int(np.argmax(severities))
        if severities[place] <= value:
            return best, value
        best, value = moved[place], float(severities[place])


class Probe(NamedTuple):
    """What a search found at one value of what the radius is sought in."""

    value: float
    severity: float  # the greatest that was found
    dispersion: list[float]  # (9,) of that vehicle

    @property
    def lost(self) -> bool:
        """Whether a lost vehicle was found."""
        return self.severity > LOSS


class Radius(NamedTuple):
    """Where losses begin: between two values that were searched."""

    kept: float | None  # last value at which no loss was found; None if there is none
    lost: float | None  # first value at which one was; None if there is none
    probes: list[Probe]


def bisect(probe: Callable[[float], Probe], kept: float, lost: float, resolution: float) -> Radius:
    """Halve the range between a value that is expected to be kept and one that is not.

    Ends where the two are `resolution` apart, or at once if one is not as expected. Values are
    multiples of `resolution`, from `kept` on.
    """
    probes = [probe(kept)]
    if probes[0].lost:
        return Radius(None, kept, probes)
    probes.append(probe(lost))
    if not probes[1].lost:
        return Radius(lost, None, probes)
    steps = round(abs(lost - kept) / resolution)
    low, high = 0, max(steps, 1)
    while high - low > 1:
        middle = (low + high) // 2
        value = kept + (lost - kept) * middle / max(steps, 1)
        probes.append(probe(float(f"{value:.12g}")))
        low, high = (low, middle) if probes[-1].lost else (middle, high)
    ends = [float(f"{kept + (lost - kept) * at / max(steps, 1):.12g}") for at in (low, high)]
    return Radius(ends[0], ends[1], probes)
