# Copyright 2026 ahv developers, Apache-2.0
"""The plant: from commands to the next measurement, through hardware if there is any.

Commands travel, actuators move, the vehicle flies, sensors look. Ideal hardware is None: commands
act at once, and the flight software is told the state as it is. Turbulent air needs draws, as
noise does, so a flight through it has hardware, even if every part of that is ideal.
"""

from collections.abc import Iterator
from itertools import repeat
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_plant.dispersion import Truth
from ahv_plant.hardware.delay import line_at, through
from ahv_plant.hardware.motion import Actuators, Servos, resting_servos, step_on_actuators
from ahv_plant.hardware.noise import GUSTS, Draws, NoiseStream, draws_of, noisy_channels
from ahv_plant.hardware.sensors import (
    Noise,
    SensorMemory,
    Sensors,
    first_measurement,
    measure,
)
from ahv_plant.hardware.wind import (
    TurbulentAir,
    Wind,
    calm_air,
    is_turbulent,
    through_air,
    turbulent_air,
)
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import Controls, Measurement, State, Surfaces, limit_throttle
from ahv_plant.numerics.optional import optional
from ahv_plant.vehicle import vehicle_step

DRAWN = 500  # steps of draws in memory at a time


class Hardware(NamedTuple):
    """What is not ideal."""

    actuators: Actuators
    delay: int  # [steps] from a measured state to the arrival of its commands
    jitter: float  # [-] share of the commands that take a step longer
    sensors: Sensors | None
    start: Controls  # where the actuators rest before the first command arrives


class Rig(NamedTuple):
    """The hardware of one flight: what it is, and the commands under way in it."""

    hardware: Hardware
    line: NDArray[np.float64]


class Plant(NamedTuple):
    """The plant at one step."""

    state: State  # true
    controls: Controls  # true positions
    measured: Measurement
    servos: Servos | None  # None with ideal hardware
    sensors: SensorMemory | None  # None with perfect sensors
    turbulence: TurbulentAir | None  # through the next step; None where the air has none


def rig(hardware: Hardware | None) -> Rig | None:
    """Hardware before a flight; None if it is ideal."""
    return None if hardware is None else Rig(hardware, line_at(hardware.start))


def noise_stream(hardware: Hardware, wind: Wind | None, seed: int, run: int) -> NoiseStream:
    """Draws of the run `run` of the campaign `seed` on this hardware in this wind."""
    gusts = GUSTS if is_turbulent(wind) else ()
    channels = (*noisy_channels(hardware.sensors), *gusts)
    return NoiseStream(seed, run, channels, hardware.jitter)


def all_draws(
    hardware: Hardware | None, wind: Wind | None, seed: int, run: int
) -> Iterator[Draws | None]:
    """The same step by step, without end; None each time if the hardware is ideal."""
    if hardware is None:
        yield from repeat(None)
        return
    stream = noise_stream(hardware, wind, seed, run)
    while True:
        yield from map(draws_of, stream.block(DRAWN))


def _measured_first(
    state: State, moving: State, surfaces: Surfaces, noise: Noise, sensors: Sensors
) -> tuple[SensorMemory, Measurement]:
    return first_measurement(state, moving, surfaces, noise, sensors)


def _measured(
    memory: SensorMemory,
    state: State,
    moving: State,
    surfaces: Surfaces,
    noise: Noise,
    sensors: Sensors,
) -> tuple[SensorMemory, Measurement]:
    return measure(memory, state, moving, surfaces, noise, sensors)


def _known_first(
    state: State, moving: State, surfaces: Surfaces, noise: Noise
) -> tuple[None, Measurement]:
    return None, Measurement(state, surfaces)


def _known(
    memory: None, state: State, moving: State, surfaces: Surfaces, noise: Noise
) -> tuple[None, Measurement]:
    return None, Measurement(state, surfaces)


_first_look = optional(_measured_first, otherwise=_known_first)
_look = optional(_measured, otherwise=_known)


def _ideal_start(state: State, truth: Truth, draws: None) -> Plant:
    controls = Controls(Surfaces(0.0, 0.0, 0.0), 0.0)
    return Plant(state, controls, Measurement(state, controls.surfaces), None, None, None)


def _start(state: State, truth: Truth, draws: Draws, rig: Rig) -> Plant:
    controls, sensors = rig.hardware.start, rig.hardware.sensors
    turbulence = calm_air(truth.wind)
    moving = through_air(state, 0.0, turbulence, truth.wind)
    memory, measured = _first_look(state, moving, controls.surfaces, draws.noise, sensors)
    servos = resting_servos(controls, rig.hardware.actuators)
    return Plant(state, controls, measured, servos, memory, turbulence)


def _ideal_step(plant: Plant, command: Controls, number: int, truth: Truth, draws: None) -> Plant:
    state = vehicle_step(plant.state, command.surfaces, command.throttle, number * STEP, truth)
    return Plant(state, command, Measurement(state, command.surfaces), None, None, None)


def _step(
    plant: Plant, command: Controls, number: int, truth: Truth, draws: Draws, rig: Rig
) -> Plant:
    hardware = rig.hardware
    sent = Controls(command.surfaces, limit_throttle(command.throttle))
    arrived = through(rig.line, sent, number, hardware.delay, draws.late)
    assert plant.servos is not None
    state, servos, controls = step_on_actuators(
        plant.state,
        plant.servos,
        arrived,
        number * STEP,
        truth,
        hardware.actuators,
        plant.turbulence,
    )
    turbulence = turbulent_air(plant.turbulence, draws.gust, truth.wind)
    moving = through_air(state, (number + 1) * STEP, turbulence, truth.wind)
    memory, measured = _look(
        plant.sensors, state, moving, controls.surfaces, draws.noise, hardware.sensors
    )
    return Plant(state, controls, measured, servos, memory, turbulence)


# start_plant(state, truth, draws, rig): the plant at the first state of a flight
start_plant = optional(_start, otherwise=_ideal_start)
# plant_step(plant, command, number, truth, draws, rig): the plant 0.01 s later; `number` counts
# the steps flown before; the draws are for the command's way, and for air and measurement after
# the step
plant_step = optional(_step, otherwise=_ideal_step)
