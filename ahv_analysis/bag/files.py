# Copyright 2026 ahv developers, Apache-2.0
"""Where a bag is: its files, whatever of it a user names."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ahv_analysis.bag.metadata import METADATA_FILE, BagMetadata, read_metadata
from ahv_analysis.errors import BagError

SUFFIXES = (".mcap", ".mcap.zstd")  # the second: compressed as a whole
BAG = "bag"  # the folder in which `ahv fly --out FOLDER` puts it


class BagFiles(NamedTuple):
    """A bag as it lies on the disk."""

    path: Path  # of the folder, or of the file if it is a bare one
    files: list[Path]
    metadata: BagMetadata | None  # None of a bare file, whose own record has it


def find_bag(path: Path) -> Path:
    """Return the bag meant by `path`: `path` itself, or the one that a flight left in it."""
    if (path / BAG).is_dir() and not (path / METADATA_FILE).exists() and not mcap_files(path):
        return path / BAG
    return path


def bag_files(path: Path) -> BagFiles:
    """Files of a bag, a folder with metadata or a bare MCAP file; BagError if it is none."""
    path = find_bag(path)
    if path.name.endswith(SUFFIXES) and path.exists() and not path.is_dir():
        return BagFiles(path, [path], None)
    if not (path / METADATA_FILE).exists():
        if mcap_files(path):
            raise BagError(
                f"{path} has no {METADATA_FILE}: it is still being recorded, or its recorder was "
                f"stopped before the end; `ahv bag recover {path}` gives what it has"
            )
        raise BagError(
            f"{path} is not a bag: a bag is a folder with a {METADATA_FILE}, or an MCAP file"
        )
    metadata = read_metadata(path)
    missing = missing_files(path, metadata)
    if missing:
        raise BagError(f"{path} lacks its {', '.join(missing[:3])}{' …' if missing[3:] else ''}")
    return BagFiles(path, [path / name for name in metadata.files], metadata)


def missing_files(path: Path, metadata: BagMetadata) -> list[str]:
    """Files of the bag folder `path` that its metadata names and that are not there."""
    return [name for name in metadata.files if not (path / name).exists()]


def mcap_files(path: Path) -> list[Path]:
    """MCAP files in a folder, or the one that `path` is; file 10 of a split bag behind file 9."""
    if not path.is_dir():
        return [path] if path.name.endswith(SUFFIXES) and path.exists() else []
    return sorted((file for file in path.iterdir() if file.name.endswith(SUFFIXES)), key=_natural)


def _natural(file: Path) -> Sequence[tuple[str, int]]:
    return [(text, int(number or 0)) for text, number in re.findall(r"(\D*)(\d*)", file.name)]
