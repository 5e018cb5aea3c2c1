# Copyright 2026 ahv developers, Apache-2.0
"""The numbers in nested named tuples as one vector, and back, to be differentiated."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ahv_analysis.bag.rows import Array


def names_in(value: Any, name: str = "") -> list[str]:
    """Names of the floats in `value`, in order, such as state.u; integers and None have none."""
    if isinstance(value, float):
        return [name]
    if isinstance(value, np.ndarray):
        return [f"{name}[{','.join(map(str, at))}]" for at in np.ndindex(value.shape)]
    if isinstance(value, tuple):
        fields = getattr(value, "_fields", range(len(value)))
        return [
            found
            for field, part in zip(fields, value, strict=True)
            for found in names_in(part, f"{name}.{field}".lstrip("."))
        ]
    return []


def numbers_in(value: Any) -> list[float]:
    """The floats in `value`, in the order of `names_in`; each in a unit of its own."""
    if isinstance(value, float):
        return [value]
    if isinstance(value, np.ndarray):
        return [float(number) for number in value.ravel()]
    if isinstance(value, tuple):
        return [number for part in value for number in numbers_in(part)]
    return []


def with_numbers(value: Any, numbers: Iterator[float]) -> Any:
    """`value` with the next of `numbers` for each of its floats, in their units."""
    if isinstance(value, float):
        return float(next(numbers))
    if isinstance(value, np.ndarray):
        return np.array([next(numbers) for _ in range(value.size)]).reshape(value.shape)
    if isinstance(value, tuple):
        parts = [with_numbers(part, numbers) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def jacobian(function: Callable[[Array], Array], at: Array, steps: Array) -> Array:
    """Slopes (outputs, inputs) of `function` at `at` (inputs,), by central differences.

    Of fourth order: Richardson's extrapolation of two of them, `steps` (inputs,) and half of that
    apart, each in the unit of its input. Nothing here is known of what is between.
    """
    columns = []
    for place, step in enumerate(steps):
        apart = np.zeros(len(at))
        apart[place] = step
        wide = (function(at + apart) - function(at - apart)) / (2.0 * step)
        apart[place] = 0.5 * step
        narrow = (function(at + apart) - function(at - apart)) / step
        columns.append((4.0 * narrow - wide) / 3.0)
    return np.array(columns).T
