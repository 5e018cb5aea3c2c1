# Copyright 2026 ahv developers, Apache-2.0
"""Parts that an element-wise law may lack: settings that are None, decided at compile time.

Numba types both sides of `if settings is None`, and the two must then agree. Here one side alone
is compiled, so that a law without the part costs nothing, and its state is None as well.
"""

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from numba import types
from numba.extending import overload

from ahv_plant.numerics.elementwise import elementwise

Result = TypeVar("Result")


def optional(function: Callable[..., Result]) -> Callable[..., Result | None]:
    """Element-wise `function` that answers None if its last argument, the settings, is None."""
    compiled = elementwise(function)

    @wraps(function)
    def call(*arguments: Any) -> Result | None:
        return None if arguments[-1] is None else compiled(*arguments)

    # without forceinline an adaptive flight is a tenth slower
    @overload(call, jit_options={"forceinline": True, "error_model": "numpy"})
    def _compile_call(*arguments):  # type: ignore[no-untyped-def]  # as in elementwise.py
        if isinstance(arguments[-1], types.NoneType):
            return lambda *arguments: None
        return lambda *arguments: compiled(*arguments)

    return call
