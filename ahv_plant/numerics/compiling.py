# Copyright 2026 ahv developers, Apache-2.0
"""Word of laws being compiled, which the first flight after a change waits for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock

from numba.core.event import Listener, install_listener


class _Compiling(Listener):  # type: ignore[misc]  # numba has no types
    def __init__(self, tell: Callable[[bool], None]):
        self._tell = tell
        self._lock = Lock()  # threads compile too
        self._depth = 0  # a law's functions are compiled while it is

    def _change(self, by: int) -> None:
        with self._lock:
            self._depth += by
            self._tell(self._depth > 0)

    def on_start(self, event: object) -> None:
        """Something is compiled, and was not in the cache."""
        self._change(1)

    def on_end(self, event: object) -> None:
        """It is."""
        self._change(-1)


@contextmanager
def told_of_compiling(tell: Callable[[bool], None]) -> Iterator[None]:
    """Within, `tell` is called when laws begin to be compiled, and when that is done."""
    with install_listener("numba:compile", _Compiling(tell)):
        yield
