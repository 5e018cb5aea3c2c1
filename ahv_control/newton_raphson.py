# Copyright 2026 ahv developers, Apache-2.0
"""Surfaces that give the body rates a demanded acceleration (section 3.3).

Newton-Raphson with an analytic Jacobian on f(X, U) of eq 2.3.
"""

from enum import IntEnum
from typing import NamedTuple

from ahv_plant.model.aerodynamics import (
    AirData,
    Coefficients,
    add_coefficients,
    air_data,
    clean_coefficients,
    control_coefficients,
    loads,
)
from ahv_plant.model.mass import Inertia, centre_of_gravity, inertia
from ahv_plant.model.rigid_body import angular_acceleration
from ahv_plant.model.vectors import Rates, State, Surfaces, limit_surfaces
from ahv_plant.numerics.elementwise import elementwise, select

# A determinant below this means that the surfaces have lost the vehicle.
SINGULAR_DETERMINANT = 1e-9  # [1/s^6]
# The surfaces are a solution when the last correction was smaller than this: convergence is
# quadratic, so that the error left is of the order of its square, 1e-10 rad.
CORRECTION_TOLERANCE = 1e-5  # [rad]


class SolverStatus(IntEnum):
    """How the search for the surfaces ended; the gravest that applies."""

    CONVERGED = 0
    SATURATED = 1  # solved, but the solution lies beyond a stop and is held there
    ITERATION_LIMIT = 2  # the last correction was not small: the surfaces are the last iterate
    SINGULAR = 3  # the surfaces cannot turn the vehicle: they stay as they were
    NO_ANSWER = 4  # a law raised, or answered what is no number: all stays as it was


class Solution(NamedTuple):
    """The surfaces within their stops, and how they were found."""

    surfaces: Surfaces
    status: int  # a SolverStatus


class FlightCondition(NamedTuple):
    """What the nominal model knows of a state and the surfaces do not change."""

    air: AirData
    clean: Coefficients
    rates: Rates
    X_cg: float  # [m]
    body: Inertia


class Iterate(NamedTuple):
    """One step of the search."""

    surfaces: Surfaces  # [rad] not limited to the stops
    correction: float  # [rad] largest change that led here
    regular: bool  # no Jacobian so far was singular


@elementwise
def flight_condition(state: State, geometric: bool) -> FlightCondition:
    """Nominal model at `state`; `geometric` says which altitude h is."""
    air = air_data(state, geometric)
    return FlightCondition(
        air,
        clean_coefficients(air, state),
        Rates(state.P, state.Q, state.R),
        centre_of_gravity(state.mass),
        inertia(state.mass),
    )


@elementwise
def angular_response(
    condition: FlightCondition, surfaces: Surfaces
) -> tuple[Rates, Rates, Rates, Rates]:
    """f(X, U) of eq 2.3 [rad/s^2]; its slopes by right elevon, left elevon and rudder [1/s^2]."""
    air, body, rates = condition.air, condition.body, condition.rates
    per_Ixx, per_Iyy, per_Izz = 1.0 / body.Ixx, 1.0 / body.Iyy, 1.0 / body.Izz
    increments, by_right, by_left, by_rudder = control_coefficients(air, surfaces)
    total = loads(air, add_coefficients(condition.clean, increments), condition.X_cg)
    right = loads(air, by_right, condition.X_cg)
    left = loads(air, by_left, condition.X_cg)
    rudder = loads(air, by_rudder, condition.X_cg)
    P_dot, Q_dot, R_dot = angular_acceleration(
        rates.P, rates.Q, rates.R, total.L, total.M, total.N, body
    )
    return (
        Rates(P_dot, Q_dot, R_dot),
        Rates(right.L * per_Ixx, right.M * per_Iyy, right.N * per_Izz),
        Rates(left.L * per_Ixx, left.M * per_Iyy, left.N * per_Izz),
        Rates(rudder.L * per_Ixx, rudder.M * per_Iyy, rudder.N * per_Izz),
    )


@elementwise
def nominal_response(state: State, surfaces: Surfaces, geometric: bool) -> Rates:
    """f(X, U) [rad/s^2]: angular acceleration of the nominal vehicle, eq 2.3."""
    response, _, _, _ = angular_response(flight_condition(state, geometric), surfaces)
    return response


@elementwise
def determinant(a: Rates, b: Rates, c: Rates) -> float:
    """Determinant [1/s^6] of the matrix with columns a, b, c [1/s^2]."""
    return (
        a.P * (b.Q * c.R - c.Q * b.R)
        - b.P * (a.Q * c.R - c.Q * a.R)
        + c.P * (a.Q * b.R - b.Q * a.R)
    )


@elementwise
def newton_step(condition: FlightCondition, demand: Rates, now: Iterate) -> Iterate:
    """One Newton-Raphson step towards f(X, U) = demand, by Cramer's rule."""
    response, right, left, rudder = angular_response(condition, now.surfaces)
    missing = Rates(demand.P - response.P, demand.Q - response.Q, demand.R - response.R)
    det = determinant(right, left, rudder)
    regular = det * det > SINGULAR_DETERMINANT * SINGULAR_DETERMINANT
    scale = 1.0 / select(regular, det, 1.0)
    d_right = select(regular, determinant(missing, left, rudder) * scale, 0.0)
    d_left = select(regular, determinant(right, missing, rudder) * scale, 0.0)
    d_rudder = select(regular, determinant(right, left, missing) * scale, 0.0)
    return Iterate(
        Surfaces(
            now.surfaces.right_elevon + d_right,
            now.surfaces.left_elevon + d_left,
            now.surfaces.rudder + d_rudder,
        ),
        max(abs(d_right), abs(d_left), abs(d_rudder)),
        now.regular & regular,
    )


@elementwise
def solve_surfaces(state: State, demand: Rates, previous: Surfaces, geometric: bool) -> Solution:
    """Surfaces [rad] with f(X, U) = `demand` [rad/s^2], from a warm start at the `previous` ones.

    Always four steps, so that the time it takes is known: enough from neutral surfaces, and two
    more than the previous command of an undisturbed flight needs.
    """
    condition = flight_condition(state, geometric)
    last = newton_step(condition, demand, Iterate(previous, 0.0, True))
    last = newton_step(condition, demand, last)
    last = newton_step(condition, demand, last)
    last = newton_step(condition, demand, last)
    solved = last.correction < CORRECTION_TOLERANCE
    usable = last.regular & (last.correction < 1.0)  # not a number compares false
    held = limit_surfaces(last.surfaces)
    surfaces = Surfaces(
        select(usable, held.right_elevon, previous.right_elevon),
        select(usable, held.left_elevon, previous.left_elevon),
        select(usable, held.rudder, previous.rudder),
    )
    free = (
        (held.right_elevon == last.surfaces.right_elevon)
        & (held.left_elevon == last.surfaces.left_elevon)
        & (held.rudder == last.surfaces.rudder)
    )
    # SolverStatus as plain numbers: singular 3, iteration limit 2, saturated 1, converged 0.
    status = select(solved, select(free, 0, 1), 2)
    return Solution(surfaces, select(last.regular, status, 3))
