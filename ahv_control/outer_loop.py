# Copyright 2026 ahv developers, Apache-2.0
"""Outer loop: from altitude error to the attitude command (section 3.1)."""

from math import sqrt
from typing import NamedTuple

from ahv_control.reference import Reference
from ahv_plant.model.vectors import Attitude, State, clamp
from ahv_plant.numerics.elementary import asin, atan2, sin_cos
from ahv_plant.numerics.elementwise import elementwise


class OuterLoop(NamedTuple):
    """Settings of the outer loop."""

    altitude: float  # [m] h* without guidance
    k_h: float  # [1/s]
    alpha_limit: float  # [rad] bound for the angle of attack; pi is no bound
    climb_limit: float  # [rad] bound for the climb angle asked for; pi/2 is no bound


@elementwise
def attitude_command(state: State, reference: Reference, settings: OuterLoop) -> Attitude:
    """Attitude that closes the altitude error at rate k_h, eq 3.1; roll and yaw of the reference.

    Solves h_dot = k_h (h* - h) for theta; beyond the report the rate of h* is added to that. The
    report prints a minus before the arcsine, with which the altitude runs away; its own line above
    gives the plus (docs/errata.md).

    Beyond the report, no climb angle is asked for beyond its limit, and the command keeps the
    angle of attack within its own: pitch less the present climb angle is the angle of attack that
    the vehicle will settle at. Where altitude and limit cannot both be had, the vehicle sinks into
    denser air.
    """
    sin_phi, cos_phi = sin_cos(state.phi)
    B = state.v * sin_phi + state.w * cos_phi
    climb = settings.k_h * (reference.altitude - state.h) + reference.altitude_rate
    alpha = atan2(B, state.u)  # in the vertical plane
    climb_asked = asin(climb / sqrt(state.u * state.u + B * B))
    theta = alpha + clamp(climb_asked, -settings.climb_limit, settings.climb_limit)
    climb_angle = state.theta - alpha
    limit = settings.alpha_limit
    held = clamp(theta, climb_angle - limit, climb_angle + limit)
    return Attitude(reference.phi, held, reference.psi)
