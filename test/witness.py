# Copyright 2026 ahv developers, Apache-2.0
"""A witness of the machine: when did it stand still, whatever runs on it?"""

import gc
import multiprocessing
import os
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import TracebackType

PERIOD = 0.002  # [s] of its timers
STILL = 0.002  # [s] late, from which on the machine is said to have stood still
PRIORITY = 60  # above all nodes, and above what the kernel does in threads of its own (50)


def _watch_core(core: int, results: Connection) -> None:
    """Sleep from period to period on one core; note from when to when nothing woke it."""
    os.sched_setaffinity(0, {core})
    with suppress(PermissionError):  # then a busy machine looks like one that stands still
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    gc.disable()
    still: list[tuple[float, float]] = []
    due = time.monotonic()
    while not results.poll():
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
        now = time.monotonic()
        if now - due > STILL:
            still.append((due, now))
            due = now
    results.send(still)


class Witness:
    """A timer on every core that nothing on this machine can hold up.

    When one is late all the same, then the core did not run: a hypervisor gave it to another
    machine. What a flight misses then says nothing of the flight.
    """

    def __init__(self) -> None:
        """No stop has been seen yet."""
        self.stops: list[tuple[float, float]] = []  # [s] of `time.monotonic`, of all cores
        self._cores: list[tuple[BaseProcess, Connection]] = []

    def __enter__(self) -> "Witness":
        context = multiprocessing.get_context("spawn")  # the threads of DDS cannot be forked
        for core in sorted(os.sched_getaffinity(0)):
            ours, theirs = context.Pipe()
            process = context.Process(target=_watch_core, args=(core, theirs), daemon=True)
            process.start()
            self._cores.append((process, ours))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for process, results in self._cores:
            results.send(None)
            self.stops += results.recv()
            process.join()
        self.stops.sort()

    def stood_still(self, start: float, end: float) -> bool:
        """Whether a core did at any time from `start` to `end` [s of `time.monotonic`]."""
        return any(since < end and until > start for since, until in self.stops)
