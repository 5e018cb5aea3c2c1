# Copyright 2026 ahv developers, Apache-2.0
"""Trimmed cruise flight: the seven equations of section 3.5.1."""

from math import pi, tan
from typing import NamedTuple

from ahv_plant.dispersion import NOMINAL, Truth
from ahv_plant.level_trim import NEWTON_STEPS, START, balance, trim_step
from ahv_plant.model.constants import INITIAL_MASS
from ahv_plant.model.flight_condition import (
    CRUISE_ALTITUDE,
    CRUISE_SPEED,
    check_flight_condition,
)
from ahv_plant.model.vectors import State, Surfaces, limit_surfaces, limit_throttle
from ahv_plant.vehicle import state_rate

RESIDUAL_TOLERANCE = 1e-9  # [m/s^2, rad/s^2, m/s]
TRIMMED = ("u", "v", "w", "P", "Q", "R", "h")  # whose rates vanish
CONTINUATION = (1, 8, 64)  # steps from the cruise condition, more where fewer do not arrive


class Trim(NamedTuple):
    """A trimmed flight condition, and how well it is one."""

    state: State
    surfaces: Surfaces
    throttle: float  # [-] sigma_T
    alpha: float  # [rad]
    residual: float  # largest of the seven rates [m/s^2, rad/s^2, m/s]
    converged: bool  # residual below 1e-9
    within_limits: bool  # surfaces and throttle inside their stops


def trim(
    altitude: float = CRUISE_ALTITUDE,
    speed: float = CRUISE_SPEED,
    mass: float = INITIAL_MASS,
    truth: Truth = NOMINAL,
) -> Trim:
    """Level flight at `altitude` [m], u = `speed` [m/s] and `mass` [kg], section 3.5.1.

    By symmetry v, P, R and the rudder are zero, and in level flight the pitch is the angle of
    attack: what is left of the seven equations is solved as in `level_trim`. Where its start is
    too far off, by continuation: from the cruise condition there in ever smaller steps, each from
    where the one before ended. The rates of u, v, w, P, Q, R and h at the end, of the true vehicle
    `truth`, are the residual. Raises ValueError outside the range of the model.
    """
    check_flight_condition(altitude, speed, mass, truth.geometric)
    for steps in CONTINUATION:
        alpha, elevon = START
        for step in range(1, steps + 1):
            share = step / steps
            h = CRUISE_ALTITUDE + share * (altitude - CRUISE_ALTITUDE)
            u = CRUISE_SPEED + share * (speed - CRUISE_SPEED)
            for _ in range(NEWTON_STEPS):
                alpha, elevon = trim_step(alpha, elevon, h, u, mass, truth)
        _, _, throttle = balance(alpha, elevon, altitude, speed, mass, truth)
        w = speed * tan(alpha)
        state = State(speed, 0.0, w, 0.0, 0.0, 0.0, 0.0, alpha, 0.0, 0.0, 0.0, altitude, mass)
        surfaces = Surfaces(elevon, elevon, 0.0)
        rate = state_rate(state, surfaces, throttle, 0.0, truth)
        residual = max(abs(rate[State._fields.index(name)]) for name in TRIMMED)
        converged = residual < RESIDUAL_TOLERANCE and abs(alpha) < pi / 2
        if converged:
            break
    within = limit_surfaces(surfaces) == surfaces and limit_throttle(throttle) == throttle
    return Trim(state, surfaces, throttle, alpha, residual, converged, within)
