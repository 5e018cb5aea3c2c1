# Copyright 2026 ahv developers, Apache-2.0
"""How a servo moves: what the actuators of the plant and a law's model of them have in common."""

from typing import Any, NamedTuple

from ahv_plant.model.vectors import clamp
from ahv_plant.numerics.elementwise import elementwise, select


class ServoMotion(NamedTuple):
    """How position and rate of a servo change."""

    velocity: float  # units of position a second
    acceleration: float  # of second order, units of position a second squared


@elementwise
def servo_motion(rate: float, error: float, servo: Any) -> ServoMotion:
    """Motion of a servo that has a `rate` and sees an `error`, in any unit of position.

    `servo` has its order, frequency [rad/s], damping [-] and rate limit (infinity is off).
    First order: x' = w e; second order: x'' = w (w e - 2 zeta x'), with x' within the rate limit,
    beyond which it does not wind up. Servos so simple fly in Stevens, Lewis and Johnson, Aircraft
    Control and Simulation (2015).
    """
    wanted = servo.frequency * error
    limit = servo.rate_limit
    held = clamp(rate, -limit, limit)
    push = servo.frequency * (wanted - 2.0 * servo.damping * held)
    none = 0.0 * push
    outward = ((held >= limit) & (push > 0.0)) | ((held <= -limit) & (push < 0.0))
    return ServoMotion(
        select(servo.order == 2, held, clamp(wanted, -limit, limit)),
        select(servo.order == 2, select(outward, none, push), none),
    )
