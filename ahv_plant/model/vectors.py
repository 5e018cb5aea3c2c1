# Copyright 2026 ahv developers, Apache-2.0
"""The vectors of the vehicle, by name: state, attitude, rates, control surfaces."""

from typing import NamedTuple

from ahv_plant.model.constants import (
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
)
from ahv_plant.numerics.elementwise import elementwise, select


class State(NamedTuple):
    """The 13 states of eqs 2.1-2.6; also used for their rates, in the same units per second.

    Body axes are forward-right-down, the inertial frame is north-east-down on a flat Earth, h is
    up.
    """

    u: float  # [m/s] body velocity forward
    v: float  # [m/s] body velocity right
    w: float  # [m/s] body velocity down
    P: float  # [rad/s] roll rate
    Q: float  # [rad/s] pitch rate
    R: float  # [rad/s] yaw rate
    phi: float  # [rad] roll angle
    theta: float  # [rad] pitch angle
    psi: float  # [rad] yaw angle
    x: float  # [m] distance north
    y: float  # [m] distance east
    h: float  # [m] altitude
    mass: float  # [kg]


class Attitude(NamedTuple):
    """Euler angles, or commands for them."""

    phi: float  # [rad] roll
    theta: float  # [rad] pitch
    psi: float  # [rad] yaw


class Rates(NamedTuple):
    """Body rates or commands for them [rad/s], or their own rates [rad/s^2]."""

    P: float  # roll
    Q: float  # pitch
    R: float  # yaw


class Surfaces(NamedTuple):
    """Deflections of the three control surfaces; positive: trailing edge down, rudder left."""

    right_elevon: float  # [rad] delta_e
    left_elevon: float  # [rad] delta_a
    rudder: float  # [rad] delta_r


class Measurement(NamedTuple):
    """What the flight software is told: state and surface positions as measured."""

    state: State
    surfaces: Surfaces


class Controls(NamedTuple):
    """What moves the vehicle, or the commands for it."""

    surfaces: Surfaces
    throttle: float  # [-] sigma_T


@elementwise
def clamp(value: float, lower: float, upper: float) -> float:
    """Limit `value` to what lies between `lower` and `upper`, in any unit."""
    value = select(value < lower, lower, value)
    return select(value > upper, upper, value)


@elementwise
def limit_surfaces(surfaces: Surfaces) -> Surfaces:
    """Hold each deflection [rad] within its stops, [-40, 30] deg (section 3.5.2)."""
    return Surfaces(
        clamp(surfaces.right_elevon, SURFACE_MINIMUM, SURFACE_MAXIMUM),
        clamp(surfaces.left_elevon, SURFACE_MINIMUM, SURFACE_MAXIMUM),
        clamp(surfaces.rudder, SURFACE_MINIMUM, SURFACE_MAXIMUM),
    )


@elementwise
def limit_throttle(throttle: float) -> float:
    """Hold sigma_T [-] between 0.1 and 0.9, section 3.5.2; not a number becomes the least."""
    held = clamp(throttle, THROTTLE_MINIMUM, THROTTLE_MAXIMUM)
    return select(held == held, held, THROTTLE_MINIMUM)
