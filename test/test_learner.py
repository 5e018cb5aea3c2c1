# Copyright 2026 ahv developers, Apache-2.0
"""The disturbance learner is chapter 4's, its barrier holds in discrete time, and it learns."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_control.disturbance_learner import (
    Basis,
    LearnerSettings,
    barrier_step,
    basis,
    basis_jacobian,
    disturbance_estimate,
    dot,
    learner_step,
    learning_direction,
    start_learner,
)
from ahv_control.error_dynamics import ErrorDynamics
from ahv_control.flight_control import Memory, answer, next_learner
from ahv_plant.dispersion import NOMINAL, disturbance_acceleration
from ahv_plant.model.constants import DEGREES, RADIANS, STEP
from ahv_plant.model.vectors import Measurement, Rates, Surfaces
from ahv_plant.vehicle import vehicle_step
from test.flights import CRUISE, as_python, between

pytestmark = pytest.mark.unit

PLAIN = ErrorDynamics(Rates(2.0, 2.0, 2.0), Rates(1.0, 1.0, 1.0), 1.0)
SETTINGS = LearnerSettings(PLAIN, Rates(15.0, 18.0, 15.0), 0.7, 40.0, 0.01, False)
RATES_DEG = st.tuples(*[between(-6.0, 6.0)] * 3)


def jacobian(rates):
    return np.array(basis_jacobian(*rates)).T


@given(RATES_DEG)
def test_basis_is_that_of_section_4_3(rates):
    P, Q, R = rates
    expected = [
        1,
        P,
        P**2,
        Q,
        Q**2,
        (P * Q) ** 2,
        R,
        R**2,
        (P * R) ** 2,
        (Q * R) ** 2,
        (P * Q * R) ** 2,
    ]
    assert basis(P, Q, R) == pytest.approx(expected, rel=1e-14, abs=1e-300)


@given(RATES_DEG)
def test_jacobian_of_eq_4_14_is_the_complex_step_derivative(rates):
    for column in range(3):
        stepped = [complex(rate) for rate in rates]
        stepped[column] += 1e-30j
        expected = np.imag(np.array(as_python(basis)(*stepped), dtype=complex)) / 1e-30
        assert jacobian(rates)[:, column] == pytest.approx(expected, rel=1e-13, abs=1e-13)


@given(RATES_DEG, between(1.0, 100.0), st.just(0.0) | between(1e-4, 10.0))
def test_eq_4_13_by_woodbury_equals_the_dense_inverse(rates, gamma, theta):
    J, phi = jacobian(rates), np.array(basis(*rates))
    matrix = np.eye(11) / gamma + theta * J @ J.T
    found = np.array(learning_direction(*rates, gamma, theta))
    # to 1e-12 of the equation: the solution itself inherits the condition of the dense matrix
    residual = matrix @ found - phi
    scale = np.abs(matrix) @ np.abs(found) + np.abs(phi) + 1e-300
    assert np.max(np.abs(residual) / scale) < 1e-12


@pytest.mark.parametrize("theta", [0.0, 0.01, 1.0])
def test_eq_4_13_equals_the_dense_solve_at_flight_rates(theta):
    """The dense solve in 40 digits: in double it would be the less exact of the two."""
    random = np.random.default_rng(2)
    with mpmath.workdps(40):
        for rates in random.uniform(-2.0, 2.0, (40, 3)).tolist():
            J, phi = mpmath.matrix(jacobian(rates).tolist()), mpmath.matrix(list(basis(*rates)))
            dense = mpmath.lu_solve(mpmath.eye(11) / 40 + theta * J * J.T, phi)
            found = mpmath.matrix(list(learning_direction(*rates, 40.0, theta)))
            assert mpmath.norm(found - dense) < 1e-12 * mpmath.norm(dense)


@given(st.floats(-1e12, 1e12), between(0.0, 50.0), between(0.01, 10.0), between(0.1, 1e6))
def test_the_barrier_holds_whatever_happens(innovation, k_ap, k_b, strength):
    error, push = barrier_step(innovation, k_ap, k_b, strength)
    assert abs(error) <= k_b
    assert math.isfinite(push)
    assert error * innovation >= 0 and push * innovation >= 0
    if abs(innovation) < 1e6 * k_b:
        assert abs(error) < k_b


@given(between(-0.6, 0.6), between(10.0, 2000.0))
def test_the_barrier_step_solves_the_implicit_equation(innovation, strength):
    k_ap, k_b = 15.0, 0.7
    error, push = barrier_step(innovation, k_ap, k_b, strength)
    assert push == pytest.approx(error / (k_b**2 - error**2), rel=1e-9, abs=1e-12)
    left = (1 + STEP * k_ap) * error + STEP**2 * strength * push
    assert left == pytest.approx(innovation, rel=1e-6, abs=1e-12)


@given(between(0.0, 1e3), between(0.1, 5000.0))
def test_an_unfinished_barrier_step_errs_towards_less_learning(innovation, strength):
    k_ap, k_b = 15.0, 0.7
    error, push = barrier_step(innovation, k_ap, k_b, strength)
    left = (1 + STEP * k_ap) * error + STEP**2 * strength * push
    assert left <= innovation * (1 + 1e-12)


@given(st.tuples(*[between(-0.2, 0.2)] * 3), st.tuples(*[between(-5.0, 5.0)] * 3))
def test_the_learner_keeps_every_error_inside_the_barrier(now, response):
    """For any jump of the rates in one step, as a disturbance without bound would make it."""
    learner = start_learner(Rates(0.0, 0.0, 0.0))
    for _ in range(3):
        learner = learner_step(
            learner,
            Rates(*response),
            Rates(0.0, 0.0, 0.0),
            Rates(*now),
            SETTINGS,
        )
        errors = np.degrees(np.array(now) - np.array(learner.X_a))
        assert np.all(np.abs(errors) < SETTINGS.k_b)


def track(disturbance, seconds, settings=SETTINGS):
    """Learn d(t, X) [deg/s^2] of each channel along rates that the test makes; errors of d-hat."""
    steps = round(seconds / STEP)
    time = np.arange(steps + 1) * STEP
    rates = np.array(
        [0.6 * np.sin(0.9 * time), 0.5 * np.sin(0.7 * time + 1), 0.4 * np.cos(1.1 * time)]
    )
    learner = start_learner(Rates(*(rates[:, 0] * RADIANS).tolist()))
    errors = []
    for k in range(steps):
        before, now = rates[:, k], rates[:, k + 1]
        true = np.array(disturbance(time[k], before))
        response = (now - before) / STEP - true  # what the nominal model makes of it
        learner = learner_step(
            learner,
            Rates(*(response * RADIANS).tolist()),
            Rates(0.0, 0.0, 0.0),
            Rates(*(now * RADIANS).tolist()),
            settings,
        )
        estimate = np.array(disturbance_estimate(learner, Rates(*(now * RADIANS).tolist())))
        errors.append(estimate * DEGREES - true)
    return time[1:], np.array(errors)


@pytest.mark.parametrize(
    "name, disturbance, bound",
    [
        ("constant", lambda t, x: (1.0, -2.0, 0.5), 0.08),
        ("sine", lambda t, x: (np.sin(0.5 * t), 2 * np.sin(0.3 * t), np.cos(0.5 * t)), 0.25),
        (
            "state-dependent",
            lambda t, x: (2 * x[0] + 1, x[1] ** 2 - x[1], 0.5 - x[2] + (x[0] * x[2]) ** 2),
            0.25,
        ),
    ],
)
def test_the_estimate_converges_to_the_disturbance(name, disturbance, bound):
    time, errors = track(disturbance, 30.0)
    true = np.array([disturbance(t, np.zeros(3)) for t in time])
    assert np.max(np.abs(true)) > 2 * bound  # or there would be nothing to learn
    assert np.max(np.abs(errors[time > 5.0])) < bound, name
    if name != "sine":  # within the span of the basis: it goes on converging
        early, late = errors[(time > 5.0) & (time < 15.0)], errors[time > 20.0]
        assert np.max(np.abs(late)) < np.max(np.abs(early)), name


@pytest.mark.compiled
@pytest.mark.parametrize("part", ["constant", "amplitude", "Q"])
def test_in_flight_the_estimate_is_the_disturbance_of_the_plant(part):
    """On the nominal vehicle all that the learner can find is the disturbance d(t, X)."""
    value = {"constant": 0.8, "amplitude": 0.8, "Q": -0.8}[part]
    changes = {f"disturbance.Q.{part}": value, "disturbance.Q.frequency": 0.5, "duration": 40.0}
    changes |= {f"dispersion.{name}": 1.0 for name in ("CL", "CD", "CY", "Cl", "Cm", "Cn")}
    changes |= {f"dispersion.{name}": 1.0 for name in ("Ixx", "Iyy", "Izz")}
    changes["initial.Q"] = 3.0
    case = load_case("neuro_adaptive_di", changes)
    errors, sizes = [], []
    for step in fly(case):
        state = step.state
        estimate = disturbance_estimate(step.learner, Rates(state.P, state.Q, state.R))
        true = disturbance_acceleration(
            case.plant.truth.disturbance, step.stamp * 1e-9, state.P, state.Q, state.R
        )
        errors.append((np.array(estimate) - true) * DEGREES)
        sizes.append(abs(true[1]) * DEGREES)
    late = np.abs(np.array(errors)[500:])
    assert max(sizes) > 0.5
    # a slope of the disturbance is followed with the lag k_ap k_b^2 / gamma of the linear observer
    law = case.control.learner
    lag = law.k_ap.Q * law.k_b**2 / law.gamma
    assert np.max(late) < 1.1 * lag * 0.5 * 0.8


def lyapunov(error, weights_error, slope_error, settings):
    """V_i of eq 4.11 for one channel, everything in degrees."""
    barrier = 0.5 * math.log(settings.k_b**2 / (settings.k_b**2 - error**2))
    return (
        barrier
        + weights_error @ weights_error / (2 * settings.gamma)
        + 0.5 * settings.theta * slope_error @ slope_error
    )


@pytest.mark.compiled
def test_the_lyapunov_function_falls_along_a_flight():
    """Eq 4.11 with known ideal weights does not rise outside a residual set.

    The disturbance of the pitch channel is in the span of the basis, so that its ideal weights are
    known; the vehicle is nominal otherwise.
    """
    changes = {"disturbance.Q.constant": 1.0, "disturbance.Q.Q": -0.5, "duration": 30.0}
    changes |= {
        f"dispersion.{name}": 1.0
        for name in load_case("nominal_di").plant.truth.dispersion._fields
    }
    case = load_case("neuro_adaptive_di", changes | {"initial.Q": 2.0})
    ideal = np.array(Basis(one=1.0, Q=-0.5))
    settings = case.control.learner
    values, errors = [], []
    for step in fly(case):
        rates = [rate * DEGREES for rate in step.state[3:6]]
        error = rates[1] - step.learner.X_a.Q * DEGREES
        missing = ideal - np.array(step.learner.W_Q)
        values.append(lyapunov(error, missing, jacobian(rates).T @ missing, settings))
        errors.append(abs(error))
    values, errors = np.array(values), np.array(errors)
    rises = np.diff(values)
    residual = errors[1:] < 0.01  # [deg/s] where the model's own step error is what is left
    assert np.all(rises[~residual] <= 1e-9)
    assert np.all(rises[residual] < 1e-4)
    assert values[-1] < 0.8 * values[0]


def test_a_surface_at_its_stop_does_not_wind_the_learner_up():
    """The observer knows the surfaces as they are, so that what they lack is not learned."""
    state = CRUISE
    stop = Surfaces(-0.6981317007977318, -0.6981317007977318, 0.0)
    case = load_case("neuro_adaptive_di")
    learner = start_learner(Rates(0.0, 0.0, 0.0))
    for step in range(40):
        later = vehicle_step(state, stop, 0.2, step * STEP, NOMINAL)
        learner = next_learner(
            learner,
            state,
            stop,
            Rates(1.0, 1.0, 1.0),
            Measurement(later, stop),
            case.control.learner,
        )
        state = later
    estimate = np.array(disturbance_estimate(learner, Rates(state.P, state.Q, state.R)))
    acceleration = abs(state.Q) / 0.4  # [rad/s^2] mean over the time
    assert acceleration > 0.6
    assert np.max(np.abs(estimate)) < 0.002 * acceleration
    commands = answer(state, None, Memory(learner, None), stop, case.control)
    assert all(math.isfinite(value) for value in commands.surfaces)


def test_weights_of_a_fresh_learner_estimate_nothing():
    learner = start_learner(Rates(0.1, 0.2, 0.3))
    assert learner == start_learner(Rates(0.1, 0.2, 0.3), 0.0)
    assert learner.X_a == learner.X_d == (0.1, 0.2, 0.3)
    assert disturbance_estimate(learner, Rates(0.1, 0.2, 0.3)) == (0.0, 0.0, 0.0)
    assert dot(Basis(one=2.0, Q=3.0), Basis(one=5.0, Q=7.0, R=11.0)) == 31.0


@given(st.tuples(*[between(-0.2, 0.2)] * 3), between(-100.0, 100.0))
def test_a_first_estimate_is_of_the_pitch_channel_alone_at_any_rates(rates, first):
    estimate = disturbance_estimate(start_learner(Rates(0.0, 0.0, 0.0), first), Rates(*rates))
    assert estimate == (0.0, pytest.approx(first * RADIANS), 0.0)
