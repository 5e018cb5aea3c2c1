# Copyright 2026 ahv developers, Apache-2.0
"""Axes of a map, and what else is set for all of it: as they are written, and what they set."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

import yaml

from ahv_analysis.campaign.condition import (
    COMMANDED,
    CONDITIONS,
    MACH,
    MASS,
    MOVED,
    WHERE,
    Given,
)
from ahv_analysis.ranges import RANGE, Values, read_values
from ahv_msgs_py.graph import NODES, case_nodes
from ahv_msgs_py.parameters import Parameter, ParameterError, meant
from ahv_plant.dispersion import HIGHEST_LEVEL, Dispersion

LEVEL = Parameter("level", 0.3, "dispersion of the draws", "", 0.0, HIGHEST_LEVEL)
DRAWN = {"noise.seed", "noise.run", *(f"dispersion.{name}" for name in Dispersion._fields)}
COUNT = 6  # values of an axis, if it is not said

Places = tuple[tuple[str, Parameter], ...]  # nodes, and the parameter of each; none: the level
Settings = Mapping[str, tuple[Places, object]]  # by the name that was written


class Axis(NamedTuple):
    """An axis of a map."""

    name: str  # of a parameter, a pattern of such names, a flight condition, or `level`
    unit: str
    values: tuple[float, ...]  # in this unit, from low to high
    places: Places
    written: Values  # the same, as they were asked for

    @property
    def title(self) -> str:
        """Name and unit, as it was written."""
        return f"{self.name} [{self.written.unit or '-'}]"


def places_of(name: str) -> Places:
    """Every parameter of the nodes that has this name, or one like this shell pattern.

    NODE.NAME is that of one node.
    """
    known = [(node, parameter) for node in case_nodes() for parameter in NODES[node].parameters]
    found = tuple(
        (node, parameter)
        for node, parameter in known
        if fnmatchcase(parameter.name, name) or name == f"{node}.{parameter.name}"
    )
    if not found:
        names = ["level", *CONDITIONS, *(parameter.name for _, parameter in known)]
        raise ParameterError(
            f"no node has a parameter {name!r}; {meant(name, names)}"
            "docs/parameters.md lists them; sensor.[PQR].noise stands for three, as in a shell"
        )
    for _, parameter in found:
        if parameter.name in DRAWN:
            raise ParameterError(f"{parameter.name} is drawn for every run, and cannot be set")
    return found


def read_axis(text: str) -> Axis:
    """Axis that is written NAME=LOW:HIGH, NAME=LOW:HIGH:COUNT or NAME=A,B,C.

    The last value may have a unit. ParameterError says what is wrong.
    """
    name, equals, numbers = text.partition("=")
    if not (name and equals and numbers):
        raise ParameterError(f"axis {text!r} must be NAME={RANGE}, or NAME=A,B,C")
    places = _places_of_axis(name)
    units = list(dict.fromkeys(parameter.unit for _, parameter in places))
    for _, parameter in places:
        if type(parameter.default) not in (int, float):
            raise ParameterError(f"{parameter.name} is no number, and no axis: {parameter.valid}")
    if len(units) > 1:
        raise ParameterError(f"{name} stands for parameters in {' and in '.join(units)}")
    unit = units[0] if units else ""
    written = read_values(name, numbers, unit, COUNT)
    values = written.numbers
    for node, parameter in places or (("map", LEVEL),):
        for end in (values[0], values[-1]):
            parameter.check(node, _typed(parameter, end))
    return Axis(name, unit, values, places, written)


def _places_of_axis(name: str) -> Places:
    if name == LEVEL.name:
        return ()
    return ((WHERE, CONDITIONS[name]),) if name in CONDITIONS else places_of(name)


def read_settings(texts: Sequence[str]) -> Settings:
    """Places and value of each NAME=VALUE; ParameterError says what is wrong with one."""
    values = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise ParameterError(f"setting {text!r} must be NAME=VALUE")
        try:
            values[name] = yaml.safe_load(value)
        except yaml.YAMLError:
            raise ParameterError(f"setting {text!r} has a value that is none") from None
    return settings_of(values)


def settings_of(values: Mapping[str, object]) -> Settings:
    """Places of each name, and its value; ParameterError says what is wrong with one."""
    settings = {}
    for name, value in values.items():
        if name == LEVEL.name:
            raise ParameterError("the level is no parameter of a node: it is set by --level")
        if name in (MACH.name, MASS.name):
            raise ParameterError(
                f"{name} is no parameter of a node: it is set by an axis; --set has "
                "velocity.speed, initial.mass and the rest of docs/parameters.md"
            )
        settings[name] = places_of(name), value
    return settings


def with_value(given: Given, places: Places, value: object) -> Given:
    """Return the parameters by node with `value` at all of these places."""
    changed = {node: dict(values) for node, values in given.items()}
    for node, parameter in places:
        changed.setdefault(node, {})[parameter.name] = _typed(parameter, value)
    return changed


def _typed(parameter: Parameter, value: object) -> object:
    """An integer where the parameter is one and the value whole."""
    whole = type(parameter.default) is int and isinstance(value, float) and value.is_integer()
    return int(value) if whole else value


def set_apart(x: Axis, y: Axis, settings: Settings) -> None:
    """Raise ParameterError if two of them set the same."""
    of_axes = [(axis.name, _set_by(axis)) for axis in (x, y)]
    of_settings = [(name, _names(places)) for name, (places, _) in settings.items()]
    taken: dict[tuple[str, str], str] = {}
    if x.name in CONDITIONS or y.name in CONDITIONS:
        taken = {("plant", parameter): f"the {WHERE}" for parameter in MOVED}
    for name, places in [*of_axes, *of_settings]:
        for place in places:
            other = taken.setdefault(place, name)
            if other is not name:
                raise ParameterError(f"{other} and {name} both set {place[1]}")


def _set_by(axis: Axis) -> list[tuple[str, str]]:
    if axis.name in CONDITIONS:
        return [COMMANDED[axis.name]]
    return _names(axis.places or (("map", LEVEL),))


def _names(places: Places) -> list[tuple[str, str]]:
    return [(node, parameter.name) for node, parameter in places]
