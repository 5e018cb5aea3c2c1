# Copyright 2026 ahv developers, Apache-2.0
"""Every loop inverts what it says it inverts."""

import math

import numpy as np
import pytest
from hypothesis import given

from ahv_control.error_dynamics import ErrorDynamics
from ahv_control.flight_control import FlightControl, Memory, answer
from ahv_control.inner_loop import InnerLoop, nominal_surfaces
from ahv_control.intermediate_loop import IntermediateLoop, rate_command
from ahv_control.newton_raphson import (
    SolverStatus,
    angular_response,
    flight_condition,
    solve_surfaces,
)
from ahv_control.outer_loop import OuterLoop, attitude_command
from ahv_control.reference import Reference, held
from ahv_control.velocity_loop import VelocityLoop, throttle_command
from ahv_plant.dispersion import NOMINAL
from ahv_plant.model.constants import (
    DEGREES,
    RADIANS,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
)
from ahv_plant.model.vectors import Attitude, Rates, Surfaces, limit_surfaces
from ahv_plant.safe_command import level_surfaces, safe_surfaces
from ahv_plant.vehicle import state_rate
from test.flights import CRUISE, STATES, SURFACES, between, degrees

pytestmark = pytest.mark.unit

NEUTRAL = Surfaces(0.0, 0.0, 0.0)


OUTER = OuterLoop(24000.0, 0.01, math.pi, math.pi / 2)
VELOCITY = VelocityLoop(1786.4, 0.01, False)


def inner_loop(gains):
    """Plain dynamic inversion with these gains."""
    dynamics = ErrorDynamics(gains, Rates(1.0, 1.0, 1.0), 1.0)
    return InnerLoop(dynamics, dynamics, Rates(15.0, 18.0, 15.0), False)


@given(STATES, between(20000.0, 30000.0))
def test_the_commanded_pitch_gives_the_commanded_climb(state, altitude):
    """Eq 3.1 with the plus sign: at theta*, h_dot = k_h (h* - h)."""
    command = attitude_command(state, held(altitude, 0.0), None, OUTER)
    pitched = state._replace(theta=command.theta)
    climb = state_rate(pitched, NEUTRAL, 0.2, 0.0, NOMINAL).h
    assert climb == pytest.approx(0.01 * (altitude - state.h), abs=1e-8)
    assert (command.phi, command.psi) == (0.0, 0.0)


@given(STATES, degrees(30.0), degrees(30.0), degrees(30.0), degrees(1.0))
def test_the_commanded_rates_give_the_commanded_euler_rates(state, phi, theta, psi, turn):
    gains = IntermediateLoop(0.1, 0.2, 0.3)
    command = rate_command(state, Attitude(phi, theta, psi), turn, gains)
    turning = state._replace(P=command.P, Q=command.Q, R=command.R)
    rate = state_rate(turning, NEUTRAL, 0.2, 0.0, NOMINAL)
    psi_dot = 0.3 * (psi - state.psi) + turn
    expected = (0.1 * (phi - state.phi), 0.2 * (theta - state.theta), psi_dot)
    assert (rate.phi, rate.theta, rate.psi) == pytest.approx(expected, abs=1e-12)


@given(STATES, SURFACES)
def test_the_jacobian_is_the_complex_step_derivative(state, surfaces):
    condition = flight_condition(state, False)
    _, *slopes = angular_response(condition, surfaces)
    for number, slope in enumerate(slopes):
        stepped = [complex(value) for value in surfaces]
        stepped[number] += 1e-30j
        response, *_ = angular_response(condition, Surfaces(*stepped))
        expected = [value.imag / 1e-30 for value in response]
        assert slope == pytest.approx(expected, rel=1e-12, abs=1e-14)


@given(STATES, *[between(-0.02, 0.02)] * 3)
def test_the_surfaces_give_the_demanded_acceleration(state, P_dot, Q_dot, R_dot):
    demand = Rates(P_dot, Q_dot, R_dot)
    solution = solve_surfaces(state, demand, Surfaces(-0.1, -0.1, 0.0), False)
    assert all(SURFACE_MINIMUM <= value <= SURFACE_MAXIMUM for value in solution.surfaces)
    if solution.status == SolverStatus.CONVERGED:
        rate = state_rate(state, solution.surfaces, 0.2, 0.0, NOMINAL)
        assert pytest.approx(demand, abs=1e-9) == (rate.P, rate.Q, rate.R)


def test_the_solver_converges_in_ordinary_flight():
    rolling = CRUISE._replace(P=0.05, Q=-0.03, R=0.05, v=30.0)
    for state in (CRUISE, rolling):
        solution = solve_surfaces(state, Rates(0.05, -0.02, 0.04), NEUTRAL, False)
        assert solution.status == SolverStatus.CONVERGED


def test_a_solution_beyond_a_stop_is_held_there_and_called_saturated():
    solution = solve_surfaces(CRUISE, Rates(0.0, -1.0, 0.0), Surfaces(-0.1, -0.1, 0.0), False)
    assert solution.status == SolverStatus.SATURATED
    assert SURFACE_MAXIMUM in solution.surfaces or SURFACE_MINIMUM in solution.surfaces


def test_without_air_the_jacobian_is_singular_and_the_surfaces_stay():
    slow = CRUISE._replace(u=1.0, w=0.0)
    previous = Surfaces(0.1, 0.2, 0.3)
    solution = solve_surfaces(slow, Rates(0.1, 0.1, 0.1), previous, False)
    assert solution == (previous, SolverStatus.SINGULAR)


@pytest.mark.parametrize("field", ["u", "P", "h"])
def test_not_a_number_leaves_the_surfaces_as_they_were(field):
    previous = Surfaces(0.1, 0.2, 0.3)
    broken = CRUISE._replace(**{field: math.nan})
    solution = solve_surfaces(broken, Rates(0.0, 0.0, 0.0), previous, False)
    assert solution.surfaces == previous
    assert solution.status in (SolverStatus.SINGULAR, SolverStatus.ITERATION_LIMIT)


@given(*[degrees(3.0)] * 6)
def test_the_rate_error_decays_at_the_gains(P, Q, R, P_command, Q_command, R_command):
    """Section 3.3 on the nominal vehicle: e_dot + K e = 0."""
    state = CRUISE._replace(P=P, Q=Q, R=R)
    command = Rates(P_command, Q_command, R_command)
    gains = inner_loop(Rates(1.0, 2.0, 1.5))
    solution = nominal_surfaces(state, command, Surfaces(-0.1, -0.1, 0.0), gains)
    assert solution.status == SolverStatus.CONVERGED
    rate = state_rate(state, solution.surfaces, 0.2, 0.0, NOMINAL)
    error = np.array(command) - (P, Q, R)
    assert pytest.approx(np.array((1.0, 2.0, 1.5)) * error, abs=1e-9) == (rate.P, rate.Q, rate.R)


@given(STATES, SURFACES, between(1700.0, 1900.0))
def test_the_throttle_gives_the_commanded_acceleration(state, surfaces, speed):
    """Eq 3.2: with sigma_T between its stops, u_dot = k_u (u* - u)."""
    throttle = throttle_command(state, surfaces, held(0.0, speed), VELOCITY)
    assert THROTTLE_MINIMUM <= throttle <= THROTTLE_MAXIMUM
    rate = state_rate(state, surfaces, throttle, 0.0, NOMINAL).u
    wanted = 0.01 * (speed - state.u)
    if throttle == THROTTLE_MINIMUM:
        assert rate > wanted - 1e-9
    elif throttle == THROTTLE_MAXIMUM:
        assert rate < wanted + 1e-9
    else:
        assert rate == pytest.approx(wanted, abs=1e-9)


def test_at_trim_the_loops_ask_for_trim():
    from ahv_plant.trim import trim

    found = trim()
    attitude = attitude_command(found.state, held(24000.0, 0.0), None, OUTER)
    assert attitude.theta * DEGREES == pytest.approx(2.9442, abs=1e-4)
    rates = rate_command(found.state, attitude, 0.0, IntermediateLoop(0.2, 0.2, 0.2))
    solution = nominal_surfaces(
        found.state, rates, found.surfaces, inner_loop(Rates(2.0, 2.0, 2.0))
    )
    assert solution.surfaces == pytest.approx(found.surfaces, abs=1e-9)
    throttle = throttle_command(found.state, solution.surfaces, held(0.0, found.state.u), VELOCITY)
    assert throttle == pytest.approx(found.throttle, abs=1e-9)


@given(STATES, SURFACES, between(0.0, 1.0))
def test_the_loops_are_composed_as_the_graph_composes_its_nodes(state, previous, bank):
    """Without a reference they hold their own altitude and speed."""
    intermediate = IntermediateLoop(0.2, 0.2, 0.2)
    inner = inner_loop(Rates(2.0, 2.0, 2.0))
    control = FlightControl(OUTER, intermediate, inner, VELOCITY, None)
    own = held(OUTER.altitude, VELOCITY.speed)
    turning = Reference(24500.0, 1800.0, bank, 0.2, 3.0, 0.1, 0.01)
    for reference, wanted in ((None, own), (own, own), (turning, turning)):
        commands = answer(state, reference, Memory(None, None), previous, control)
        assert commands.attitude == attitude_command(state, wanted, None, OUTER)
        rates = rate_command(state, commands.attitude, wanted.psi_rate, intermediate)
        assert commands.rates == rates
        surfaces = nominal_surfaces(state, commands.rates, previous, inner)
        assert (commands.surfaces, commands.status) == surfaces
        throttle = throttle_command(state, commands.surfaces, wanted, VELOCITY)
        assert commands.throttle == throttle


@given(STATES, between(-4e4, 4e4), between(0.5, 10.0))
def test_no_climb_angle_is_asked_for_beyond_its_limit(state, error, limit):
    """Though the error of altitude asks for more than the whole speed could give."""
    limited = OUTER._replace(climb_limit=limit * RADIANS)
    command = attitude_command(state, held(state.h + error, 0.0), None, limited)
    pitched = state._replace(theta=command.theta)
    climb = state_rate(pitched, NEUTRAL, 0.2, 0.0, NOMINAL).h
    B = state.v * math.sin(state.phi) + state.w * math.cos(state.phi)
    assert abs(climb) <= math.hypot(state.u, B) * math.sin(limit * RADIANS) + 1e-6


@given(STATES, between(-50.0, 50.0), between(-1.0, 1.0))
def test_the_rates_of_the_reference_are_added_to_what_the_errors_ask_for(state, climb, faster):
    reference = held(state.h, state.u)._replace(altitude_rate=climb, speed_rate=faster)
    pitched = state._replace(theta=attitude_command(state, reference, None, OUTER).theta)
    rate = state_rate(pitched, NEUTRAL, 0.2, 0.0, NOMINAL)
    assert rate.h == pytest.approx(climb, abs=1e-8)
    throttle = throttle_command(state, NEUTRAL, reference, VELOCITY)
    if THROTTLE_MINIMUM < throttle < THROTTLE_MAXIMUM:
        rate = state_rate(state, NEUTRAL, throttle, 0.0, NOMINAL)
        assert rate.u == pytest.approx(faster, abs=1e-9)


@given(SURFACES)
def test_level_surfaces_keep_the_pitching_elevons_and_turn_nothing(held):
    level = level_surfaces(held)
    assert level.right_elevon == level.left_elevon
    assert level.right_elevon + level.left_elevon == pytest.approx(sum(held[:2]), abs=1e-15)
    assert level.rudder == 0.0


@given(SURFACES)
def test_the_safe_command_is_level_where_nothing_moved(held):
    assert safe_surfaces(held, CRUISE, CRUISE) == limit_surfaces(level_surfaces(held))
