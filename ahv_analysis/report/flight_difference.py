# Copyright 2026 ahv developers, Apache-2.0
"""Two flights side by side, quantity by quantity, each with a tolerance."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Array, bits_differ
from ahv_analysis.errors import BagError
from ahv_analysis.quantities import QUANTITIES, Quantity
from ahv_msgs_py.layout import NANOSECONDS

Tolerances = Callable[[str], float]  # of a quantity by its name, in its unit for people


class QuantityDifference(NamedTuple):
    """How one quantity of two flights differs, B less A, in its unit for people."""

    name: str
    unit: str
    differ: int  # states at which the two are not the same bits
    largest: float | None  # difference of largest size; None where one of the two is no number
    at_s: float | None  # when
    first_s: float | None  # when the first of them is
    tolerance: float
    beyond: bool
    first_beyond_s: float | None


class FlightDifference(NamedTuple):
    """Two flights side by side."""

    compared: int  # states that both have
    only_a: int  # states that only A has
    only_b: int
    quantities: list[QuantityDifference]
    of_one: list[str]  # quantities that only one of the two has

    @property
    def beyond(self) -> list[str]:
        """What is beyond its tolerance, in words; empty if nothing."""
        said = [
            f"{words} {count} states that the other has not"
            for words, count in (("A has", self.only_a), ("B has", self.only_b))
            if count
        ]
        said += [f"only one of the two has {name}" for name in self.of_one]
        return said + [one.name for one in self.quantities if one.beyond]


def flight_bag(path: Path) -> Path:
    """Bag of a flight: the folder itself, or `bag` within it, as `ahv fly` lays it down."""
    return path / "bag" if (path / "bag").is_dir() else path


def compare_flights(a: Path, b: Path, tolerances: Tolerances) -> FlightDifference:
    """Compare the flights of two bags; BagError if one cannot be read or they share no state."""
    records = read_bag(flight_bag(a)), read_bag(flight_bag(b))
    found = difference_of(*records, tolerances)
    if not found.compared:
        raise BagError(f"{a} and {b} have no state of the same stamp")
    return found


def difference_of(a: FlightRecord, b: FlightRecord, tolerances: Tolerances) -> FlightDifference:
    """Compare two flights at the stamps that both have."""
    stamps, here, there = np.intersect1d(a.stamps, b.stamps, return_indices=True)
    time = stamps / NANOSECONDS
    quantities, of_one = [], []
    for one in QUANTITIES:
        first, second = one.values(a), one.values(b)
        if first is None and second is None:
            continue
        if first is None or second is None:
            of_one.append(one.name)
        else:
            tolerance = tolerances(one.name)
            quantities.append(_difference(one, time, first[here], second[there], tolerance))
    lengths = len(a.stamps) - len(stamps), len(b.stamps) - len(stamps)
    return FlightDifference(len(stamps), *lengths, quantities, of_one)


def _difference(
    one: Quantity, time: Array, a: Array, b: Array, tolerance: float
) -> QuantityDifference:
    """Compare two lines over `time` [s]; what is no number in both is alike, in one is beyond."""
    differ = bits_differ(a, b)
    with np.errstate(invalid="ignore"):
        between = np.where(differ, one.shown_values(b) - one.shown_values(a), 0.0)
    size = np.where(np.isfinite(between), np.abs(between), np.inf)
    beyond = (size > tolerance) | (differ & (tolerance == 0.0))
    place = int(np.argmax(size)) if differ.any() else None
    return QuantityDifference(
        one.name,
        one.shown_unit,
        int(np.count_nonzero(differ)),
        float(between[place]) if place is not None and np.isfinite(size[place]) else None,
        _time(time, place),
        _time(time, int(np.argmax(differ)) if differ.any() else None),
        tolerance,
        bool(beyond.any()),
        _time(time, int(np.argmax(beyond)) if beyond.any() else None),
    )


def _time(time: Array, place: int | None) -> float | None:
    return None if place is None else float(time[place])
