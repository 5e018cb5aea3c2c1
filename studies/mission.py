# Copyright 2026 ahv developers, Apache-2.0
"""A guided mission in real time, a process per node, of which nodes are killed: docs/guidance.md.

`python -m studies.mission` flies the profile `waypoints`, ten minutes by the wall clock. After a
third of it `guidance` is killed, after two thirds `inner_loop`; both are started again at once. It
says where the mission ended beside a flight in lockstep, of which no node is killed, and ends with
exit code 1 if that is off course.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ahv_analysis.bag.reader import Bag, flight_of, read
from ahv_analysis.bag.record import record_of
from ahv_analysis.bag.rows import Array
from ahv_analysis.errors import GraphError
from ahv_analysis.flight.case import Case, load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.process_per_node import (
    LONGEST_SILENCE,
    LONGEST_START,
    LOOK,
    ProcessGraph,
)
from ahv_analysis.report.summary import missing_states, summarize
from ahv_control.route import Route
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.node.log_folder import log_where_it_can
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.topics import BY_NAME
from ahv_plant.model.constants import STEP, STEP_NS
from ahv_plant.model.vectors import State

CASE, PROFILE = "neuro_adaptive_sc_gdi", "waypoints"
KILLED = {"guidance": 1.0 / 3.0, "inner_loop": 2.0 / 3.0}  # shares of the mission


ALTITUDE, SPEED = 50.0, 5.0  # [m], [m/s] off at the end, beside a flight that nobody disturbed


class Course(NamedTuple):
    """Where a flight went beside another one."""

    missed: list[float]  # [m] at which it passed each waypoint that the other one reached
    altitude: float  # [m] above it at the end
    speed: float  # [m/s] faster than it at the end


def fly_mission(case: Case, bag: Path, killed: Mapping[str, float]) -> str:
    """Fly `case` in real time; kill nodes at times [s] of the flight, start them again at once.

    Returns why the flight ended early, empty if it did not; GraphError if the graph stops.
    """
    keep_to_this_machine(shared_memory=False)
    log_where_it_can()
    due = dict(killed)
    last, since = -1, time.monotonic() + LONGEST_START
    with ProcessGraph(case, bag, realtime=True) as graph:
        while (reason := graph.report.ended(LOOK)) is None:
            step, now = graph.report.step, time.monotonic()
            if step != last:
                last, since = step, now
            elif now - since > LONGEST_SILENCE:
                raise GraphError(f"the graph stopped at step {step}")
            for name in [name for name, at in due.items() if step * STEP >= at]:
                del due[name]
                graph.kill(name)
                graph.start(name)
            ended = graph.ended().keys() & set(graph.controllers)
            if ended:
                raise GraphError(f"{', '.join(ended)} ended in flight")
    return reason


def missed(states: Array, route: Route) -> list[float]:
    """Distances [m] at which states (N+1, 13) pass the waypoints of a route."""
    x, y = (states[:, State._fields.index(name)] for name in "xy")
    return [float(np.min(np.hypot(x - place[0], y - place[1]))) for place in route.waypoints]


def course(states: Array, undisturbed: Array, route: Route) -> Course:
    """How far a flight of states (N+1, 13) went off its route, beside an `undisturbed` one."""
    distances = zip(missed(states, route), missed(undisturbed, route), strict=True)
    h, u = (State._fields.index(name) for name in "hu")
    end = states[-1] - undisturbed[-1]
    reached = [here for here, there in distances if there < route.radius]
    return Course(reached, float(end[h]), float(end[u]))


def on_course(found: Course, route: Route) -> bool:
    """Whether waypoints were reached, and the end is as high and as fast as it should be."""
    reached = all(distance < route.radius for distance in found.missed)
    return reached and abs(found.altitude) < ALTITUDE and abs(found.speed) < SPEED


def longest_silence(bag: Bag, name: str) -> float:
    """Longest time [s] of a flight in which a node answered no state."""
    silences = (np.diff(bag.series[BY_NAME[topic]].stamps) for topic in NODES[name].sends)
    return float(max(map(np.max, silences)) - STEP_NS) / NANOSECONDS


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--hardware", default=None)
    chosen = parser.parse_args()
    case = load_case(CASE, {"duration": chosen.seconds}, hardware=chosen.hardware, profile=PROFILE)
    undisturbed = record_of(fly(case), case.plant.truth.geometric)
    killed = {name: share * chosen.seconds for name, share in KILLED.items()}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        started = time.perf_counter()
        ended_early = fly_mission(case, path, killed)
        wall = time.perf_counter() - started
        bag = read(path)
        flown = flight_of(bag)
        missing = missing_states(bag, case.plant.steps)
        summary = summarize(flown, ended_early, missing)
        silences = {name: longest_silence(bag, name) for name in KILLED}
    route = case.control.guidance.route
    found = course(flown.states[:], undisturbed.states[: len(flown.stamps)], route)
    print(f"{CASE}, {PROFILE}: {chosen.seconds:g} s at 100 Hz in {wall:.0f} s, a process per node")
    for name, at in killed.items():
        print(f"{name} killed at {at:g} s: longest silence {silences[name]:.2f} s of flight")
    verdict = summary["cause"].replace("_", " ")
    print(f"{verdict}, largest |alpha| {summary['max_abs_alpha_deg']:.2f} deg, {missing} missing")
    passed = ", ".join(f"{distance / 1e3:.2f}" for distance in found.missed)
    print(f"waypoints passed at {passed} km of the {route.radius / 1e3:g} that count as reached")
    print(
        f"at the end, beside the flight that nobody disturbed: {found.altitude:+.2f} m in "
        f"altitude, {found.speed:+.3f} m/s in speed"
    )
    if not (summary["success"] and on_course(found, route)):
        sys.exit("off course")


if __name__ == "__main__":
    main()
