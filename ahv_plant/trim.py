# Copyright 2026 ahv developers, Apache-2.0
"""Trimmed cruise flight: the seven equations of section 3.5.1."""

from math import atan2
from typing import NamedTuple

import numpy as np
from scipy.optimize import root

from ahv_plant.dispersion import NOMINAL, Truth
from ahv_plant.model.aerodynamics import MACH_MINIMUM
from ahv_plant.model.atmosphere import (
    ALTITUDE_MAXIMUM,
    ALTITUDE_MINIMUM,
    atmosphere,
    geopotential_altitude,
)
from ahv_plant.model.constants import INITIAL_MASS
from ahv_plant.model.mass import MASS_MAXIMUM, MASS_MINIMUM
from ahv_plant.model.vectors import State, Surfaces, limit_surfaces, limit_throttle
from ahv_plant.vehicle import state_rate

CRUISE_ALTITUDE = 24_000.0  # [m] h*, section 3.5.1
CRUISE_SPEED = 1786.4  # [m/s] u*, section 3.5.1
MACH_MAXIMUM = 24.0  # [-] end of the wind-tunnel and code data behind the fits
RESIDUAL_TOLERANCE = 1e-9  # [m/s^2, rad/s^2, m/s]


class Trim(NamedTuple):
    """A trimmed flight condition, and how well it is one."""

    state: State
    surfaces: Surfaces
    throttle: float  # [-] sigma_T
    alpha: float  # [rad]
    residual: float  # largest of the seven rates [m/s^2, rad/s^2, m/s]
    converged: bool  # residual below 1e-9
    within_limits: bool  # surfaces and throttle inside their stops


def check_flight_condition(altitude: float, speed: float, mass: float, geometric: bool) -> None:
    """Raise ValueError, naming field, value and range, where the vehicle model does not hold.

    `altitude` [m], `speed` [m/s], `mass` [kg]; `geometric` says which altitude it is.
    """
    height = geopotential_altitude(altitude, geometric)
    if not ALTITUDE_MINIMUM <= height <= ALTITUDE_MAXIMUM:
        raise ValueError(
            f"altitude {altitude:g} m is outside the atmosphere model, "
            f"which is valid from {ALTITUDE_MINIMUM:g} to {ALTITUDE_MAXIMUM:g} m"
        )
    sound = atmosphere(altitude, geometric).sound_speed
    if not MACH_MINIMUM * sound <= speed <= MACH_MAXIMUM * sound:
        raise ValueError(
            f"speed {speed:g} m/s is outside the aerodynamic fits, which are valid from Mach "
            f"{MACH_MINIMUM:g} to {MACH_MAXIMUM:g}: {MACH_MINIMUM * sound:.0f} to "
            f"{MACH_MAXIMUM * sound:.0f} m/s at {altitude:g} m"
        )
    if not MASS_MINIMUM <= mass <= MASS_MAXIMUM:
        raise ValueError(
            f"mass {mass:g} kg is outside the mass properties, "
            f"which are valid from {MASS_MINIMUM:g} to {MASS_MAXIMUM:g} kg"
        )


def trim(
    altitude: float = CRUISE_ALTITUDE,
    speed: float = CRUISE_SPEED,
    mass: float = INITIAL_MASS,
    truth: Truth = NOMINAL,
) -> Trim:
    """Level flight at `altitude` [m], u = `speed` [m/s] and `mass` [kg], section 3.5.1.

    Solves the rates of u, v, w, P, Q, R and h for v, w, theta, the three surfaces and sigma_T, all
    other states being zero, of the true vehicle `truth`. Raises ValueError outside the range of
    the model.
    """
    check_flight_condition(altitude, speed, mass, truth.geometric)

    def flight(unknowns: np.ndarray) -> tuple[State, Surfaces, float]:
        v, w, theta, right, left, rudder, throttle = (float(value) for value in unknowns)
        state = State(speed, v, w, 0.0, 0.0, 0.0, 0.0, theta, 0.0, 0.0, 0.0, altitude, mass)
        return state, Surfaces(right, left, rudder), throttle

    def residuals(unknowns: np.ndarray) -> list[float]:
        rate = state_rate(*flight(unknowns), 0.0, truth)
        return [rate.u, rate.v, rate.w, rate.P, rate.Q, rate.R, rate.h]

    guess = [0.0, 0.05 * speed, 0.05, -0.1, -0.1, 0.0, 0.2]
    solution = root(residuals, guess, tol=1e-14)
    state, surfaces, throttle = flight(solution.x)
    residual = float(np.max(np.abs(solution.fun)))
    return Trim(
        state,
        surfaces,
        throttle,
        atan2(state.w, state.u),
        residual,
        residual < RESIDUAL_TOLERANCE,
        limit_surfaces(surfaces) == surfaces and limit_throttle(throttle) == throttle,
    )
