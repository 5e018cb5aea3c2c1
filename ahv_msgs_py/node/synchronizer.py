# Copyright 2026 ahv developers, Apache-2.0
"""Inputs of one step, collected by their stamp: the messages of a step may come in any order."""

from collections.abc import Callable, Mapping, Sequence

from ahv_msgs_py.node.faults import PERIOD

Values = tuple[float, ...]
# What a node goes on with while an input stays away: of its last values, None if there were none,
# and their age in steps.
Fallback = Callable[[Values | None, int], Values | None]


class Stepwise:
    """Lockstep: calls `ready(stamp, first, second, ...)` once all inputs of one stamp are there.

    Steps are answered in the order of their stamps; inputs of a step already answered are dropped,
    so that a message that comes twice is not answered twice.
    """

    def __init__(self, inputs: Sequence[str], ready: Callable[..., None]):
        self._inputs = tuple(inputs)
        self._ready = ready
        self._waiting: dict[int, dict[str, Values]] = {}
        self._answered = -1  # [ns] stamp of the last answered step

    def put(self, name: str, stamp: int, values: Values) -> None:
        """Take the input `name` of the step at `stamp` [ns]."""
        if stamp <= self._answered:
            return
        step = self._waiting.setdefault(stamp, {})
        step[name] = values
        if len(step) == len(self._inputs):
            self._answered = stamp
            self._waiting = {later: put for later, put in self._waiting.items() if later > stamp}
            self._ready(stamp, *(step[name] for name in self._inputs))

    def awaited(self) -> tuple[int, tuple[str, ...]] | None:
        """Stamp [ns] of the first step that has inputs, but not all, and which have not come."""
        if not self._waiting:
            return None
        stamp = min(self._waiting)
        there = self._waiting[stamp]
        return stamp, tuple(name for name in self._inputs if name not in there)


class RealTimeSteps:
    """Real time: as `Stepwise`, but a step whose inputs do not come is not waited for for ever.

    The first input is the state, which sets the pace. A step is answered when its other inputs are
    there. If one is still missing when the next state comes, that step is given up and the input
    is lost: from then on steps are answered at once, with what its fallback makes of its last
    values, until it is in time again.
    """

    def __init__(
        self,
        inputs: Sequence[str],
        ready: Callable[..., None],
        fallbacks: Mapping[str, Fallback],
        missing: Callable[[int, str], None],
        wait: bool = True,
    ):
        """`fallbacks` are those of all inputs but the first; `missing(stamp, name)` is told.

        Without `wait` a step is answered when its state comes, with what is there then.
        """
        self._pace, *others = inputs
        self._others = tuple(others)
        self._ready = ready
        self._fallbacks = fallbacks
        self._missing = missing
        self._wait = wait
        self._lost: set[str] = set()
        self._latest: dict[str, tuple[int, Values]] = {}
        self._pending: tuple[int, Values] | None = None
        self._newest = 0  # [ns] stamp of the newest state

    def put(self, name: str, stamp: int, values: Values) -> None:
        """Take the input `name` of the step at `stamp` [ns]."""
        if name == self._pace:
            if self._pending is not None:  # give that step up
                for absent in self._absent(self._pending[0]):
                    self._missing(self._pending[0], absent)
                    self._lost.add(absent)
            self._pending = stamp, values
            self._newest = stamp
        else:
            self._latest[name] = stamp, values
            if stamp >= self._newest:
                self._lost.discard(name)
        if self._pending is None:
            return
        if not self._wait or self._lost.issuperset(self._absent(self._pending[0])):
            self._answer(*self._pending)

    def _absent(self, stamp: int) -> list[str]:
        """Inputs that have not come for a step."""
        return [name for name in self._others if self._latest.get(name, (-1,))[0] != stamp]

    def _answer(self, stamp: int, pace: Values) -> None:
        self._pending = None
        self._ready(stamp, pace, *(self._input(name, stamp) for name in self._others))

    def _input(self, name: str, stamp: int) -> Values | None:
        then, values = self._latest.get(name, (stamp, None))
        if then == stamp and values is not None:
            return values
        self._missing(stamp, name)
        return self._fallbacks[name](values, (stamp - then) // PERIOD)
