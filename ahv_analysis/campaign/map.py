# Copyright 2026 ahv developers, Apache-2.0
"""Maps: the success rate over two parameters, a campaign of the same draws at every point."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from threading import Event, Lock
from typing import Any, NamedTuple

import numpy as np

from ahv_analysis.campaign.axis import LEVEL, Axis, Settings, read_axis, set_apart, with_value
from ahv_analysis.campaign.campaign import Campaign, fly_campaign
from ahv_analysis.campaign.condition import CONDITIONS, Given, at_condition
from ahv_analysis.campaign.summary import summarize_campaign
from ahv_analysis.flight.case import make_case, read_case
from ahv_analysis.point_file import write_points
from ahv_msgs_py.parameters import ParameterError

POINTS_AT_ONCE = 16  # so that points of few runs keep every worker busy


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
    def _points(self) -> dict[tuple[float, float], Campaign | str]:
        """Campaign of each point, row by row, or why it has no trim to start at."""
        return {(x, y): self._campaign(x, y) for y in self.y.values for x in self.x.values}

    @property
    def campaigns(self) -> dict[tuple[float, float], Campaign]:
        """Campaign of each point (x, y), row by row, but of those that have no trim.

        ParameterError if one cannot be flown, or none has a trim.
        """
        found = {at: one for at, one in self._points.items() if isinstance(one, Campaign)}
        if not found:
            reasons = ", ".join(dict.fromkeys(self.without_trim.values()))
            raise ParameterError(f"no point of the map has a trim to start at: {reasons}")
        return found

    @property
    def without_trim(self) -> dict[tuple[float, float], str]:
        """Points (x, y) at which the nominal vehicle has no trim within its limits, and why."""
        return {at: why for at, why in self._points.items() if isinstance(why, str)}

    def _campaign(self, x: float, y: float) -> Campaign | str:
        given, level, conditions = self.given, self.level, {}
        for axis, value in ((self.x, x), (self.y, y)):
            if axis.name in CONDITIONS:
                conditions[axis.name] = value
            elif axis.places:
                given = with_value(given, axis.places, value)
            else:
                level = value
        if conditions:
            given, why = at_condition(self.case, given, conditions)
            if why:
                return why
        return Campaign(make_case(self.case, given), level, self.runs, self.seed)

    def folder(self, out: Path, x: float, y: float) -> Path:
        """Folder of a point's campaign: a finer map takes what a coarser one flew."""
        return out / "points" / f"{self.x.name}={x:.12g},{self.y.name}={y:.12g}"


def read_map(
    case: str,
    x: str,
    y: str,
    settings: Settings,
    *,
    level: float | None,
    runs: int,
    seed: int,
    hardware: str | None = None,
    profile: str | None = None,
) -> Map:
    """Map of a case over axes as `read_axis` reads them; ParameterError names what is wrong.

    `level` [-] is None where an axis sets it, or where it is the usual one. Hardware and profile
    are as in `load_case`.
    """
    axes = read_axis(x), read_axis(y)
    set_apart(*axes, settings)
    if LEVEL.name in (axes[0].name, axes[1].name) and level is not None:
        raise ParameterError(
            f"level is {level:g} (--level), but an axis sets it already: one of them must go"
        )
    chosen = float(LEVEL.check("map", LEVEL.default if level is None else level))
    name, parameters = read_case(case, hardware=hardware, profile=profile)
    given: Given = parameters
    for places, value in settings.values():
        given = with_value(given, places, value)
    return Map(name, given, *axes, chosen, runs, seed)


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
    with_trim: int  # vehicles that have a trim within the limits, alpha within 5 deg


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
    interval, bounds = (
        summary["interval"],
        (summary["beyond_saving"], summary["trim_within_5_deg"]),
    )
    return Point(*point, runs, successes, summary["success_rate"], *interval, *bounds)


def write_map(out: Path, points: Sequence[Point], described: Mapping[str, Any]) -> None:
    """Write the points as a table, and as JSON with what describes them."""
    write_points(out, "map", [point._asdict() for point in points], described)


def rates(flown: Map, points: Sequence[Point]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Success rates [-], a row a value of y; nan where there is no trim."""
    found = {(point.x, point.y): point.success_rate for point in points}
    return np.array([[found.get((x, y), np.nan) for x in flown.x.values] for y in flown.y.values])
