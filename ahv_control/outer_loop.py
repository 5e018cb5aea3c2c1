# Copyright 2026 ahv developers, Apache-2.0
"""Outer loop: from altitude error to the attitude command (section 3.1)."""

from math import sqrt
from typing import NamedTuple

from ahv_plant.model.vectors import Attitude, State, clamp
from ahv_plant.numerics.elementary import asin, atan2, sin_cos
from ahv_plant.numerics.elementwise import elementwise


class OuterLoop(NamedTuple):
    """Settings of the outer loop."""

    altitude: float  # [m] h*
    k_h: float  # [1/s]
    alpha_limit: float  # [rad] bound for the angle of attack; pi is no bound


@elementwise
def attitude_command(state: State, settings: OuterLoop) -> Attitude:
    """Attitude that closes the altitude error at rate k_h, eq 3.1; roll and yaw are zero.

    Solves h_dot = k_h (h* - h) for theta. The report prints a minus before the arcsine, with which
    the altitude runs away; its own line above gives the plus (docs/errata.md).

    Beyond the report, the command keeps the angle of attack within its limit: pitch less the
    present climb angle is the angle of attack that the vehicle will settle at. Where altitude and
    limit cannot both be had, the vehicle sinks into denser air.
    """
    sin_phi, cos_phi = sin_cos(state.phi)
    B = state.v * sin_phi + state.w * cos_phi
    climb = settings.k_h * (settings.altitude - state.h)
    alpha = atan2(B, state.u)  # in the vertical plane
    theta = alpha + asin(climb / sqrt(state.u * state.u + B * B))
    climb_angle = state.theta - alpha
    limit = settings.alpha_limit
    return Attitude(0.0, clamp(theta, climb_angle - limit, climb_angle + limit), 0.0)
