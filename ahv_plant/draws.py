# Copyright 2026 ahv developers, Apache-2.0
"""How quantities of the true world are drawn, where uniform by a level is not enough.

A quantity is a parameter of the plant, by its name. Each has a stream of its own, so that one more
or less changes no other, nor the nine that `draw_dispersion` draws. Correlated quantities share a
normal copula (Nelsen, 2006): unit normals are correlated, then each is bent to its distribution.
Between normal quantities that is their correlation itself; between uniform ones of correlation r
it is (6 / pi) asin(r / 2), at most 0.02 less.
"""

from collections.abc import Iterable, Mapping
from math import sqrt
from statistics import NormalDist
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from ahv_msgs_py.parameters import Parameter, ParameterError, meant

_QUANTITY = 2  # purpose of the streams; 1 is that of random starts
_UNIT = NormalDist()
_NEVER = 8.0  # [-] deviations from the mean at which no draw lies
_HUGE = 1e30  # in any unit
_LEAST = 1e-6  # [-] share of a normal distribution that must be left when it is truncated


class Uniform(NamedTuple):
    """Anything between two ends alike, in any unit."""

    low: float
    high: float


class Normal(NamedTuple):
    """Normal, in any unit."""

    mean: float
    deviation: float


class Truncated(NamedTuple):
    """Normal as far as it lies between two ends, in any unit."""

    mean: float
    deviation: float
    low: float
    high: float


Distribution = Uniform | Normal | Truncated
_KINDS: dict[str, type[Distribution]] = {
    "uniform": Uniform,
    "normal": Normal,
    "truncated": Truncated,
}


class Distributions(NamedTuple):
    """What is drawn for every run."""

    quantities: dict[str, Distribution]
    factor: tuple[tuple[float, ...], ...]  # [-] L of the correlation L L^T, in the same order


def draw_values(distributions: Distributions, seed: int, run: int) -> dict[str, float]:
    """Values of the run `run` of the campaign `seed`, by name, in the units of the parameters.

    Any run can be drawn again alone, with the same bits.
    """
    normals = [
        float(np.random.default_rng((seed, run, _QUANTITY, crc32(name.encode()))).normal())
        for name in distributions.quantities
    ]
    return {
        name: bent(sum(share * z for share, z in zip(row, normals, strict=False)), distribution)
        for (name, distribution), row in zip(
            distributions.quantities.items(), distributions.factor, strict=True
        )
    }


def bent(z: float, distribution: Distribution) -> float:
    """Value with as much of `distribution` below it as a unit normal has below `z` [-]."""
    if isinstance(distribution, Normal):
        return distribution.mean + distribution.deviation * z
    share, low, high = _UNIT.cdf(z), distribution.low, distribution.high
    if isinstance(distribution, Uniform):
        return low + (high - low) * share
    normal = NormalDist(distribution.mean, distribution.deviation)
    below = normal.cdf(low)
    share = below + (normal.cdf(high) - below) * share
    return min(max(normal.inv_cdf(min(max(share, 1e-300), 1.0 - 1e-16)), low), high)


def distributions_of(
    quantities: Mapping[str, object],
    correlation: Iterable[object],
    parameters: Iterable[Parameter],
) -> Distributions:
    """Distributions as files hold them, checked: no draw is beyond the range of its parameter.

    `quantities` are such as `{"dispersion.mass": {"normal": [1.0, 0.03]}}`, with `uniform`: low,
    high; `normal`: mean, deviation; `truncated`: mean, deviation, low, high. `correlation` has
    triples of two names and a number [-]. Raises ParameterError.
    """
    known = {parameter.name: parameter for parameter in parameters}
    drawn = {name: _distribution(name, given, known) for name, given in quantities.items()}
    return Distributions(drawn, _factor(list(drawn), correlation))


def _distribution(name: str, given: Any, known: Mapping[str, Parameter]) -> Distribution:
    if name not in known or not isinstance(known[name].default, float):
        raise ParameterError(
            f"draws: {name} is no number among the parameters of the plant; "
            f"{meant(name, known)}valid is such as dispersion.mass"
        )
    single = isinstance(given, Mapping) and len(given) == 1
    kind, numbers = next(iter(given.items())) if single else ("", ())
    fields = _KINDS[kind]._fields if kind in _KINDS else ()
    if not fields or not _are_numbers(numbers, len(fields)):
        valid = ", ".join(f"{one}: [{', '.join(of._fields)}]" for one, of in _KINDS.items())
        raise ParameterError(f"draws: {name} is {given!r}, but must be one of {valid}")
    distribution = _KINDS[kind](*map(float, numbers))
    low, high = _support(distribution)
    if not low < high:
        raise ParameterError(f"draws: {name} is {given!r}, but must have a width above 0")
    if isinstance(distribution, Truncated) and _left(distribution) < _LEAST:
        raise ParameterError(
            f"draws: {name} is {given!r}, but its ends must leave {_LEAST:g} of the distribution"
        )
    for end in (low, high):
        try:
            known[name].check("draws", end)
        except ParameterError as error:
            raise ParameterError(f"{error}: {kind} draws reach there") from error
    return distribution


def _are_numbers(numbers: object, count: int) -> bool:
    return (
        isinstance(numbers, list | tuple)
        and len(numbers) == count
        and all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers)
        and all(abs(one) < _HUGE for one in numbers)
    )


def _support(distribution: Distribution) -> tuple[float, float]:
    """Between what the draws lie; turned about where a deviation is negative."""
    if isinstance(distribution, Normal):
        reach = _NEVER * distribution.deviation
        return distribution.mean - reach, distribution.mean + reach
    if isinstance(distribution, Truncated) and distribution.deviation <= 0.0:
        return 0.0, 0.0
    return distribution.low, distribution.high


def _left(distribution: Truncated) -> float:
    normal = NormalDist(distribution.mean, distribution.deviation)
    return normal.cdf(distribution.high) - normal.cdf(distribution.low)


def _factor(names: list[str], correlation: Iterable[object]) -> tuple[tuple[float, ...], ...]:
    """Cholesky factor, row by row, with the same bits on every machine."""
    matrix = [[float(row == column) for column in names] for row in names]
    for given in correlation:
        pair = tuple(given) if isinstance(given, list | tuple) else ()
        if len(pair) != 3 or pair[0] == pair[1] or not _are_numbers(pair[2:], 1):
            raise ParameterError(
                f"draws: correlation is {given!r}, but must be [name, other name, number]"
            )
        for name in pair[:2]:
            if name not in names:
                raise ParameterError(
                    f"draws: correlation names {name!r}, but drawn are {', '.join(names)}"
                )
        one, other = names.index(pair[0]), names.index(pair[1])
        matrix[one][other] = matrix[other][one] = float(pair[2])
    factor: list[list[float]] = []
    for i, row in enumerate(matrix):
        made: list[float] = []
        for j in range(i):
            known = sum(made[k] * factor[j][k] for k in range(j))
            made.append((row[j] - known) / factor[j][j])
        rest = row[i] - sum(one * one for one in made)
        if rest <= 1e-12:
            raise ParameterError(
                f"draws: the correlations of {names[i]} are together larger than any can be"
            )
        factor.append([*made, sqrt(rest)])
    return tuple(map(tuple, factor))
