# Copyright 2026 ahv developers, Apache-2.0
"""Processes that fly campaigns of laws in plain Python, which threads would fly one at a time."""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import resource_tracker


def _begin() -> None:
    """Leave signals to the process that started this one, and go when it has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(0)


def _clean_up_in_silence() -> None:
    """Start the process that removes what this one leaves, and have it tell nobody.

    A campaign that a signal ends leaves semaphores: to remove them is what that process is for.
    """
    said, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        resource_tracker.ensure_running()
    finally:
        os.dup2(said, 2)
        os.close(said)
        os.close(nowhere)


def processes(workers: int) -> ProcessPoolExecutor:
    """As many processes as `workers`, each with everything loaded anew."""
    _clean_up_in_silence()
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, mp_context=context, initializer=_begin)
