# Copyright 2026 ahv developers, Apache-2.0
"""Pictures as files."""

from pathlib import Path

from matplotlib.figure import Figure


def save_picture(figure: Figure, path: Path) -> None:
    """Write a picture, the same bytes each time."""
    figure.savefig(path, metadata={"Software": None})
