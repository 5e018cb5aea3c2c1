# Copyright 2026 ahv developers, Apache-2.0
"""A vehicle on its actuators: one Runge-Kutta step of both together."""

from typing import NamedTuple

from ahv_plant.dispersion import Truth
from ahv_plant.hardware.actuators import (
    Actuator,
    Servo,
    along_servo,
    effect,
    in_the_wind,
    moved,
    ordered,
    resting,
    servo_rate,
    settled,
)
from ahv_plant.hardware.wind import TurbulentAir, through_air
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import Controls, State, Surfaces
from ahv_plant.numerics.elementary import atan2
from ahv_plant.numerics.elementwise import elementwise
from ahv_plant.vehicle import along, state_rate


class Actuators(NamedTuple):
    """One of each control."""

    right_elevon: Actuator
    left_elevon: Actuator
    rudder: Actuator
    throttle: Actuator  # the engine


class Servos(NamedTuple):
    """States of the actuators, or their rates."""

    right_elevon: Servo
    left_elevon: Servo
    rudder: Servo
    throttle: Servo


@elementwise
def resting_servos(start: Controls, by: Actuators) -> Servos:
    """Servos at rest with the controls at `start`."""
    return Servos(
        resting(start.surfaces.right_elevon, by.right_elevon),
        resting(start.surfaces.left_elevon, by.left_elevon),
        resting(start.surfaces.rudder, by.rudder),
        resting(start.throttle, by.throttle),
    )


@elementwise
def told_servos(servos: Servos, command: Controls, time: float, by: Actuators) -> Controls:
    """Where the servos are told to go at `time` [s]."""
    return Controls(
        Surfaces(
            ordered(servos.right_elevon, command.surfaces.right_elevon, time, by.right_elevon),
            ordered(servos.left_elevon, command.surfaces.left_elevon, time, by.left_elevon),
            ordered(servos.rudder, command.surfaces.rudder, time, by.rudder),
        ),
        ordered(servos.throttle, command.throttle, time, by.throttle),
    )


@elementwise
def servo_rates(servos: Servos, told: Controls, time: float, by: Actuators) -> Servos:
    """Rates of all servos at `time` [s]."""
    surfaces = told.surfaces
    return Servos(
        servo_rate(servos.right_elevon, surfaces.right_elevon, time, by.right_elevon),
        servo_rate(servos.left_elevon, surfaces.left_elevon, time, by.left_elevon),
        servo_rate(servos.rudder, surfaces.rudder, time, by.rudder),
        servo_rate(servos.throttle, told.throttle, time, by.throttle),
    )


@elementwise
def along_servos(servos: Servos, rates: Servos, time: float) -> Servos:
    """All servos moved along their rates for `time` [s]."""
    return Servos(
        along_servo(servos.right_elevon, rates.right_elevon, time),
        along_servo(servos.left_elevon, rates.left_elevon, time),
        along_servo(servos.rudder, rates.rudder, time),
        along_servo(servos.throttle, rates.throttle, time),
    )


@elementwise
def positions(
    moving: State, servos: Servos, told: Controls, time: float, by: Actuators
) -> Controls:
    """Where the controls are at `time` [s]; what is afloat lies in the wind, at -alpha or beta.

    `moving` is a state with the velocity against the air.
    """
    alpha = atan2(moving.w, moving.u)
    beta = atan2(moving.v, abs(moving.u))
    surfaces = told.surfaces
    right = moved(servos.right_elevon, surfaces.right_elevon, by.right_elevon)
    left = moved(servos.left_elevon, surfaces.left_elevon, by.left_elevon)
    rudder = moved(servos.rudder, surfaces.rudder, by.rudder)
    engine = moved(servos.throttle, told.throttle, by.throttle)
    return Controls(
        Surfaces(
            in_the_wind(right, -alpha, time, by.right_elevon),
            in_the_wind(left, -alpha, time, by.left_elevon),
            in_the_wind(rudder, beta, time, by.rudder),
        ),
        in_the_wind(engine, 0.0 * engine, time, by.throttle),
    )


@elementwise
def rate_on_actuators(
    state: State,
    servos: Servos,
    told: Controls,
    begun: float,
    time: float,
    truth: Truth,
    by: Actuators,
    turbulence: TurbulentAir | None,
) -> State:
    """Rates of the vehicle's states at `time` [s], with the controls where the servos are.

    What fails, fails between two steps: it goes by the time when this one has `begun`.
    """
    moving = through_air(state, time, turbulence, truth.wind)
    at = positions(moving, servos, told, begun, by)
    acting = Surfaces(
        effect(at.surfaces.right_elevon, begun, by.right_elevon),
        effect(at.surfaces.left_elevon, begun, by.left_elevon),
        effect(at.surfaces.rudder, begun, by.rudder),
    )
    power = effect(at.throttle, begun, by.throttle)
    return state_rate(state, acting, power, time, truth, turbulence)


@elementwise
def step_on_actuators(
    state: State,
    servos: Servos,
    command: Controls,
    time: float,
    truth: Truth,
    by: Actuators,
    turbulence: TurbulentAir | None = None,
) -> tuple[State, Servos, Controls]:
    """Vehicle, servos and controls 0.01 s after `time` [s] under a held command.

    Runge-Kutta of fourth order, as for the vehicle alone; turbulence is held as well.
    """
    half, middle, end = 0.5 * STEP, time + 0.5 * STEP, time + STEP
    told = told_servos(servos, command, time, by)
    k1 = rate_on_actuators(state, servos, told, time, time, truth, by, turbulence)
    r1 = servo_rates(servos, told, time, by)
    at = along_servos(servos, r1, half)
    k2 = rate_on_actuators(along(state, k1, half), at, told, time, middle, truth, by, turbulence)
    r2 = servo_rates(at, told, time, by)
    at = along_servos(servos, r2, half)
    k3 = rate_on_actuators(along(state, k2, half), at, told, time, middle, truth, by, turbulence)
    r3 = servo_rates(at, told, time, by)
    at = along_servos(servos, r3, STEP)
    k4 = rate_on_actuators(along(state, k3, STEP), at, told, time, end, truth, by, turbulence)
    r4 = servo_rates(at, told, time, by)
    ends = along(along(state, k1, STEP / 6.0), k4, STEP / 6.0)
    later = along(along(ends, k2, STEP / 3.0), k3, STEP / 3.0)
    outer = along_servos(along_servos(servos, r1, STEP / 6.0), r4, STEP / 6.0)
    now = along_servos(along_servos(outer, r2, STEP / 3.0), r3, STEP / 3.0)
    servos = Servos(
        settled(now.right_elevon, told.surfaces.right_elevon, by.right_elevon),
        settled(now.left_elevon, told.surfaces.left_elevon, by.left_elevon),
        settled(now.rudder, told.surfaces.rudder, by.rudder),
        settled(now.throttle, told.throttle, by.throttle),
    )
    moving = through_air(later, end, turbulence, truth.wind)
    return later, servos, positions(moving, servos, told, time, by)
