# Copyright 2026 ahv developers, Apache-2.0
"""The programs of the nodes, by the names of the nodes: `from ahv_msgs_py.program import plant`.

A node takes a second to import, in which a signal would find nobody but Python, and end in a
traceback. So it is imported here, by a function.
"""

import os
import signal
from collections.abc import Callable
from functools import partial
from importlib import import_module

from ahv_msgs_py.graph import NODES

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def __getattr__(name: str) -> Callable[[], None]:
    if name not in NODES:
        raise AttributeError(f"there is no node {name!r}")
    return partial(_run, name)


def _run(name: str) -> None:
    """Run a node; until it takes signals itself one ends this process at once, without a word."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as under nohup
            signal.signal(number, lambda number, _: os._exit(128 + number))
    import_module(NODES[name].module).main()
