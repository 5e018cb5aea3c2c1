# Copyright 2026 ahv developers, Apache-2.0
"""The guard of one input: every message is judged before anything is done with it."""

from collections.abc import Callable, Collection
from math import isfinite
from operator import le

from ahv_msgs_py.layout import MessageError
from ahv_msgs_py.node.faults import PERIOD, SILENCE, STALE, Fault
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.topics import LoopTopic


class Refusal(Exception):
    """A message that is not obeyed: `fault` says why, and the text in which way."""

    def __init__(self, fault: Fault, text: str):
        """Name the fault and its particulars."""
        super().__init__(text)
        self.fault = fault


def refusal(topic: LoopTopic, stamp: int, values: Values) -> Refusal | None:
    """Why no receiver obeys values of a topic at `stamp` [ns], whoever sent them; None if not so.

    Those who hear a message and those who read it in a bag judge it alike.
    """
    for name, value, (low, high) in zip(topic.layout.fields, values, topic.bounds, strict=True):
        if not isfinite(value):
            return Refusal(Fault.NOT_FINITE, f"{name} is {value}")
        if not low <= value <= high:
            return Refusal(
                Fault.OUT_OF_RANGE, f"{name} is {value:g}, but must be {low:g} to {high:g}"
            )
    if stamp < 0 or stamp % PERIOD:
        return Refusal(Fault.WRONG_STAMP, f"stamp {stamp} ns is no step of the flight")
    return None


def participant(gid: bytes) -> bytes:
    """What all publishers of one process have in common: the start of their GIDs."""
    return gid[:12]


class Guard:
    """Judges the messages of a topic; lets through one voice, in order, with values that can be.

    The middleware names the publisher of every message by a GID. The publisher whose message was
    accepted first is obeyed until it is gone; messages of any other are refused. Gone is, in real
    time, who has been silent for `SILENCE`: one that was killed is known to the middleware for
    seconds yet. In lockstep, where silence means nothing, it is who has left the graph.
    """

    def __init__(
        self,
        topic: LoopTopic,
        general: Callable[[bytes], tuple[int, Values]],
        clock: Callable[[], int],
        realtime: bool,
        publishers: Callable[[], Collection[bytes]],
    ):
        """`general(data)` reads messages of another layout; `clock()` is steady, in ns.

        `publishers()` are the GIDs of all publishers of the topic.
        """
        self._topic = topic
        self._low = tuple(low for low, _ in topic.bounds)
        self._high = tuple(high for _, high in topic.bounds)
        self._decode = topic.layout.decode
        self._general = general
        self._clock = clock
        self._realtime = realtime
        self._publishers = publishers
        self.voice: bytes | None = None  # GID of the publisher that is obeyed
        self._stamp = -1  # [ns] of the last message that was accepted
        self._heard = 0  # [ns] when that was

    def read(self, data: bytes, publisher: bytes, now: int | None) -> tuple[int, Values]:
        """Stamp [ns] and values of a message, or Refusal.

        `publisher` is the GID of its publisher, `now` the stamp of the newest state, if known.
        """
        stamp, values = self._judge(data)
        if self._realtime and now is not None:
            self._check_age(stamp, now)
        if publisher != self.voice:
            self._check_takeover()
        elif stamp <= self._stamp:
            known = f"stamp {stamp / 1e9:g} s after {self._stamp / 1e9:g} s"
            raise Refusal(Fault.DUPLICATE if stamp == self._stamp else Fault.OUT_OF_ORDER, known)
        self.voice, self._stamp = publisher, stamp
        if self._realtime:
            self._heard = self._clock()
        return stamp, values

    def _judge(self, data: bytes) -> tuple[int, Values]:
        """Stamp and values, if they can be those of the topic at all."""
        known = self._decode(data)
        if known is None:
            try:
                known = self._general(data)
            except MessageError as error:
                raise Refusal(Fault.MALFORMED, str(error)) from error
        stamp, values = known
        in_range = all(map(le, self._low, values)) and all(map(le, values, self._high))
        if not in_range or stamp < 0 or stamp % PERIOD:
            refused = refusal(self._topic, stamp, values)
            assert refused is not None
            raise refused
        return known

    def _check_age(self, stamp: int, now: int) -> None:
        if stamp > now + STALE:  # an answer may overtake its state, but not by much
            raise Refusal(
                Fault.WRONG_STAMP, f"stamp {stamp / 1e9:g} s at {now / 1e9:g} s of the flight"
            )
        if stamp < now - STALE:
            raise Refusal(Fault.STALE, f"stamp {stamp / 1e9:g} s at {now / 1e9:g} s of the flight")

    def _check_takeover(self) -> None:
        """Refuse a message of another publisher while the one that is obeyed is there."""
        if self.voice is None:
            return
        if self._realtime:
            gone = self._clock() - self._heard > SILENCE
        else:
            gone = self.voice not in self._publishers()
        if not gone:
            raise Refusal(Fault.SECOND_PUBLISHER, "not by the publisher that is obeyed")

    def forget(self) -> None:
        """Take stamps from the beginning again: a new flight starts."""
        self._stamp = -1
