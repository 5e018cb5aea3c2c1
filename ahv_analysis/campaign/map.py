# Copyright 2026 ahv developers, Apache-2.0
"""Maps: the success rate over two parameters, a campaign of the same draws at every point."""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property, partial
from pathlib import Path
from threading import Event, Lock
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from ahv_analysis.campaign.campaign import Campaign, fly_campaign
from ahv_analysis.campaign.summary import summarize_campaign
from ahv_analysis.flight.case import make_case
from ahv_msgs_py.graph import NODES, case_nodes
from ahv_msgs_py.parameters import Parameter, ParameterError, meant
from ahv_plant.dispersion import HIGHEST_LEVEL, Dispersion

LEVEL = Parameter("level", 0.3, "dispersion of the draws", "", 0.0, HIGHEST_LEVEL)
DRAWN = {"noise.seed", "noise.run", *(f"dispersion.{name}" for name in Dispersion._fields)}
COUNT = 6  # values of an axis, if it is not said
POINTS_AT_ONCE = 16  # so that points of few runs keep every worker busy
AXIS = re.compile(r"([^=]+)=([^:]+):([^:]+)(?::([^:]+))?")

Given = Mapping[str, Mapping[str, object]]  # parameters by node
Places = tuple[tuple[str, Parameter], ...]  # nodes, and the parameter of each; none: the level


class Axis(NamedTuple):
    """An axis of a map."""

    name: str  # of a parameter, a pattern of such names, or `level`
    unit: str
    values: tuple[float, ...]  # in this unit, from low to high
    places: Places

    @property
    def title(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit or '-'}]"


def places_of(name: str) -> Places:
    """Every parameter of the nodes that has this name, or one like this shell pattern."""
    known = [(node, parameter) for node in case_nodes() for parameter in NODES[node].parameters]
    found = tuple(place for place in known if fnmatchcase(place[1].name, name))
    if not found:
        names = ["level", *(parameter.name for _, parameter in known)]
        raise ParameterError(
            f"no node has a parameter {name!r}; {meant(name, names)}"
            "docs/parameters.md lists them; sensor.[PQR].noise stands for three, as in a shell"
        )
    for _, parameter in found:
        if parameter.name in DRAWN:
            raise ParameterError(f"{parameter.name} is drawn for every run, and cannot be set")
    return found


def read_axis(text: str) -> Axis:
    """Axis that is written NAME=LOW:HIGH or NAME=LOW:HIGH:COUNT; ParameterError says why not."""
    match = AXIS.fullmatch(text)
    if match is None:
        raise ParameterError(f"axis {text!r} must be NAME=LOW:HIGH or NAME=LOW:HIGH:COUNT")
    name, *numbers = match.groups(default=str(COUNT))
    try:
        low, high, count = float(numbers[0]), float(numbers[1]), int(numbers[2])
    except ValueError:
        raise ParameterError(
            f"axis {text!r} must have numbers for LOW and HIGH, an integer for COUNT"
        ) from None
    if not low < high:
        raise ParameterError(f"{name}: LOW is {low:g}, but must be below HIGH, {high:g}")
    if count < 2:
        raise ParameterError(f"{name}: COUNT is {count}, but must be 2 or more")
    places = () if name == LEVEL.name else places_of(name)
    for node, parameter in places or (("map", LEVEL),):
        for end in (low, high):
            parameter.check(node, _typed(parameter, end))
        if type(parameter.default) not in (int, float):
            raise ParameterError(f"{parameter.name} is no number, and no axis")
    units = list(dict.fromkeys(parameter.unit for _, parameter in places))
    if len(units) > 1:
        raise ParameterError(f"{name} stands for parameters in {' and in '.join(units)}")
    values = tuple(float(f"{value:.12g}") for value in np.linspace(low, high, count))
    return Axis(name, units[0] if units else "", values, places)


def read_settings(texts: Sequence[str]) -> dict[str, tuple[Places, object]]:
    """Places and value of each NAME=VALUE; ParameterError says what is wrong with one."""
    settings = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise ParameterError(f"setting {text!r} must be NAME=VALUE")
        if name == LEVEL.name:
            raise ParameterError("the level is no parameter of a node: it is set by --level")
        try:
            settings[name] = places_of(name), yaml.safe_load(value)
        except yaml.YAMLError:
            raise ParameterError(f"setting {text!r} has a value that is none") from None
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


@dataclass(frozen=True)
class Map:
    """What is flown: `runs` vehicles at every point, those of the same seed."""

    case: str
    given: Given  # its parameters: those that the axes do not set
    x: Axis
    y: Axis
    level: float  # [-] where no axis is the level
    runs: int
    seed: int

    @cached_property
    def campaigns(self) -> dict[tuple[float, float], Campaign]:
        """Campaign of each point (x, y), row by row; ParameterError if one cannot be flown."""
        return {(x, y): self._campaign(x, y) for y in self.y.values for x in self.x.values}

    def _campaign(self, x: float, y: float) -> Campaign:
        given, level = self.given, self.level
        for axis, value in ((self.x, x), (self.y, y)):
            if axis.places:
                given = with_value(given, axis.places, value)
            else:
                level = value
        return Campaign(make_case(self.case, given), level, self.runs, self.seed)

    def folder(self, out: Path, x: float, y: float) -> Path:
        """Folder of a point's campaign: a finer map takes what a coarser one flew."""
        return out / "points" / f"{self.x.name}={x:.12g},{self.y.name}={y:.12g}"


def set_apart(x: Axis, y: Axis, settings: Mapping[str, tuple[Places, object]]) -> None:
    """Raise ParameterError if two of them set the same."""
    of_axes = [(x.name, x.places or (("map", LEVEL),)), (y.name, y.places or (("map", LEVEL),))]
    taken: dict[tuple[str, str], str] = {}
    for name, places in [*of_axes, *((name, places) for name, (places, _) in settings.items())]:
        for node, parameter in places:
            other = taken.setdefault((node, parameter.name), name)
            if other is not name:
                raise ParameterError(f"{other} and {name} both set {parameter.name}")


class Point(NamedTuple):
    """What the campaign of a point came to: a row of the map's file."""

    x: float
    y: float
    runs: int
    successes: int
    success_rate: float  # [-]
    interval_low: float  # [-] exact, of 95 %
    interval_high: float
    beyond_saving: int  # vehicles that pass 5 deg whatever is commanded


def fly_map(
    flown: Map,
    out: Path,
    executor: Executor,
    progress: Callable[[int], None] = lambda runs: None,
    interrupted: Callable[[], bool] = lambda: False,
) -> list[Point]:
    """Fly what `out` does not hold yet of a map; its points, row by row.

    Once `interrupted()` it ends without points, and the folder keeps what was flown. Raises what
    `fly_campaign` does.
    """
    campaigns = flown.campaigns
    failed, lock, done = Event(), Lock(), dict.fromkeys(campaigns, 0)

    def ended() -> bool:
        return interrupted() or failed.is_set()

    def told(point: tuple[float, float], runs: int) -> None:
        with lock:
            done[point] = runs
            progress(sum(done.values()))

    def fly(point: tuple[float, float]) -> None:
        if ended():
            return
        try:
            folder = flown.folder(out, *point)
            fly_campaign(campaigns[point], folder, executor, partial(told, point), ended)
        except BaseException:
            failed.set()
            raise

    with ThreadPoolExecutor(POINTS_AT_ONCE) as points:
        for _ in points.map(fly, campaigns):
            pass
    if interrupted():
        return []
    return [
        _point(point, summarize_campaign(campaign, flown.folder(out, *point)))
        for point, campaign in campaigns.items()
    ]


def _point(point: tuple[float, float], summary: Mapping[str, Any]) -> Point:
    runs, successes = summary["runs"], summary["successes"]
    interval, beyond_saving = summary["interval"], summary["beyond_saving"]
    return Point(*point, runs, successes, summary["success_rate"], *interval, beyond_saving)


def write_map(out: Path, points: Sequence[Point], described: Mapping[str, Any]) -> None:
    """Write the points as a table, and as JSON with what describes them."""
    rows = [point._asdict() for point in points]
    table = pa.Table.from_pylist(rows)
    text = json.dumps(described)
    pq.write_table(table.replace_schema_metadata({"ahv": text}), out / "map.parquet")
    content = json.dumps({**described, "points": rows}, indent=2)
    (out / "map.json").write_text(content + "\n", encoding="utf-8")


def rates(flown: Map, points: Sequence[Point]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Success rates [-], a row a value of y."""
    found = np.array([point.success_rate for point in points])
    return found.reshape(len(flown.y.values), len(flown.x.values))
