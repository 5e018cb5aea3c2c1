# Copyright 2026 ahv developers, Apache-2.0
"""Processes that fly campaigns of laws in plain Python, which threads would fly one at a time."""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor


def _begin() -> None:
    """Leave signals to the process that started this one, and go when it has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(0)


def processes(workers: int) -> ProcessPoolExecutor:
    """As many processes as `workers`, each with everything loaded anew."""
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, mp_context=context, initializer=_begin)
