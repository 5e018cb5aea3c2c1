# Copyright 2026 ahv developers, Apache-2.0
"""The flight software's own model of the servos: where surfaces are that nobody measures.

The observer of eq 4.3 takes what moves late for a disturbance. A model that is told the same
commands says how late: hedging, after Johnson and Calise, "Pseudo-control hedging", AIAA 2000.
Its numbers are settings of the law. How good they are, the plant alone knows.
"""

from typing import NamedTuple

from ahv_plant.model.constants import STEP
from ahv_plant.model.servo import servo_motion
from ahv_plant.model.vectors import Surfaces, clamp
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.optional import changed_by


class ServoModel(NamedTuple):
    """What the flight software takes the servos of all three surfaces for."""

    order: int  # 0 moves at once; 1 or 2 is the order of the servo
    frequency: float  # [rad/s] natural frequency; of first order the bandwidth
    damping: float  # [-] of second order
    rate_limit: float  # [rad/s] infinity is off
    lower: float  # [rad] stop
    upper: float  # [rad] stop


class ModelledServo(NamedTuple):
    """State of one servo of the model, or its rates, by second."""

    position: float  # [rad]
    rate: float  # [rad/s] of second order


class ModelledServos(NamedTuple):
    """One of each surface."""

    right_elevon: ModelledServo
    left_elevon: ModelledServo
    rudder: ModelledServo


_AT_ZERO = ModelledServo(0.0, 0.0)
AT_ZERO = ModelledServos(_AT_ZERO, _AT_ZERO, _AT_ZERO)


@elementwise
def _resting(position: float, model: ServoModel) -> ModelledServo:
    return ModelledServo(clamp(position, model.lower, model.upper), 0.0 * position)


@elementwise
def resting_model(surfaces: Surfaces, model: ServoModel) -> ModelledServos:
    """Servos at rest with the surfaces where they are [rad]."""
    return ModelledServos(
        _resting(surfaces.right_elevon, model),
        _resting(surfaces.left_elevon, model),
        _resting(surfaces.rudder, model),
    )


@elementwise
def _rates(servo: ModelledServo, told: float, model: ServoModel) -> ModelledServo:
    motion = servo_motion(servo.rate, told - servo.position, model)
    return ModelledServo(motion.velocity, motion.acceleration)


@elementwise
def _along(servo: ModelledServo, rate: ModelledServo, time: float) -> ModelledServo:
    return ModelledServo(servo.position + time * rate.position, servo.rate + time * rate.rate)


@elementwise
def next_servo(servo: ModelledServo, command: float, model: ServoModel) -> ModelledServo:
    """Servo 0.01 s later under a held command [rad], by the plant's Runge-Kutta step."""
    told = clamp(command, model.lower, model.upper)
    r1 = _rates(servo, told, model)
    r2 = _rates(_along(servo, r1, 0.5 * STEP), told, model)
    r3 = _rates(_along(servo, r2, 0.5 * STEP), told, model)
    r4 = _rates(_along(servo, r3, STEP), told, model)
    outer = _along(_along(servo, r1, STEP / 6.0), r4, STEP / 6.0)
    now = _along(_along(outer, r2, STEP / 3.0), r3, STEP / 3.0)
    reached = clamp(now.position, model.lower, model.upper)
    reached = select(model.order == 0, told, reached)
    return ModelledServo(reached, select(reached == now.position, now.rate, 0.0 * reached))


@changed_by
def next_model(servos: ModelledServos, command: Surfaces, model: ServoModel) -> ModelledServos:
    """Servos 0.01 s later under held commands [rad]; without a model as they are."""
    return ModelledServos(
        next_servo(servos.right_elevon, command.right_elevon, model),
        next_servo(servos.left_elevon, command.left_elevon, model),
        next_servo(servos.rudder, command.rudder, model),
    )


@changed_by
def modelled_surfaces(commanded: Surfaces, servos: ModelledServos, model: ServoModel) -> Surfaces:
    """Where the model has the surfaces [rad]; without a model as commanded."""
    return Surfaces(
        servos.right_elevon.position, servos.left_elevon.position, servos.rudder.position
    )
