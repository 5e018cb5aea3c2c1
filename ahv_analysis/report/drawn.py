# Copyright 2026 ahv developers, Apache-2.0
"""What is drawn of a flight: all of it where a screen can show that, else the extremes.

Where steps are missing, and where a value is none that single precision can hold, there is a gap.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ahv_analysis.bag.rows import Array
from ahv_plant.model.constants import STEP

FULL = 20_000  # samples of a line up to which every one is drawn: 200 s
EXACT = 2_000  # samples at the start of a longer line that are drawn: 20 s
_LARGEST = float(np.finfo(np.float32).max)


def drawn_time(time: Array) -> Array:
    """Times [s] of what is drawn: where a line is thinned, the ends of every span."""
    after = _breaks(time)
    time = np.insert(time, after, time[after - 1] + STEP)
    return _thinned(time, lambda spans: spans[:, [0, -1]])


def drawn(time: Array, values: Array) -> Array:
    """Values of a line over `time` [s], at `drawn_time(time)`.

    Of every span of a thinned line these are its least and its largest value, in their order.
    """
    with np.errstate(invalid="ignore"):
        values = np.where(np.abs(values) <= _LARGEST, values, np.nan)
    return _thinned(np.insert(values, _breaks(time), np.nan), _extremes)


def thinned_to(time: Array) -> float | None:
    """How long the spans of a thinned line are [s]; None where every sample is drawn."""
    count = len(time) + len(_breaks(time))
    return None if count <= FULL else _span(count) * STEP


def _breaks(time: Array) -> NDArray[np.intp]:
    """Places behind which steps are missing."""
    return np.flatnonzero(np.diff(time) > 1.5 * STEP) + 1


def _span(count: int) -> int:
    """Samples of a span of a line with `count` samples."""
    return -(-(count - EXACT) // ((FULL - EXACT) // 2))


def _thinned(values: Array, two_of_each: Callable[[Array], Array]) -> Array:
    if len(values) <= FULL:
        return values
    size = _span(len(values))
    end = EXACT + (len(values) - EXACT) // size * size
    spans = values[EXACT:end].reshape(-1, size)
    return np.concatenate((values[:EXACT], two_of_each(spans).ravel(), values[end:]))


def _extremes(spans: Array) -> Array:
    """Least and largest value (n, 2) of the spans (n, samples), in their order; or a gap."""
    places = np.sort(np.column_stack((np.argmin(spans, 1), np.argmax(spans, 1))), axis=1)
    extremes: Array = np.take_along_axis(spans, places, axis=1)
    return extremes
