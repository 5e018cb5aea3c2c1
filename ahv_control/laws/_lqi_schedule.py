# Copyright 2026 ahv developers, Apache-2.0
"""The gain schedule of the linear-quadratic law: four corners of mass and Mach number.

W. J. Rugh and J. S. Shamma, "Research on Gain Scheduling", Automatica 36(10), 2000, have why the
commands of the corners may be interpolated in place of their gains: both are the same sum.
"""

from typing import NamedTuple

from ahv_plant.model.vectors import clamp
from ahv_plant.numerics.elementwise import elementwise


class Longitudinal(NamedTuple):
    """States of the motion in the vertical plane, or what a command changes by one of each."""

    speed: float  # [m/s] u - u*
    climb: float  # [rad] climb angle, less that of the reference
    alpha: float  # [rad] angle of attack, less that of the trim
    Q: float  # [rad/s]
    altitude: float  # [m] h - h*
    altitude_sum: float  # [m s] its integral
    speed_sum: float  # [m] integral of u - u*


class Lateral(NamedTuple):
    """States of the motion out of that plane, or what a command changes by one of each."""

    beta: float  # [rad] sideslip angle
    P: float  # [rad/s]
    R: float  # [rad/s]
    phi: float  # [rad] bank, less that of the reference
    psi: float  # [rad] heading, less that of the reference
    psi_sum: float  # [rad s] its integral


class Corner(NamedTuple):
    """Trim and gains at one corner."""

    alpha: float  # [rad] of the trim
    elevons: float  # [rad] of the trim, both
    throttle: float  # [-] of the trim
    elevons_by: Longitudinal  # [rad] a unit of each state
    throttle_by: Longitudinal  # [-] a unit of each state
    difference_by: Lateral  # [rad] of the right elevon, and of the left one with a minus
    rudder_by: Lateral  # [rad]


class Corners(NamedTuple):
    """The schedule."""

    light: float  # [kg]
    heavy: float  # [kg]
    slow: float  # [-] Mach number
    fast: float  # [-] Mach number
    light_slow: Corner
    light_fast: Corner
    heavy_slow: Corner
    heavy_fast: Corner


class Answer(NamedTuple):
    """Commands before the stops."""

    elevons: float  # [rad] mean of both
    difference: float  # [rad] right elevon less that mean
    rudder: float  # [rad]
    throttle: float  # [-]
    alpha: float  # [rad] of the trim


@elementwise
def _longitudinal(x: Longitudinal, by: Longitudinal) -> float:
    total = x.speed * by.speed + x.climb * by.climb + x.alpha * by.alpha + x.Q * by.Q
    total = total + x.altitude * by.altitude + x.altitude_sum * by.altitude_sum
    return total + x.speed_sum * by.speed_sum


@elementwise
def _lateral(y: Lateral, by: Lateral) -> float:
    total = y.beta * by.beta + y.P * by.P + y.R * by.R
    return total + y.phi * by.phi + y.psi * by.psi + y.psi_sum * by.psi_sum


@elementwise
def at_corner(x: Longitudinal, y: Lateral, corner: Corner) -> Answer:
    """Commands of one corner; `x.alpha` [rad] is still the angle of attack itself."""
    z = Longitudinal(
        x.speed, x.climb, x.alpha - corner.alpha, x.Q, x.altitude, x.altitude_sum, x.speed_sum
    )
    return Answer(
        corner.elevons - _longitudinal(z, corner.elevons_by),
        -_lateral(y, corner.difference_by),
        -_lateral(y, corner.rudder_by),
        corner.throttle - _longitudinal(z, corner.throttle_by),
        corner.alpha,
    )


@elementwise
def _between(one: Answer, other: Answer, share: float) -> Answer:
    rest = 1.0 - share
    return Answer(
        rest * one.elevons + share * other.elevons,
        rest * one.difference + share * other.difference,
        rest * one.rudder + share * other.rudder,
        rest * one.throttle + share * other.throttle,
        rest * one.alpha + share * other.alpha,
    )


@elementwise
def blended(x: Longitudinal, y: Lateral, mass: float, mach: float, of: Corners) -> Answer:
    """Commands at a `mass` [kg] and a Mach number [-]; beyond the corners as at the edge."""
    heavy = clamp((mass - of.light) / (of.heavy - of.light), 0.0, 1.0)
    fast = clamp((mach - of.slow) / (of.fast - of.slow), 0.0, 1.0)
    light = _between(at_corner(x, y, of.light_slow), at_corner(x, y, of.light_fast), fast)
    full = _between(at_corner(x, y, of.heavy_slow), at_corner(x, y, of.heavy_fast), fast)
    return _between(light, full, heavy)
