# Copyright 2026 ahv developers, Apache-2.0
"""Element-wise functions of which there are several: the type of the last argument decides.

In compiled code it is decided when a caller is compiled, so that a choice costs nothing in flight.
"""

from collections.abc import Callable
from typing import Any

from numba.extending import overload


def by_type(choose: Callable[[type], Callable[..., Any]]) -> Callable[..., Any]:
    """Element-wise function that is `choose(type of its last argument)`, a named tuple's.

    What is chosen is element-wise itself; in plain Python it may be anything.
    """

    def call(*arguments: Any) -> Any:
        return choose(type(arguments[-1]))(*arguments)

    # as in optional.py, merged into the caller
    @overload(call, jit_options={"forceinline": True, "error_model": "numpy"})
    def _compile_call(*arguments):  # type: ignore[no-untyped-def]  # as in elementwise.py
        chosen = choose(getattr(arguments[-1], "instance_class", type(None)))
        return lambda *arguments: chosen(*arguments)

    return call
