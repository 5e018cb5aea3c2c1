# Copyright 2026 ahv developers, Apache-2.0
"""Parameters of the nodes: name, unit, range and meaning, checked alike with and without ROS."""

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from difflib import get_close_matches
from math import isfinite
from typing import NamedTuple

from ahv_msgs_py.layout import excerpt

SIMULATED_TIME = "use_sim_time"  # which ROS gives to every node
BASE = "base"  # a case of the package, of which a file says what differs
# What cases set for all nodes by `/**`: a node that has no use for one of them says nothing.
SHARED = (
    BASE,
    "geometric_altitude",
    "guided",
    "lambda",
    *(f"{gain}_{rate}" for gain in ("k", "k_s", "k_ap") for rate in "PQR"),
)
Value = bool | int | float | str


class ParameterError(ValueError):
    """A parameter that cannot be flown with; the message names it, its value and what is valid."""


class Parameter(NamedTuple):
    """One parameter; its type is that of its default, its range is inclusive."""

    name: str
    default: Value
    description: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    in_flight: bool = False  # may be changed while the vehicle flies
    choices: tuple[str, ...] = ()  # of a text: what it may be, if not anything

    @property
    def valid(self) -> str:
        """What is valid, in words."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        kind = {bool: "true or false", int: "an integer", float: "a number", str: "a text"}
        words = kind[type(self.default)]
        if self.minimum is not None:
            words += f" from {self.minimum:g} to {self.maximum:g}"
        return f"{words} {self.unit}".rstrip()

    def check(self, node: str, value: object) -> Value:
        """`value` in the type of the parameter, or ParameterError."""
        wanted = type(self.default)
        if wanted is float and type(value) in (int, str):
            with suppress(ValueError):  # a text that is no number is refused below
                value = float(value)  # type: ignore[arg-type]
        fits = isinstance(value, wanted) and type(value) is wanted
        if fits and isinstance(value, int | float) and not isinstance(value, bool):
            fits = isfinite(value)
            if self.minimum is not None and self.maximum is not None:
                fits = fits and self.minimum <= value <= self.maximum
        if self.choices:
            fits = value in self.choices
        if not fits or not isinstance(value, bool | int | float | str):
            shown = excerpt(value) if isinstance(value, str) else repr(value)
            raise ParameterError(f"{node}: {self.name} is {shown}, but must be {self.valid}")
        return value


def check_time(name: str, value: object) -> None:
    """Refuse simulated time for the node `name`; ParameterError."""
    if value is not False:
        raise ParameterError(
            f"{name}: {SIMULATED_TIME} is {value!r}, but must be False: nodes go by the stamps of "
            "the plant's states, in real time by the steady clock"
        )


def meant(name: str, valid: Iterable[str]) -> str:
    """What may have been meant by a name that is not valid, as part of a sentence; else empty."""
    close = get_close_matches(name, list(valid), 1)
    return f"did you mean {close[0]!r}? " if close else ""


def in_groups(names: Iterable[str]) -> list[str]:
    """Names as they are listed to people: of those with parts, the first one stands for all."""
    return list(dict.fromkeys(re.sub(r"\..*", ".*", name) for name in names))


def ignored(name: str, valid: Iterable[str]) -> str:
    """Words on a parameter that is given to all nodes, of which none of these is one."""
    return f"there is no parameter {name!r}; {meant(name, valid)}ignored, as it is for all nodes"


def no_parameter(node: str, name: str, valid: Iterable[str]) -> str:
    """Words on a parameter that a node does not have, while these are `valid`."""
    names = list(valid)
    return (
        f"{node}: there is no parameter {excerpt(name)}; "
        f"{meant(name, names)}valid are {', '.join(in_groups(names))}"
    )


def check_parameters(
    node: str, parameters: Iterable[Parameter], values: Mapping[str, object]
) -> dict[str, Value]:
    """Values of all `parameters`, the defaults where `values` has none; else ParameterError."""
    known = {parameter.name: parameter for parameter in parameters}
    for name in values:
        if name not in known:
            raise ParameterError(no_parameter(node, name, known))
    return {
        name: parameter.check(node, values.get(name, parameter.default))
        for name, parameter in known.items()
    }
