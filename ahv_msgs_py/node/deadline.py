# Copyright 2026 ahv developers, Apache-2.0
"""An end that comes, whatever hangs."""

import ctypes
import os
import signal
from time import CLOCK_MONOTONIC

_CALL_IN_A_THREAD = 2  # SIGEV_THREAD
_SIGNAL_OF_PARENT = 1  # PR_SET_PDEATHSIG


class _Event(ctypes.Structure):
    """`struct sigevent` of Linux: what is called with which value."""

    _fields_ = (
        ("value", ctypes.c_ssize_t),
        ("signal", ctypes.c_int),
        ("notify", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("attributes", ctypes.c_void_p),
        ("unused", ctypes.c_char * 32),
    )


def end_within(seconds: float, code: int) -> None:
    """Have this process end with exit code `code` in `seconds` [s], if it still runs then.

    Fast DDS can wait for itself for ever while it is torn down (its issue 6502), under the lock
    that every thread of Python needs. So a thread of the C library ends the process; what has been
    written by then stays, and nothing more is done.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    call = ctypes.cast(libc._exit, ctypes.c_void_p)
    event = _Event(code, 0, _CALL_IN_A_THREAD, call)
    timer = ctypes.c_void_p()
    nanoseconds = int(seconds * 1e9)
    once = (ctypes.c_long * 4)(0, 0, *divmod(nanoseconds, 1_000_000_000))
    if libc.timer_create(CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)) or (
        libc.timer_settime(timer, 0, once, None)
    ):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def end_with_parent(parent: int) -> None:
    """Have this process sent SIGTERM when process `parent`, which made it, ends in any way."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_SIGNAL_OF_PARENT, int(signal.SIGTERM)):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    if os.getppid() != parent:  # it has ended already
        signal.raise_signal(signal.SIGTERM)
