# Copyright 2026 ahv developers, Apache-2.0
"""One source, three ways to run it: plain floats, compiled scalars, and lanes of a vector loop.

A function marked `elementwise` takes and returns floats or named tuples of floats. It uses only
`+ - * / sqrt abs max`, comparisons with `&` and `|`, and `select`, which IEEE 754 rounds alike
everywhere; no `if`, `and` or `or` on numbers, which lanes could not follow each its own way.
Fastmath is off, so no operation is contracted or reordered, and all three ways give the same bits.
NUMBA_DISABLE_JIT=1 runs the very same source as plain Python, `ahv_plant.numerics.simd` in lanes.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import types
from numba.core import config
from numba.core.errors import NumbaError as CompilerError
from numba.extending import overload

from ahv_plant.numerics.cache import keep_machine_code
from ahv_plant.numerics.identity import Definition, identity

__all__ = ["CompilerError", "composition", "elementwise", "kernel", "select"]

Function = TypeVar("Function", bound=Callable[..., Any])
Value = TypeVar("Value")
# any elementwise function may be called with lanes, whether its source speaks of them or not
LANES = Definition(Path(__file__).resolve().with_name("simd.py"))


def elementwise(function: Function) -> Function:
    """Compile `function` of scalars, with IEEE division and a cache that notices new sources."""
    return _compile(function, forceinline=True)


def composition(function: Function) -> Function:
    """Compile `function` of elementwise functions, written out where a kernel calls it.

    Lanes are a twentieth slower if it is merged into the kernel as machine code, as others are.
    """
    return _compile(function, inline="always")


def kernel(function: Function) -> Function:
    """Compile a loop over elementwise functions, which runs beside others in threads."""
    return _compile(function, nogil=True)


def _compile(function: Function, **options: bool | str) -> Function:
    dispatcher = numba.njit(function, error_model="numpy", **options)
    code, source = function.__code__, Path(function.__code__.co_filename).resolve()
    # what a closure holds, or what was typed in, stands in no source
    if not config.DISABLE_JIT and not code.co_freevars and source.is_file():
        root = Definition(source, function.__qualname__.partition(".")[0])
        name = f"{source.stem}.{function.__qualname__}"
        keep_machine_code(dispatcher, name, identity(root, LANES))
    dispatcher.elementwise = True  # also where the compiler is off
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
