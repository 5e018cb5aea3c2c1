# Copyright 2026 ahv developers, Apache-2.0
"""What the system tells of a process that runs meanwhile."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path


def opened(pid: int) -> Iterator[Path]:
    """What a process has opened, but for what it closes just now."""
    for link in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):
            yield link.readlink()
