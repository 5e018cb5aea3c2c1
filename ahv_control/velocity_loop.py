# Copyright 2026 ahv developers, Apache-2.0
"""Velocity loop: from speed error to the throttle (section 3.4)."""

from typing import NamedTuple

from ahv_control.reference import Reference
from ahv_plant.model.aerodynamics import aerodynamic_coefficients, air_data, loads
from ahv_plant.model.constants import GRAVITY, MAXIMUM_THRUST
from ahv_plant.model.mass import centre_of_gravity
from ahv_plant.model.vectors import State, Surfaces, limit_throttle
from ahv_plant.numerics.elementary import sin_cos
from ahv_plant.numerics.elementwise import elementwise


class VelocityLoop(NamedTuple):
    """Settings of the velocity loop."""

    speed: float  # [m/s] u* without guidance
    k_u: float  # [1/s]
    geometric: bool  # h is a geometric altitude


@elementwise
def throttle_command(
    state: State, surfaces: Surfaces, reference: Reference, settings: VelocityLoop
) -> float:
    """Throttle sigma_T [-] that closes the error of the forward speed u at k_u, eq 3.2.

    Beyond the report, the rate of u* is added to what the error asks for.
    """
    air = air_data(state, settings.geometric)
    aero = loads(
        air, aerodynamic_coefficients(air, state, surfaces), centre_of_gravity(state.mass)
    )
    sin_theta, _ = sin_cos(state.theta)
    without_thrust = (
        state.R * state.v - state.Q * state.w - GRAVITY * sin_theta + aero.Fx / state.mass
    )
    acceleration = settings.k_u * (reference.speed - state.u) + reference.speed_rate
    wanted = acceleration - without_thrust
    return limit_throttle(state.mass / MAXIMUM_THRUST * wanted)
