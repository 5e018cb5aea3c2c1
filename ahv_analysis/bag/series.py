# Copyright 2026 ahv developers, Apache-2.0
"""Messages of one topic of the loop as arrays, and which of them the receivers obeyed.

A reader judges as a receiver does (`ahv_msgs_py.node.guard`), by what the recorder wrote down: the
number of the publisher of every message. The publisher that was heard first is obeyed until its
last message, then the one that is heard next; of two messages with one stamp the first stands. A
bag of another recorder has no such numbers: there two messages that differ and have one stamp
cannot be told apart, and the bag is refused.
"""

from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_analysis.bag.rows import BLOCK, Array, GrowingRows, Rows, bits_differ, part_of
from ahv_msgs_py.layout import NANOSECONDS, MessageError
from ahv_msgs_py.node.faults import PERIOD, Fault
from ahv_msgs_py.node.guard import refusal
from ahv_msgs_py.topics import STATE, LoopTopic

MOST_PUBLISHERS = 100  # of one topic; what counts messages numbers no publishers


class Series(NamedTuple):
    """What was obeyed of a topic."""

    stamps: NDArray[np.int64]  # (n,) [ns] rising
    values: Rows  # (n, fields)

    def sharing(self, others: Iterable["Series"]) -> "Series":
        """The same; its stamps, if they are those of one of `others`, are in memory once."""
        for other in others:
            if np.array_equal(self.stamps, other.stamps):
                return Series(other.stamps, self.values)
        return self


class Refused(NamedTuple):
    """Messages of a topic that no receiver obeyed, for one reason."""

    topic: str
    fault: Fault
    messages: int
    first: str  # what the first of them is like


class AmbiguousError(ValueError):
    """Messages of which nobody can tell which was obeyed."""


def _told_apart(publishers: NDArray[np.uint32]) -> bool:
    numbers = np.unique(publishers)
    return 0 not in numbers and len(numbers) <= MOST_PUBLISHERS


def obeyed(publishers: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """Which messages (n,) are of the publisher that is obeyed; all where none are told apart."""
    heard = np.zeros(len(publishers), bool)
    if not _told_apart(publishers):
        return ~heard
    _, voices = np.unique(publishers, return_inverse=True)
    last = np.zeros(len(publishers), np.int64)
    last[voices] = np.arange(len(voices))
    place = 0
    while place < len(voices):
        end = int(last[voices[place]]) + 1
        heard[place:end] = voices[place:end] == voices[place]
        place = end
    return heard


class Collector:
    """Takes the messages of one topic as they come in a bag."""

    def __init__(
        self,
        topic: LoopTopic,
        name: str,
        general: Callable[[bytes], tuple[int, Sequence[float]]],
    ):
        """`name` is the topic's in the bag; `general(data)` reads messages of another layout."""
        self._topic, self._name = topic, name
        self._general = general
        self._low, self._high = np.array(topic.bounds).T
        self._stamps, self._publishers = array("q"), array("I")
        self._values = GrowingRows(len(topic.layout.fields))
        self._counts: Counter[Fault] = Counter()
        self._firsts: dict[Fault, str] = {}

    def rows(self, rows: NDArray[np.uint8], publishers: NDArray[np.uint32]) -> None:
        """Take messages (n, bytes) of the length of the layout."""
        stamps, values, known = self._topic.layout.decode_rows(rows)
        for place in np.flatnonzero(~known):
            self.message(rows[place].tobytes(), publishers[place])
        self._judge(stamps[known], values[known], publishers[known])

    def message(self, data: bytes, publisher: int) -> None:
        """Take one message of any bytes."""
        try:
            stamp, values = self._topic.layout.decode(data) or self._general(data)
        except MessageError as error:
            self._refuse(Fault.MALFORMED, 1, str(error))
            return
        self._judge(np.array([stamp]), np.array([values]), np.array([publisher], np.uint32))

    def _judge(
        self, stamps: NDArray[np.int64], values: Array, publishers: NDArray[np.uint32]
    ) -> None:
        """Leave out what no receiver obeys, whoever sent it."""
        good = np.all((values >= self._low) & (values <= self._high), axis=1)
        good &= (stamps >= 0) & (stamps % PERIOD == 0)
        for place in np.flatnonzero(~good):
            stamp = int(stamps[place])
            refused = refusal(self._topic, stamp, tuple(values[place].tolist()))
            assert refused is not None
            self._refuse(refused.fault, 1, f"{refused} at {stamp / NANOSECONDS:g} s")
        self._stamps.frombytes(stamps[good].tobytes())
        self._values.extend(values[good])
        self._publishers.frombytes(publishers[good].tobytes())

    def _refuse(self, fault: Fault, messages: int, text: str) -> None:
        self._counts[fault] += messages
        self._firsts.setdefault(fault, text)

    def series(self) -> Series:
        """What was obeyed; AmbiguousError where that cannot be told. The collector is used up."""
        stamps = np.frombuffer(self._stamps, np.int64)
        publishers = np.frombuffer(self._publishers, np.uint32)
        values = self._values.rows()
        if np.all(publishers == publishers[:1]) and np.all(stamps[1:] > stamps[:-1]):
            return Series(stamps, values)
        told = _told_apart(publishers)
        if told:
            heard = obeyed(publishers)
            others = stamps[~heard]
            if len(others):
                when = others[0] / NANOSECONDS
                self._refuse(Fault.SECOND_PUBLISHER, len(others), f"from {when:g} s on")
            stamps, values = stamps[heard], part_of(values, np.flatnonzero(heard))
            if self._topic is STATE and np.any((stamps[1:] == 0) & (stamps[:-1] > 0)):
                raise AmbiguousError(f"{self._name} starts again at 0 s")
        order = np.argsort(stamps, kind="stable")
        stamps, values = stamps[order], part_of(values, order)
        first = np.append(True, stamps[1:] > stamps[:-1])[: len(stamps)]
        again = int(np.count_nonzero(~first))
        if told and again:
            when = stamps[np.argmin(first)] / NANOSECONDS
            self._refuse(Fault.DUPLICATE, again, f"another one of {when:g} s")
        elif again:
            others = np.flatnonzero(~first)
            standing = np.flatnonzero(first)[np.cumsum(first)[others] - 1]  # at the stamp of each
            for start in range(0, again, BLOCK):
                some = slice(start, start + BLOCK)
                differ = bits_differ(values[others[some]], values[standing[some]]).any(axis=1)
                if np.any(differ):
                    when = stamps[others[some][np.argmax(differ)]] / NANOSECONDS
                    raise AmbiguousError(
                        f"two messages on {self._name} differ and have one stamp, {when:g} s"
                    )
        return Series(stamps[first], part_of(values, np.flatnonzero(first)))

    @property
    def refused(self) -> list[Refused]:
        """What was not obeyed."""
        return [
            Refused(self._name, fault, count, self._firsts[fault])
            for fault, count in self._counts.items()
        ]
