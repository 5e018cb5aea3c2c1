"""A flight in this process, without ROS: the same laws and vehicle, composed the same way."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from ahv_analysis.bag_writer import BagWriter
from ahv_analysis.case import Case, notes
from ahv_control.flight_control import NEUTRAL, Commands, flight_control
from ahv_msgs_py.layout import NANOSECONDS, clock_bytes
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    CLOCK,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
)
from ahv_plant.constants import STEP_NS
from ahv_plant.departure import departure, departure_reason
from ahv_plant.state import State
from ahv_plant.vehicle import vehicle_step


class Step(NamedTuple):
    """One step of a flight: the state and what the flight control answers."""

    stamp: int  # [ns]
    state: State
    commands: Commands


def fly(case: Case) -> Iterator[Step]:
    """Fly `case`: its steps 0 to N, or fewer if the vehicle departs from the model."""
    state = case.plant.initial
    surfaces = NEUTRAL
    for step in range(case.plant.steps + 1):
        commands = flight_control(state, surfaces, case.control)
        surfaces = commands.surfaces
        yield Step(step * STEP_NS, state, commands)
        if departure(state, case.plant.geometric):
            return
        state = vehicle_step(state, surfaces, commands.throttle, case.plant.geometric)


def fly_library(
    case: Case, path: Path, *, progress: Callable[[int], None] = lambda steps: None
) -> tuple[str, float]:
    """Fly `case` and record it to the bag `path`, as `fly_graph` does.

    `progress(steps)` is called now and then. Returns why the flight ended early (empty if it did
    not) and the seconds that it took.
    """
    bag = BagWriter(path, notes(case))
    started = time.perf_counter()
    for step in fly(case):
        write_step(bag, step)
        if step.stamp % NANOSECONDS == 0:
            progress(step.stamp // STEP_NS)
    wall = time.perf_counter() - started
    bag.close()
    return departure_reason(step.state, case.plant.geometric, step.stamp / NANOSECONDS), wall


def write_step(bag: BagWriter, step: Step) -> None:
    """File a step as the recorder files the messages of the graph."""
    answers = step.commands
    bag.write(CLOCK.name, clock_bytes(step.stamp))
    for topic, values in (
        (STATE, step.state),
        (ATTITUDE_COMMAND, answers.attitude),
        (RATE_COMMAND, answers.rates),
        (SURFACE_COMMAND, answers.surfaces),
        (THROTTLE_COMMAND, (answers.throttle,)),
    ):
        bag.write(topic.name, topic.layout.encode(step.stamp, values))
