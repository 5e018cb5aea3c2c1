# Copyright 2026 ahv developers, Apache-2.0
"""The plant: from commands to the next measurement, through hardware if there is any.

Commands travel, actuators move, the vehicle flies, sensors look. Ideal hardware is None: commands
act at once, and the flight software is told the state as it is.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_plant.dispersion import Truth
from ahv_plant.hardware.delay import line_at, through
from ahv_plant.hardware.motion import (
    Actuators,
    Servos,
    resting_servos,
    step_on_actuators,
)
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import (
    Controls,
    Measurement,
    State,
    Surfaces,
    limit_throttle,
)
from ahv_plant.numerics.optional import optional
from ahv_plant.vehicle import vehicle_step


class Hardware(NamedTuple):
    """What is not ideal."""

    actuators: Actuators
    delay: int  # [steps] from a measured state to the arrival of its commands
    start: Controls  # where the actuators rest before the first command arrives


class Draws(NamedTuple):
    """What chance has for one step."""

    late: float  # 1 where the commands take a step longer, else 0


class Rig(NamedTuple):
    """The hardware of one flight: what it is, and the commands under way in it."""

    hardware: Hardware
    line: NDArray[np.float64]


class Plant(NamedTuple):
    """The plant at one step."""

    state: State  # true
    positions: Controls  # true, of the controls
    measured: Measurement
    servos: Servos | None  # None with ideal hardware


def make_rig(hardware: Hardware | None, lanes: int | None = None) -> Rig | None:
    """Hardware at the start of a flight, or of one in each of so many lanes; None if ideal."""
    return None if hardware is None else Rig(hardware, line_at(hardware.start, lanes))


def _ideal_start(state: State, draws: None) -> Plant:
    surfaces = Surfaces(0.0, 0.0, 0.0)
    return Plant(state, Controls(surfaces, 0.0), Measurement(state, surfaces), None)


def _start(state: State, draws: Draws, rig: Rig) -> Plant:
    hardware = rig.hardware
    measured = Measurement(state, hardware.start.surfaces)
    servos = resting_servos(hardware.start, hardware.actuators)
    return Plant(state, hardware.start, measured, servos)


# start_plant(state, draws, rig): the plant at the first state of a flight
start_plant = optional(_start, otherwise=_ideal_start)


def _ideal_step(plant: Plant, command: Controls, number: int, truth: Truth, draws: None) -> Plant:
    state = vehicle_step(plant.state, command.surfaces, command.throttle, number * STEP, truth)
    return Plant(state, command, Measurement(state, command.surfaces), None)


def _step(
    plant: Plant, command: Controls, number: int, truth: Truth, draws: Draws, rig: Rig
) -> Plant:
    hardware = rig.hardware
    sent = Controls(command.surfaces, limit_throttle(command.throttle))
    acting = through(rig.line, sent, number, hardware.delay, draws.late)
    time = number * STEP
    assert plant.servos is not None
    state, servos, controls = step_on_actuators(
        plant.state, plant.servos, acting, time, truth, hardware.actuators
    )
    measured = Measurement(state, controls.surfaces)
    return Plant(state, controls, measured, servos)


# plant_step(plant, command, number, truth, draws, rig): the plant 0.01 s later; `number` counts
# the steps flown before, `draws` are for the measurement after the step
plant_step = optional(_step, otherwise=_ideal_step)
