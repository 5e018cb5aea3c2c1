# Copyright 2026 ahv developers, Apache-2.0
"""Outer loop: from altitude error to the attitude command (section 3.1)."""

from math import sqrt
from typing import NamedTuple

from ahv_control.reference import Reference
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import Attitude, State, clamp
from ahv_plant.numerics.elementary import asin, atan2, sin_cos
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.optional import changed_by, optional


class AltitudeIntegral(NamedTuple):
    """Settings of the integral action in altitude, beyond the report."""

    gain: float  # [1/s]
    limit: float  # [m/s] bound for the rate of climb that it adds


class Integral(NamedTuple):
    """What the integral action remembers."""

    climb: float  # [m/s] rate of climb that it adds
    altitude: float  # [m] as measured a step ago


class OuterLoop(NamedTuple):
    """Settings of the outer loop."""

    altitude: float  # [m] h* without guidance
    k_h: float  # [1/s]
    alpha_limit: float  # [rad] bound for the angle of attack; pi is no bound
    climb_limit: float  # [rad] bound for the climb angle asked for; pi/2 is no bound
    integral: AltitudeIntegral | None = None  # the report has none


@changed_by
def _with_integral(climb: float, integral: Integral) -> float:
    return climb + integral.climb


@elementwise
def closing(state: State, reference: Reference, settings: OuterLoop) -> float:
    """Rate of climb [m/s] at which the altitude error closes, eq 3.1, and that of h* with it."""
    return settings.k_h * (reference.altitude - state.h) + reference.altitude_rate


@elementwise
def pitch_asked(
    state: State, reference: Reference, integral: Integral | None, settings: OuterLoop
) -> tuple[float, float]:
    """Pitch [rad] that closes the altitude error within its limits, and what these took off it.

    The second is zero where no limit is met, and positive where more pitch was wanted.
    """
    sin_phi, cos_phi = sin_cos(state.phi)
    B = state.v * sin_phi + state.w * cos_phi
    climb = _with_integral(closing(state, reference, settings), integral)
    alpha = atan2(B, state.u)  # in the vertical plane
    climb_asked = asin(climb / sqrt(state.u * state.u + B * B))
    theta = alpha + clamp(climb_asked, -settings.climb_limit, settings.climb_limit)
    climb_angle = state.theta - alpha
    limit = settings.alpha_limit
    held = clamp(theta, climb_angle - limit, climb_angle + limit)
    return held, (alpha + climb_asked) - held


@elementwise
def attitude_command(
    state: State, reference: Reference, integral: Integral | None, settings: OuterLoop
) -> Attitude:
    """Attitude that closes the altitude error at rate k_h, eq 3.1; roll and yaw of the reference.

    Solves h_dot = k_h (h* - h) for theta; beyond the report the rate of h* and what the
    `integral` adds, if there is one, come to that. The report prints a minus before the arcsine,
    with which the altitude runs away; its own line above gives the plus (docs/errata.md).

    Beyond the report, no climb angle is asked for beyond its limit, and the command keeps the
    angle of attack within its own: pitch less the present climb angle is the angle of attack that
    the vehicle will settle at. Where altitude and limit cannot both be had, the vehicle sinks into
    denser air.
    """
    pitch, _ = pitch_asked(state, reference, integral, settings)
    return Attitude(reference.phi, pitch, reference.psi)


@optional
def first_integral(state: State, settings: AltitudeIntegral) -> Integral:
    """Integral at the first state that is known, which adds nothing; None without `settings`."""
    return Integral(select(state.h == state.h, 0.0, 0.0), state.h)  # as wide as h


@optional
def next_integral(
    kept: Integral,
    state: State,
    reference: Reference,
    outer: OuterLoop,
    settings: AltitudeIntegral,
) -> Integral:
    """Integral a step later; None without `settings`.

    What is integrated is what the altitude lacks of the closing that eq 3.1 wants: the change that
    k_h (h* - h) and the rate of h* ask for, less that of the measured altitude. So a constant
    disturbance leaves no error, and what the vehicle does as it should adds nothing: where pitch
    follows at once the poles are at -k_h and -gain, and the answer to a step of h*, whose zero
    cancels the latter, is that of the report (a controller of two degrees of freedom, Astrom and
    Hagglund, Advanced PID Control, 2006, section 5.3).

    Against wind-up it waits while a limit of the outer loop keeps what it would add from being
    flown. Its own limit bounds what stops that this loop does not know of, those of the elevons,
    can leave in it.
    """
    asked = closing(state, reference, outer) * STEP
    change = settings.gain * (asked - (state.h - kept.altitude))
    climb = clamp(kept.climb + change, -settings.limit, settings.limit)
    later = Integral(climb, state.h)
    _, taken_off = pitch_asked(state, reference, later, outer)
    return Integral(select(taken_off * change > 0.0, kept.climb, climb), state.h)
