# Copyright 2026 ahv developers, Apache-2.0
"""What real time asks of the operating system, where it grants it."""

import ctypes
import os
from contextlib import suppress
from pathlib import Path

PRIORITY = 20  # of real-time threads, 1 to 99; those of the kernel that serve the machine have 50
RESERVE = 8 << 20  # [bytes] of memory to grow into in flight; a node takes less than that
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of glibc's mallopt
_LOCK_CURRENT, _LOCK_ON_FAULT = 1, 4  # of mlockall


def take_precedence() -> None:
    """Have every thread of this process scheduled before all ordinary ones.

    By the real-time policy SCHED_FIFO: root may, and who has a limit for it (`ulimit -r`). Where
    the system does not permit it, threads stay ordinary ones.
    """
    for thread in Path("/proc/self/task").iterdir():
        with suppress(PermissionError, ProcessLookupError):  # one may have ended meanwhile
            os.sched_setscheduler(int(thread.name), os.SCHED_FIFO, os.sched_param(PRIORITY))


def reserve_memory() -> None:
    """Have memory at hand, so that no step has to ask the system for a page of it.

    A page that is touched for the first time costs a microsecond, and up to a millisecond on a
    virtual machine whose host has to find it first. So the heap gets a reserve that has been
    touched, and gives nothing back; and what is in memory stays there, as far as the system
    permits (`ulimit -l`). By the C library of GNU; with another one the reserve may not last.
    """
    libc = ctypes.CDLL(None)
    with suppress(AttributeError):
        libc.mallopt(_TRIM_THRESHOLD, 2**31 - 1)
        libc.mallopt(_MMAP_THRESHOLD, RESERVE + 4096)
    touched = bytes(1) * RESERVE
    del touched
    libc.mlockall(_LOCK_CURRENT | _LOCK_ON_FAULT)
