# Copyright 2026 ahv developers, Apache-2.0
"""Parameters of the node `guidance`, and the settings that they make.

Transitions and waypoints are texts, so that each stands in one place: `24500 at 10 over 60; 24000
at 300` changes to 24 500 from 10 s on in 60 s, and to 24 000 at once at 300 s. Without any, what
is followed is the altitude and the speed of section 3.5.2.
"""

import re
from collections.abc import Mapping
from itertools import pairwise
from math import isfinite

import numpy as np

from ahv_control.guidance import Guidance
from ahv_control.guided_flight import Plan
from ahv_control.route import Route, Waypoints
from ahv_control.schedule import KEEPS, Schedule, Transitions
from ahv_control.selected import RateLimits, Selection
from ahv_msgs_py.layout import excerpt
from ahv_msgs_py.parameters import Parameter, ParameterError, Value
from ahv_plant.model.constants import RADIANS, STEP
from ahv_plant.start import GEOMETRIC_ALTITUDE

NUMBER = r"([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)"
TRANSITION = re.compile(rf"{NUMBER} at {NUMBER}(?: over {NUMBER})?")
WAYPOINT = re.compile(rf"x {NUMBER} y {NUMBER} h {NUMBER} u {NUMBER}")
MOST = 50  # transitions or waypoints
LATEST = 1e6  # [s]
FARTHEST = 1e8  # [m]
WIDEST = 3600.0  # [deg] ten turns
SHAPES = ("smooth", "ramp")

GUIDED = Parameter("guided", False, "follow /ahv/reference; if false, hold altitude and speed")
_TRANSITIONS = "VALUE at TIME over TIME [s], one behind the other with ';' between; a step if "
_TRANSITIONS += "nothing is over"
_PARAMETERS = (
    GUIDED,
    Parameter("altitude", 24000.0, "altitude h* at the start", "m", 0.0, 48000.0),
    Parameter("speed", 1786.4, "speed u* at the start", "m/s", 0.0, 8000.0),
    Parameter("heading", 0.0, "heading psi* at the start", "deg", -360.0, 360.0),
    Parameter("altitude_changes", "", f"altitudes [m] to change to: {_TRANSITIONS}"),
    Parameter("speed_changes", "", f"speeds [m/s] to change to: {_TRANSITIONS}"),
    Parameter("heading_changes", "", f"headings [deg] to change to: {_TRANSITIONS}"),
    Parameter("shape", SHAPES[0], "of what takes time", choices=SHAPES),
    Parameter("keeps", KEEPS[0], "what stays as it is in a climb", choices=KEEPS),
    Parameter(
        "waypoints",
        "",
        "to be flown over instead: x NORTH [m] y EAST [m] h ALTITUDE [m] u SPEED [m/s], one "
        "behind the other with ';' between",
    ),
    Parameter(
        "selected",
        "",
        "in flight, to be flown instead of the profile: h ALTITUDE [m] u SPEED [m/s] psi HEADING "
        "[deg] or some of the three; what is not named stays as it is",
    ),
    Parameter("capture_radius", 10e3, "distance within which one is reached", "m", 1.0, 1e6),
    Parameter("build_up", 10.0, "time in which rates are built up to waypoints", "s", 0.1, 1e3),
    Parameter("climb_rate", 15.0, "limit of climbs to waypoints", "m/s", 0.1, 1e3),
    Parameter("acceleration", 0.5, "limit of changes of speed to waypoints", "m/s^2", 0.01, 100.0),
    Parameter("turn_rate", 0.15, "limit of turns to waypoints", "deg/s", 0.001, 10.0),
    Parameter("coordinated", True, "bank into turns; if false, turn by sideslip as in chapter 3"),
    Parameter("bank_limit", 45.0, "bank that is never exceeded", "deg", 0.0, 80.0),
    Parameter("feed_forward", False, "send the rates of the reference; if false, zeros"),
    GEOMETRIC_ALTITUDE,
)
AT_START = (GUIDED.name, "altitude", "speed", "heading", GEOMETRIC_ALTITUDE.name)
GUIDANCE_PARAMETERS = tuple(
    entry if entry.name in AT_START else entry._replace(in_flight=True) for entry in _PARAMETERS
)


def plan(values: Mapping[str, Value]) -> Plan:
    """Plan of checked parameters; ParameterError names what does not go together."""
    limits = RateLimits(
        float(values["climb_rate"]),
        float(values["acceleration"]),
        float(values["turn_rate"]) * RADIANS,
        float(values["build_up"]),
    )
    return Plan(guidance(values), selection(str(values["selected"])), limits)


def selection(text: str) -> Selection | None:
    """What a text selects, None if it is empty; ParameterError names what is wrong with it."""
    words = text.split()
    given = dict(zip(words[::2], words[1::2], strict=False))
    fits = 2 * len(given) == len(words) and given.keys() <= {"h", "u", "psi"}
    if not fits or not all(re.fullmatch(NUMBER, number) for number in given.values()):
        raise ParameterError(
            f"guidance: selected is {excerpt(text)}, but must be like 'h 25000 u 1800 psi 10' or "
            "have some of these three"
        )
    numbers = {name: float(number) for name, number in given.items()}
    heading = numbers.get("psi")
    if heading is not None and not abs(heading) <= WIDEST:
        raise ParameterError(f"guidance: selected: psi must be within {WIDEST:g} deg of north")
    psi = None if heading is None else heading * RADIANS
    return Selection(numbers.get("h"), numbers.get("u"), psi) if words else None


def guidance(values: Mapping[str, Value]) -> Guidance:
    """Guidance of checked parameters; ParameterError names what does not go together."""
    route = _route(values)
    schedule = Schedule(
        _transitions(values, "altitude", 1.0),
        _transitions(values, "speed", 1.0),
        _transitions(values, "heading", RADIANS),
        values["shape"] == SHAPES[0],
        KEEPS.index(str(values["keeps"])),
        bool(values["geometric_altitude"]),
    )
    return Guidance(
        schedule,
        route,
        1.0 if values["coordinated"] else 0.0,
        1.0 if values["feed_forward"] else 0.0,
        float(values["bank_limit"]) * RADIANS,
    )


def _entries(
    values: Mapping[str, Value], name: str, pattern: re.Pattern[str], example: str
) -> list[list[float]]:
    """Numbers of the entries of a text; what an entry leaves out is zero."""
    text = str(values[name]).strip()
    entries = [" ".join(part.split()) for part in text.split(";")] if text else []
    if len(entries) > MOST:
        raise ParameterError(f"guidance: {name} has {len(entries)} entries; {MOST} are the most")
    found = []
    for entry in entries:
        match = pattern.fullmatch(entry)
        numbers = [float(number or 0.0) for number in match.groups()] if match else []
        if not match or not all(map(isfinite, numbers)):
            raise ParameterError(
                f"guidance: {name} has {excerpt(entry)}, but an entry must be like {example!r}"
            )
        found.append(numbers)
    return found


def _transitions(values: Mapping[str, Value], name: str, unit: float) -> Transitions:
    """Transitions (n, 4) of a quantity: at [s], from, to in `unit`, over [s]."""
    field = f"{name}_changes"
    start = float(values[name])
    rows = [[0.0, start, start, 0.0]]
    for value, at, over in _entries(values, field, TRANSITION, "24500 at 10 over 60"):
        _, _, before, _ = rows[-1]
        if not (0.0 <= at <= LATEST and 0.0 <= over <= LATEST):
            raise ParameterError(
                f"guidance: {field} has a time of {at if at < 0.0 or at > LATEST else over:g} s, "
                f"but times must be 0 to {LATEST:g} s"
            )
        rows.append([at, before, value, over])
    for (at, _, _, over), (later, *_) in pairwise(rows):
        if later < at + over:
            raise ParameterError(
                f"guidance: {field} has a change at {later:g} s, but the one before lasts until "
                f"{at + over:g} s"
            )
    table = np.array(rows)
    if name == "heading" and np.abs(table[:, 2]).max() > WIDEST:
        raise ParameterError(f"guidance: {field} must be within {WIDEST:g} deg of north")
    table[:, 0] = np.round(table[:, 0] / STEP) * STEP  # steps are whole
    table[:, 1:3] *= unit
    return table


def _route(values: Mapping[str, Value]) -> Route | None:
    points: Waypoints = np.array(
        _entries(values, "waypoints", WAYPOINT, "x 300e3 y 20e3 h 25000 u 1800")
    )
    if not len(points):
        return None
    for name in ("altitude_changes", "speed_changes", "heading_changes"):
        if values[name]:
            raise ParameterError(
                f"guidance: {name} is {excerpt(str(values[name]))}, but must be empty beside "
                "waypoints, which say when to change"
            )
    if values["keeps"] != KEEPS[0]:
        raise ParameterError(
            f"guidance: keeps is {excerpt(str(values['keeps']))}, but must be {KEEPS[0]} beside "
            "waypoints, which have speeds"
        )
    if np.abs(points[:, :2]).max() > FARTHEST:
        raise ParameterError(f"guidance: waypoints must be within {FARTHEST:g} m of the origin")
    return Route(
        points,
        float(values["capture_radius"]),
        float(values["build_up"]),
        float(values["climb_rate"]),
        float(values["acceleration"]),
        float(values["turn_rate"]) * RADIANS,
    )
