# Copyright 2026 ahv developers, Apache-2.0
"""Steady turns of the nominal vehicle: what angle of attack, elevons and throttle a bank takes.

The level flight of section 3.5.1 with a bank, in which lift turns the vehicle too. By what the
flight software knows of the vehicle, without what sets the true one apart.
"""

from math import nan, pi, sqrt
from typing import NamedTuple

from ahv_plant.model.aerodynamics import aerodynamic_coefficients, air_data, loads
from ahv_plant.model.constants import GRAVITY, MAXIMUM_THRUST
from ahv_plant.model.flight_condition import CRUISE_ALTITUDE, CRUISE_SPEED
from ahv_plant.model.mass import centre_of_gravity, inertia
from ahv_plant.model.rigid_body import motion
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.numerics.elementary import atan, sin_cos
from ahv_plant.numerics.elementwise import elementwise

FIRST = (0.05, -0.12)  # [rad] angle of attack and elevons that the search begins with
DIFFERENCE = 1e-6  # [rad] of the finite-difference Jacobian
NEWTON_STEPS = 10
TOLERANCE = 1e-6  # [m/s^2, rad/s^2] of a steady turn
CONTINUATION = (1, 8, 64)  # steps from cruise, more where fewer do not arrive


class SteadyTurn(NamedTuple):
    """A level turn without sideslip, with equal elevons."""

    alpha: float  # [rad] angle of attack; nan where none was found
    elevon: float  # [rad] both elevons
    throttle: float  # [-]


NONE_FOUND = SteadyTurn(nan, nan, nan)


@elementwise
def turn_balance(
    alpha: float,
    elevon: float,
    altitude: float,
    speed: float,
    mass: float,
    bank: float,
    geometric: bool,
) -> tuple[float, float, float]:
    """Rates of w, Q and u [m/s^2, rad/s^2, m/s^2] in a level turn of the nominal vehicle.

    Without thrust, at u = `speed` [m/s]. The attitude is that of h_dot = 0, the body rates are
    those of a heading that turns as fast as v_dot = 0 has it, eqs 2.1 and 2.4. What holds the
    small rolling and yawing moments of the rates is left out.
    """
    sin_alpha, cos_alpha = sin_cos(alpha)
    sin_phi, cos_phi = sin_cos(bank)
    w = speed * sin_alpha / cos_alpha
    slope = sin_alpha / cos_alpha * cos_phi  # tan theta
    cos_theta = 1.0 / sqrt(1.0 + slope * slope)
    sin_theta = slope * cos_theta
    turn = GRAVITY * cos_theta * sin_phi / (w * sin_theta + speed * cos_phi * cos_theta)
    P, Q, R = -turn * sin_theta, turn * sin_phi * cos_theta, turn * cos_phi * cos_theta
    state = State(speed, 0.0, w, P, Q, R, bank, atan(slope), 0.0, 0.0, 0.0, altitude, mass)
    air = air_data(state, geometric)
    coefficients = aerodynamic_coefficients(air, state, Surfaces(elevon, elevon, 0.0))
    total = loads(air, coefficients, centre_of_gravity(mass))
    rate = motion(state, total, 0.0, inertia(mass))
    return rate.w, rate.Q, rate.u


def steady_turn(
    altitude: float,
    speed: float,
    mass: float,
    bank: float,
    geometric: bool,
    continuation: tuple[int, ...] = CONTINUATION,
) -> SteadyTurn:
    """Level turn at `altitude` [m], u = `speed` [m/s], `mass` [kg] and `bank` [rad], or none.

    Solved by Newton-Raphson, where its start is too far off by continuation from straight flight
    at the report's cruise condition; a bank of zero is the level flight of section 3.5.1.
    """
    for steps in continuation:
        alpha, elevon = FIRST
        for step in range(1, steps + 1):
            share = step / steps
            there = (
                CRUISE_ALTITUDE + share * (altitude - CRUISE_ALTITUDE),
                CRUISE_SPEED + share * (speed - CRUISE_SPEED),
                mass,
                share * bank,
                geometric,
            )
            for _ in range(NEWTON_STEPS):
                w, Q, u = turn_balance(alpha, elevon, *there)
                if not abs(alpha) < 0.5 * pi:  # lost, or no number at all
                    break
                if max(abs(w), abs(Q)) < TOLERANCE and step < steps:
                    break
                w_alpha, Q_alpha, _ = turn_balance(alpha + DIFFERENCE, elevon, *there)
                w_elevon, Q_elevon, _ = turn_balance(alpha, elevon + DIFFERENCE, *there)
                a, b, c, d = w_alpha - w, w_elevon - w, Q_alpha - Q, Q_elevon - Q
                scale = DIFFERENCE / (a * d - b * c)
                alpha -= (d * w - b * Q) * scale
                elevon -= (a * Q - c * w) * scale
        w, Q, u = turn_balance(alpha, elevon, *there)
        if max(abs(w), abs(Q)) < TOLERANCE and abs(alpha) < 0.5 * pi:
            return SteadyTurn(alpha, elevon, -u * mass / MAXIMUM_THRUST)
    return NONE_FOUND
