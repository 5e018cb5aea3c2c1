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

from ahv_plant.numerics.elementwise import Value, elementwise

Result = TypeVar("Result")


def optional(
    function: Callable[..., Result], otherwise: Callable[..., Any] | None = None
) -> Callable[..., Any]:
    """Element-wise `function` whose last argument, the settings, may be None.

    Then the answer is that of `otherwise` to all arguments but the last, or None.
    """
    compiled = _compiled(function)
    plain = None if otherwise is None else _compiled(otherwise)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        if arguments[-1] is not None:
            return compiled(*arguments)
        return None if plain is None else plain(*arguments[:-1])

    # without forceinline an adaptive flight is a tenth slower
    @overload(call, jit_options={"forceinline": True, "error_model": "numpy"})
    def _compile_call(*arguments):  # type: ignore[no-untyped-def]  # as in elementwise.py
        if not isinstance(arguments[-1], types.NoneType):
            return lambda *arguments: compiled(*arguments)
        if plain is None:
            return lambda *arguments: None
        return lambda *arguments: plain(*arguments[:-1])

    return call


def _compiled(function: Callable[..., Result]) -> Callable[..., Result]:
    """The function, compiled if it is not yet."""
    return function if hasattr(function, "py_func") else elementwise(function)


def changed_by(function: Callable[..., Any]) -> Callable[..., Any]:
    """Element-wise `function` that answers its first argument as it is if its last is None."""
    return optional(function, otherwise=_first)


def _first(first: Value, *others: object) -> Value:
    return first
