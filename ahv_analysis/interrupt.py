# Copyright 2026 ahv developers, Apache-2.0
"""Signals that end a program: never in the middle of what must be whole.

No signal raises an exception here. One that rises at any instruction may come to pass inside a
callback of ROS, where it ends in a segmentation fault, or where Python ignores it.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from ahv_msgs_py.node.deadline import end_within

Part = TypeVar("Part")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
CLEAR_LINE_AND_SHOW_CURSOR = b"\r\x1b[2K\x1b[?25h"  # after a progress bar

LONGEST_LEAVE = 2.0  # [s] for what is left to the very end, and for Python to tidy up

_last: list[Callable[[], None]] = []  # to be done when all has been said
_words: Callable[[], str] = str  # what is to be said of an interrupted command


@contextmanager
def signals_wait() -> Iterator[Callable[[], bool]]:
    """What is done in here is not cut off: a signal has its effect when it is over.

    The function that this gives tells whether one came, so that long work can end early and in
    order. A signal that the process ignores stays ignored.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False  # signals are the main thread's affair
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        for number, handler in before.items():
            if handler is not signal.SIG_IGN:
                signal.signal(number, lambda number, _: came.append(number))
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if came:
            signal.raise_signal(came[0])


def until(interrupted: Callable[[], bool], parts: Iterable[Part]) -> Iterator[Part]:
    """Parts of long work, as they come; KeyboardInterrupt once `interrupted()`.

    Within `signals_wait` the signal then has its effect, and what was begun is put away before.
    """
    for part in parts:
        if interrupted():
            raise KeyboardInterrupt
        yield part


def end_on_signals() -> None:
    """From now on a signal ends this process at once, with a sentence and 128 + its number."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
            signal.signal(number, _end)


def let_no_signal_end() -> None:
    """From now on signals are ignored: what was to be done is done, and Python tidies up."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def interrupted_says(words: Callable[[], str]) -> None:
    """From now on an interrupted command says `words()` too."""
    global _words
    _words = words


def last_of_all(work: Callable[[], None]) -> None:
    """Have `work`, which may hang, done when the command has said all, an interrupted one too."""
    _last.append(work)


def do_the_last(code: int) -> None:
    """Do what was left to the end; this process ends soon with exit code `code`, come what may."""
    end_within(LONGEST_LEAVE, code)
    while _last:
        _last.pop()()


def _end(number: int, frame: object) -> None:
    said = " ".join(("ahv: interrupted", *filter(None, [_words()])))
    # not through sys.stderr, which may be in the middle of a line, nor before a thread that draws
    # there; and without the ways of an exit, which wait for threads
    terminal = os.dup(2)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    clear = CLEAR_LINE_AND_SHOW_CURSOR if os.isatty(terminal) else b""
    os.write(terminal, clear + said.encode(errors="backslashreplace") + b"\n")
    let_no_signal_end()
    do_the_last(128 + number)
    os._exit(128 + number)
