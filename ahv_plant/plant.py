# Copyright 2026 ahv developers, Apache-2.0
"""The plant: from commands to the next measurement, through hardware if there is any.

Commands travel, actuators move the surfaces, the vehicle flies, sensors look. Ideal hardware is
none: the controls act as they are commanded, and the state is known as it is.
"""

from typing import Any, NamedTuple

from ahv_plant.dispersion import Truth
from ahv_plant.hardware.actuators import (
    Actuator,
    Servo,
    along_servo,
    moved,
    resting,
    servo_rate,
    settled,
)
from ahv_plant.hardware.delay import through
from ahv_plant.hardware.surface_faults import (
    SurfaceFault,
    effective,
    held_back,
    ordered,
    position,
)
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import Controls, Measurement, State, Surfaces, limit_throttle
from ahv_plant.numerics.elementary import atan2
from ahv_plant.numerics.elementwise import elementwise
from ahv_plant.numerics.optional import optional
from ahv_plant.vehicle import along, state_rate, vehicle_step


class Actuators(NamedTuple):
    """One of each control."""

    right_elevon: Actuator
    left_elevon: Actuator
    rudder: Actuator
    throttle: Actuator  # the engine


class SurfaceFaults(NamedTuple):
    """One of each surface."""

    right_elevon: SurfaceFault
    left_elevon: SurfaceFault
    rudder: SurfaceFault


class Servos(NamedTuple):
    """States of the actuators, or their rates."""

    right_elevon: Servo
    left_elevon: Servo
    rudder: Servo
    throttle: Servo


class Hardware(NamedTuple):
    """What is not ideal."""

    actuators: Actuators
    delay: int  # [steps] from a measured state to the arrival of its commands
    start: Controls  # where the actuators rest before the first command
    faults: SurfaceFaults | None = None
    sensors: Any = None


class Plant(NamedTuple):
    """The plant at one step."""

    state: State  # true
    servos: Servos | None
    measured: Measurement
    controls: Controls  # that act, at the end of the step


@elementwise
def servo_rates(servos: Servos, told: Servos, actuators: Actuators) -> Servos:
    """Rates of all servos; `told` has the commands as positions."""
    return Servos(
        servo_rate(servos.right_elevon, told.right_elevon, actuators.right_elevon),
        servo_rate(servos.left_elevon, told.left_elevon, actuators.left_elevon),
        servo_rate(servos.rudder, told.rudder, actuators.rudder),
        servo_rate(servos.throttle, told.throttle, actuators.throttle),
    )
