# Copyright 2026 ahv developers, Apache-2.0
"""A witness of the machine: when did it stand still, whatever runs on it?"""

import gc
import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection

Stop = tuple[float, float]  # [s] of `time.monotonic`, from when to when a core did not run
PERIOD = 0.002  # [s] of its timers
STILL = 0.002  # [s] late, from which on the machine is said to have stood still
PRIORITY = 60  # above all nodes, and above what the kernel does in threads of its own (50)


def _watch_core(core: int, results: Connection) -> None:
    """Sleep from period to period on one core; note from when to when nothing woke it."""
    os.sched_setaffinity(0, {core})
    with suppress(PermissionError):  # then a busy machine looks like one that stands still
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    gc.disable()
    still: list[Stop] = []
    due = time.monotonic()
    while not results.poll():
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
        now = time.monotonic()
        if now - due > STILL:
            still.append((due, now))
            due = now
    results.send(still)


@contextmanager
def machine_watched() -> Iterator[list[Stop]]:
    """Have a timer on every core that nothing on this machine can hold up; stops are in the list.

    When one is late all the same, then the core did not run: a hypervisor gave it to another
    machine. What a flight misses then says nothing of the flight. The list is filled at the end.
    """
    context = multiprocessing.get_context("spawn")  # the threads of DDS cannot be forked
    stops: list[Stop] = []
    watchers = []
    for core in sorted(os.sched_getaffinity(0)):
        ours, theirs = context.Pipe()
        process = context.Process(target=_watch_core, args=(core, theirs), daemon=True)
        process.start()
        watchers.append((process, ours))
    try:
        yield stops
    finally:
        for process, results in watchers:
            results.send(None)
            stops += results.recv()
            process.join()


def stood_still(stops: list[Stop], start: float, end: float) -> bool:
    """Whether a core did at any time from `start` to `end` [s of `time.monotonic`]."""
    return any(since < end and until > start for since, until in stops)
