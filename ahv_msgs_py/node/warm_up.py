# Copyright 2026 ahv developers, Apache-2.0
"""Laws are called once before a flight, so that none of its steps waits for the compiler."""

from collections.abc import Callable, Iterable, Sequence
from itertools import product
from types import NoneType
from typing import Any, get_args, get_type_hints

from ahv_msgs_py.graph import NODES

Law = Callable[..., object]


def warm_up_nodes(names: Iterable[str] = NODES) -> None:
    """Warm up what nodes call in a step."""
    for name in names:
        warm_up(NODES[name].node_class.laws)


def warm_up(laws: Sequence[Law]) -> None:
    """Call every law once, with and without what may be None: machine code depends on types."""
    for law in laws:
        hints = get_type_hints(law)
        hints.pop("return")
        for arguments in product(*map(_examples, hints.values())):
            law(*arguments)


def _examples(hint: Any) -> list[Any]:
    """Values of a type: one, or named tuples of ones."""
    if NoneType in get_args(hint):
        return [*_examples(get_args(hint)[0]), None]
    if issubclass(hint, tuple):
        fields = get_type_hints(hint).values()
        return [hint(*values) for values in product(*map(_examples, fields))]
    return [hint(1)]
