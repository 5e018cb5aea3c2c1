# Copyright 2026 ahv developers, Apache-2.0
"""Recorded and replayed commands side by side."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_analysis.bag.rows import BLOCK, bits_differ
from ahv_analysis.bag.series import Series
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.topics import LoopTopic

Stamps = NDArray[np.int64]  # (n,) [ns] rising


class Difference(NamedTuple):
    """One field of one command that came out otherwise, in the unit of its topic."""

    stamp: int  # [ns]
    node: str
    topic: str
    field: str
    recorded: float
    replayed: float

    @property
    def size(self) -> float:
        """Replayed less recorded value."""
        return self.replayed - self.recorded

    def as_json(self) -> dict[str, Any]:
        """All of it under the names that `--json` uses."""
        return {
            "time_s": self.stamp / NANOSECONDS,
            "node": self.node,
            "topic": self.topic,
            "field": self.field,
            "recorded": self.recorded,
            "replayed": self.replayed,
            "difference": self.size,
        }


class Comparison(NamedTuple):
    """The commands of one topic."""

    node: str
    topic: str
    in_bag: bool
    compared: int
    differences: int  # commands that are not alike to the last bit
    missing: int  # recorded commands that the node did not give again, though it could
    unrecorded: int  # replayed commands that are not in the bag, though others of the topic are
    first: Difference | None
    largest: Difference | None


def common_stamps(one: Stamps, other: Stamps) -> Stamps:
    """Stamps that both have."""
    if one is other or np.array_equal(one, other):
        return one
    return np.intersect1d(one, other, assume_unique=True)


def compare(
    node: str,
    topic: LoopTopic,
    name: str,
    recorded: Series | None,
    replayed: Series,
    complete: Stamps,
) -> Comparison:
    """Compare what `node` commanded on `topic`, in the bag as `name`, by stamp [ns], bit for bit.

    `recorded` is None if the bag does not have the topic; `complete` are the stamps of the steps
    that the node had all inputs of.
    """
    first: Difference | None = None
    largest: Difference | None = None
    differing = 0
    known = np.empty(0, np.int64) if recorded is None else recorded.stamps
    common = common_stamps(known, replayed.stamps)
    for start in range(0, len(common) if recorded is not None else 0, BLOCK):
        stamps = common[start : start + BLOCK]
        before = recorded.values[np.searchsorted(known, stamps)]
        after = replayed.values[np.searchsorted(replayed.stamps, stamps)]
        unlike = bits_differ(before, after)
        if not unlike.any():
            continue
        differing += int(np.count_nonzero(unlike.any(axis=1)))
        sizes = np.where(unlike, np.abs(after - before), -1.0)
        earliest, greatest = (
            Difference(
                int(stamps[row]),
                node,
                name,
                topic.layout.fields[column],
                float(before[row, column]),
                float(after[row, column]),
            )
            for row, column in (
                np.unravel_index(flat, unlike.shape)
                for flat in (np.argmax(unlike), np.argmax(sizes))
            )
        )
        first = first or earliest
        if largest is None or abs(greatest.size) > abs(largest.size):
            largest = greatest
    return Comparison(
        node,
        name,
        recorded is not None,
        len(common),
        differing,
        len(np.setdiff1d(common_stamps(known, complete), common, assume_unique=True)),
        len(replayed.stamps) - len(common) if len(known) else 0,
        first,
        largest,
    )


def first_of(comparisons: Iterable[Comparison]) -> Difference | None:
    """Earliest difference; of several at one time, that of the topic that comes first."""
    found = [entry.first for entry in comparisons if entry.first is not None]
    return min(found, key=lambda difference: difference.stamp, default=None)


def largest_of(comparisons: Iterable[Comparison]) -> Difference | None:
    """Difference of the largest number, whatever its unit."""
    found = [entry.largest for entry in comparisons if entry.largest is not None]
    return max(found, key=lambda difference: abs(difference.size), default=None)


def total(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    """Counts and differences of several topics, as `--json` prints them."""
    first, largest = first_of(comparisons), largest_of(comparisons)
    return {
        "compared": sum(entry.compared for entry in comparisons),
        "differences": sum(entry.differences for entry in comparisons),
        "missing": sum(entry.missing for entry in comparisons),
        "unrecorded": sum(entry.unrecorded for entry in comparisons),
        "first": first and first.as_json(),
        "largest": largest and largest.as_json(),
    }
