# Copyright 2026 ahv developers, Apache-2.0
"""What a command leaves in a folder: pictures and numbers, all of it or a sentence why not."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ahv_analysis.command.console import UsageError
from ahv_analysis.interrupt import signals_wait


@contextmanager
def results_in(folder: Path) -> Iterator[None]:
    """Write to a folder, made if it is not there; signals wait until all is written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with signals_wait():
            yield
    except OSError as error:
        named = error.filename or folder
        raise UsageError(f"cannot write to {named}: {error.strerror}") from error


def write_numbers(path: Path, content: Mapping[str, Any]) -> None:
    """Write numbers as JSON, for people too; ValueError where one is not finite."""
    path.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
