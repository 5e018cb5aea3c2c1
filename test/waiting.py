# Copyright 2026 ahv developers, Apache-2.0
"""How tests wait: for a state, for as long as a slow and busy machine may take to reach it."""

import time
from collections.abc import Callable

PATIENCE = 240.0  # [s] for what comes in seconds, on a machine that has much else to do


def wait_until(
    holds: Callable[[], object],
    what: str,
    look: Callable[[], object] = lambda: time.sleep(0.02),
) -> None:
    """Look again and again until `holds()`; fail with `what` was waited for if it never does."""
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline, f"waited {PATIENCE:g} s in vain: {what}"
        look()
