# Copyright 2026 ahv developers, Apache-2.0
"""Machine code that is kept from one start to the next, one file a function and types.

Numba's own cache looks only at the file of the function that it keeps, and takes what it reads for
whole. Here a file is named after all that its code was made of, so that other code never finds it,
and tells by a checksum whether it is whole; one that is not is missed, compiled again and
replaced. Where nothing can be written nothing is kept. This file is the only one that uses what
numba does not promise to keep: a dispatcher's `_cache`, and how to take a result apart and
together.
"""

import hashlib
import logging
import os
import pickle
import platform
import shutil
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import llvmlite
import numba
from numba import types
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

LIMIT = 500_000_000  # [bytes] kept at most; what was not used for longest goes first
_CHECKSUM = hashlib.sha256().digest_size  # [bytes] at the start of a file
_warned: set[Path] = set()  # folders that could not be written


def cache_folder() -> Path | None:
    """Folder of the machine code, None if the user has no home."""
    base = os.environ.get("XDG_CACHE_HOME")
    if base:
        return Path(base) / "ahv"
    with suppress(RuntimeError):
        return Path.home() / ".cache" / "ahv"
    return None


class MachineCode(NullCache):  # type: ignore[misc]  # numba has no types
    """Cache of one function, in the way of numba's own: its dispatcher loads from it and saves."""

    def __init__(self, name: str, identity: str):
        self._name = name
        self._identity = identity

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return what was compiled for the types of a signature, None if that is to be done."""
        target.refresh()
        path = self._path(signature, target.codegen())
        if path is None:
            return None
        try:
            content = path.read_bytes()
        except OSError:  # most of all because there is none
            return None
        checksum, code = content[:_CHECKSUM], content[_CHECKSUM:]
        if hashlib.sha256(code).digest() != checksum:
            return None
        with suppress(OSError):
            os.utime(path)
        return CompileResult._rebuild(target, *pickle.loads(code))

    def save_overload(self, signature: Any, result: Any) -> None:
        """Keep what was compiled for the types of a signature."""
        path = self._path(signature, result.codegen)
        if path is None or result.lifted or result.library.has_dynamic_globals:
            return
        code = dumps(result._reduce())
        save(path, hashlib.sha256(code).digest() + code)

    def _path(self, signature: Any, codegen: Any) -> Path | None:
        folder = cache_folder()
        if folder is None:
            _warn(Path("~/.cache/ahv"), "there is no home folder")
            return None
        made_of = (
            self._identity,
            str(signature),
            *_classes(signature),
            *codegen.magic_tuple(),
            numba.__version__,
            llvmlite.__version__,
            sys.version,
            platform.machine(),
        )
        key = hashlib.sha256("\n".join(made_of).encode()).hexdigest()[:32]
        return folder / f"{self._name}-{key}.code"


def save(path: Path, content: bytes) -> None:
    """Write a file of the cache, whole or not at all; where that cannot be, say so once."""
    folder = path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _prune(folder)
        with NamedTemporaryFile(dir=folder, prefix=".", delete=False) as draft:
            try:
                draft.write(content)
                draft.close()
                os.replace(draft.name, path)
            except OSError:
                os.unlink(draft.name)
                raise
    except OSError as error:
        _warn(folder, error.strerror or str(error))


def _classes(signature: Any) -> Iterator[str]:
    """Named tuples of a signature with their fields, which numba's names of types leave out."""
    parts = signature if isinstance(signature, tuple) else (signature.args, signature.return_type)
    for kind in parts:
        if isinstance(kind, tuple):
            yield from _classes(kind)
        elif isinstance(kind, types.BaseTuple):
            named = getattr(kind, "instance_class", tuple)
            yield f"{named.__module__}.{named.__qualname__}{getattr(named, '_fields', '')}"
            yield from _classes(tuple(kind))


@cache  # once for a process
def _prune(folder: Path) -> None:
    """Make room in the folder."""
    entries = []
    for path in folder.iterdir():
        with suppress(FileNotFoundError):  # another process may be at it
            entries.append((path.stat(), path))
    kept = 0
    for status, path in sorted(entries, key=lambda entry: -entry[0].st_mtime):
        if path.is_dir():  # as kept before there was a file for each
            shutil.rmtree(path, ignore_errors=True)
            continue
        kept += status.st_size
        if kept > LIMIT:
            path.unlink(missing_ok=True)


def _warn(folder: Path, reason: str) -> None:
    """Say once what is not kept."""
    if folder not in _warned:
        _warned.add(folder)
        logging.getLogger("ahv").warning(
            "ahv: %s cannot keep compiled code (%s), so every start compiles anew: "
            "make room there, or set XDG_CACHE_HOME to a folder that can be written",
            folder,
            reason,
        )


def keep_machine_code(dispatcher: Any, name: str, identity: str) -> None:
    """Let numba's `dispatcher` of a function keep its machine code under a name and identity."""
    dispatcher._cache = MachineCode(name, identity)
