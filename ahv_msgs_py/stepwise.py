"""Inputs of one step, collected by their stamp: the messages of a step may come in any order."""

from collections.abc import Callable, Sequence

Values = tuple[float, ...]


class Stepwise:
    """Calls `ready(stamp, first, second, ...)` once all inputs of one stamp are there.

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
