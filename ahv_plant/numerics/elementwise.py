# Copyright 2026 ahv developers, Apache-2.0
"""One source, three ways to run it: plain floats, compiled scalars, and lanes of a vector loop.

A function marked `elementwise` takes and returns floats or named tuples of floats. It uses only
`+ - * / sqrt abs max`, comparisons with `&` and `|`, and `select`, which IEEE 754 rounds alike
everywhere; no `if`, `and` or `or` on numbers, which lanes could not follow each its own way.
Fastmath is off, so no operation is contracted or reordered, and all three ways give the same bits.
NUMBA_DISABLE_JIT=1 runs the very same source as plain Python, `ahv_plant.numerics.simd` in lanes.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import types
from numba.core import config
from numba.extending import overload

Function = TypeVar("Function", bound=Callable[..., Any])
Value = TypeVar("Value")


def source_hash() -> str:
    """Hash the sources of all compiled code.

    Numba looks only at the file of the function that it caches; a callee changed in another file
    would go on with its old machine code.
    """
    house = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256(numba.__version__.encode())
    for room in ("ahv_plant", "ahv_control", "ahv_analysis"):
        for source in sorted((house / room).rglob("*.py")):
            digest.update(str(source.relative_to(house)).encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_directory() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "ahv" / source_hash()


_CACHE = _cache_directory()


@contextmanager
def _numba_cache_in(directory: Path) -> Iterator[None]:
    """Point numba at `directory` while one function sets up its cache, and nobody else's."""
    before, config.CACHE_DIR = config.CACHE_DIR, str(directory)
    try:
        yield
    finally:
        config.CACHE_DIR = before


def elementwise(function: Function) -> Function:
    """Compile `function` of scalars, with IEEE division and a cache that notices new sources."""
    return _compile(function, forceinline=True)


def kernel(function: Function) -> Function:
    """Compile a loop over elementwise functions, which runs beside others in threads."""
    return _compile(function, nogil=True)


def _compile(function: Function, **options: bool) -> Function:
    dispatcher = numba.njit(function, error_model="numpy", **options)
    if not config.DISABLE_JIT:
        with _numba_cache_in(_CACHE):
            dispatcher.enable_caching()
    return cast(Function, dispatcher)  # calls like the function, so type checkers see that


def select(condition: bool, chosen: Value, other: Value) -> Value:
    """`chosen` where `condition` holds, else `other`: the conditional expression of lanes."""
    return chosen if condition else other


# numba wants signature and implementation to agree, annotations and all, and a lambda has none
@overload(select)
def _compile_select(condition, chosen, other):  # type: ignore[no-untyped-def]
    if condition == types.boolean:
        return lambda condition, chosen, other: chosen if condition else other
    return None
