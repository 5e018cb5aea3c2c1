# Copyright 2026 ahv developers, Apache-2.0
"""Does a vehicle have a trim at all? Section 3.5.1 by two equations, in lanes too."""

from typing import NamedTuple

from ahv_plant.dispersion import Truth, disperse_throttle
from ahv_plant.model.constants import (
    MAXIMUM_THRUST,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
)
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.numerics.elementary import sin_cos
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.vehicle import state_rate

DIFFERENCE = 1e-6  # [rad] of the finite-difference Jacobian
START = (0.05, -0.12)  # [rad] angle of attack and elevons that the search begins with
NEWTON_STEPS = 10
TOLERANCE = 1e-6  # [m/s^2, rad/s^2] of a trim


class LevelTrim(NamedTuple):
    """Symmetric level flight."""

    alpha: float  # [rad] angle of attack and pitch
    elevon: float  # [rad] both elevons
    throttle: float  # [-]
    exists: float  # [-] 1 if found with elevons and throttle inside their stops, else 0


@elementwise
def balance(
    alpha: float, elevon: float, altitude: float, speed: float, mass: float, truth: Truth
) -> tuple[float, float, float]:
    """Rates of w, Q [m/s^2, rad/s^2] and the throttle [-] that u needs, level at `alpha` [rad]."""
    sine, cosine = sin_cos(alpha)
    state = State(
        speed, 0.0, speed * sine / cosine, 0.0, 0.0, 0.0, 0.0, alpha, 0.0, 0.0, 0.0, altitude, mass
    )
    rate = state_rate(state, Surfaces(elevon, elevon, 0.0), 0.0, 0.0, truth)
    throttle = disperse_throttle(-rate.u * mass / MAXIMUM_THRUST, truth.further)
    return rate.w, rate.Q, throttle


@elementwise
def trim_step(
    alpha: float, elevon: float, altitude: float, speed: float, mass: float, truth: Truth
) -> tuple[float, float]:
    """Take one Newton-Raphson step [rad] of the two equations w_dot = 0 and Q_dot = 0."""
    w, Q, _ = balance(alpha, elevon, altitude, speed, mass, truth)
    w_alpha, Q_alpha, _ = balance(alpha + DIFFERENCE, elevon, altitude, speed, mass, truth)
    w_elevon, Q_elevon, _ = balance(alpha, elevon + DIFFERENCE, altitude, speed, mass, truth)
    a, b = w_alpha - w, w_elevon - w
    c, d = Q_alpha - Q, Q_elevon - Q
    scale = DIFFERENCE / (a * d - b * c)
    return alpha - (d * w - b * Q) * scale, elevon - (a * Q - c * w) * scale


@elementwise
def level_trim(altitude: float, speed: float, mass: float, truth: Truth) -> LevelTrim:
    """Level flight at `altitude` [m] and u = `speed` [m/s] with equal elevons, section 3.5.1.

    The seven equations in two unknowns: v, P, R and the rudder are zero by symmetry, pitch is the
    angle of attack in level flight, and the throttle follows.
    """
    alpha, elevon = trim_step(START[0], START[1], altitude, speed, mass, truth)
    for _ in range(NEWTON_STEPS - 1):
        alpha, elevon = trim_step(alpha, elevon, altitude, speed, mass, truth)
    w, Q, throttle = balance(alpha, elevon, altitude, speed, mass, truth)
    found = (abs(w) < TOLERANCE) & (abs(Q) < TOLERANCE)
    held = (elevon >= SURFACE_MINIMUM) & (elevon <= SURFACE_MAXIMUM)
    driven = (throttle >= THROTTLE_MINIMUM) & (throttle <= THROTTLE_MAXIMUM)
    return LevelTrim(alpha, elevon, throttle, select(found & held & driven, 1.0, 0.0))
