# Copyright 2026 ahv developers, Apache-2.0
"""Values as commands take them: LOW:HIGH, LOW:HIGH:COUNT or A,B,C, with a unit or without."""

from itertools import pairwise
from math import isfinite
from typing import NamedTuple

import numpy as np

from ahv_msgs_py.parameters import ParameterError

RANGE = "LOW:HIGH[:COUNT]"
MOST = 1000  # values of a range
LARGER = {"m": {"km": 1000.0}, "kg": {"t": 1000.0}}  # units that are written for these


class Values(NamedTuple):
    """Values from low to high, and the unit that they were written in."""

    numbers: tuple[float, ...]  # in the quantity's own unit
    unit: str  # as written, by default the own one
    scale: float  # own units in one of it

    @property
    def written(self) -> tuple[float, ...]:
        """The values in the unit that they were written in."""
        return tuple(float(f"{number / self.scale:.12g}") for number in self.numbers)


def read_number(name: str, text: str, own: str) -> float:
    """Value of `name`, in its `own` unit, of a text such as 24000, 24000m or 24km."""
    number, scale = _number(name, text, own)
    return _exact(number * (scale or 1.0))


def read_values(name: str, text: str, own: str, count: int, least: int = 2) -> Values:
    """Values of `name`, whose `own` unit counts where none is written; ParameterError else.

    The last unit that is written is that of all. A range without COUNT has `count` values; there
    must be `least` values or more.
    """
    ranged = ":" in text
    parts = text.split(":") if ranged else text.split(",")
    if ranged and len(parts) == 3:
        try:
            count = int(parts.pop())
        except ValueError:
            raise ParameterError(
                f"{name}: {text!r} must have numbers for LOW and HIGH, an integer for COUNT"
            ) from None
    if ranged and len(parts) != 2:
        raise ParameterError(f"{name}: {text!r} must be {RANGE}, or values with commas")
    found = [_number(name, part, own) for part in parts]
    written = [part.strip() for part in parts]
    scales = [scale for _, scale in found if scale is not None]
    if len(set(scales)) > 1:
        raise ParameterError(f"{name}: {text!r} must have one unit for all its values")
    scale = scales[-1] if scales else 1.0
    numbers = [number for number, _ in found]
    if not all(map(isfinite, numbers)):
        raise ParameterError(f"{name}: {text!r} must have finite numbers")
    if ranged and not numbers[0] < numbers[1]:
        low, high = written
        raise ParameterError(f"{name}: LOW is {low}, but must be below HIGH, {high}")
    if ranged and count < 2:
        raise ParameterError(f"{name}: COUNT is {count}, but must be 2 or more")
    if ranged and count > MOST:
        raise ParameterError(f"{name}: COUNT is {count}, but must be {MOST} or less")
    if not ranged and any(one >= other for one, other in pairwise(numbers)):
        raise ParameterError(f"{name}: {text!r} must be in order, from low to high")
    if ranged:
        numbers = np.linspace(*numbers, count).tolist()
    if len(numbers) < least:
        raise ParameterError(f"{name}: {text!r} must be {RANGE}, or {least} values with commas")
    names = {1.0: own} | {factor: unit for unit, factor in LARGER.get(own, {}).items()}
    return Values(tuple(_exact(number * scale) for number in numbers), names[scale], scale)


def _exact(number: float) -> float:
    """Return what one would write: no 0.30000000000000004."""
    return float(f"{number:.12g}")


def _number(name: str, text: str, own: str) -> tuple[float, float | None]:
    """Return a number and the own units in its unit; None if none is written."""
    scales = ({own: 1.0} if own else {}) | LARGER.get(own, {})
    written, scale = text.strip(), None
    for unit in sorted(scales, key=len, reverse=True):
        if written.endswith(unit):
            written, scale = written.removesuffix(unit), scales[unit]
            break
    try:
        return float(written), scale
    except ValueError:
        units = f", in {' or '.join(scales)}" if scales else ""
        raise ParameterError(f"{name}: {text!r} is not a number{units}") from None
