# Copyright 2026 ahv developers, Apache-2.0
"""What Fast DDS keeps in shared memory, and leaves there when a process is killed."""

import fcntl
from pathlib import Path

FOLDER = Path("/dev/shm")
LOCK = "_el"  # ends the name of the file that the owner of a piece has locked while it lives


def pieces() -> set[Path]:
    """Locks of all pieces that there are: segments with messages, and ports."""
    return set(FOLDER.glob(f"fastrtps_*{LOCK}"))


def remove_abandoned(locks: set[Path]) -> None:
    """Remove those of the pieces whose owner has gone."""
    for lock in locks:
        try:
            with lock.open("r+") as held:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
                name = lock.name.removesuffix(LOCK)
                for left in (f"sem.{name}_mutex", name, lock.name):
                    (FOLDER / left).unlink(missing_ok=True)
        except (BlockingIOError, FileNotFoundError):
            continue  # its owner lives, or has just removed it
