# Copyright 2026 ahv developers, Apache-2.0
"""Actuators and latency against closed forms: steps, frequencies, ramps, play, shifts."""

from math import atan2, exp, inf, pi, radians, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, freqz

from ahv_plant.dispersion import NOMINAL
from ahv_plant.hardware.actuators import Actuator, Failure, resting
from ahv_plant.hardware.delay import LONGEST, line_at, through
from ahv_plant.hardware.motion import Actuators, Servos, resting_servos, step_on_actuators
from ahv_plant.model.constants import STEP, SURFACE_MAXIMUM, SURFACE_MINIMUM
from ahv_plant.model.vectors import Controls, Surfaces
from ahv_plant.start import DEFAULT_START
from ahv_plant.vehicle import vehicle_step

pytestmark = pytest.mark.unit

TRIM = Controls(Surfaces(-0.12, -0.12, 0.0), 0.2)
ENGINE = Actuator(0, 1.0, 0.7, inf, 0.1, 0.9, 0.0, 0.0)


def actuator(order=1, frequency=30.0, **others):
    made = Actuator(order, frequency, 0.7, inf, SURFACE_MINIMUM, SURFACE_MAXIMUM, 0.0, 0.0)
    return made._replace(**others)


def follow(by, commands, start=0.0):
    """Positions of an elevon that follows `commands` [rad], one a step, after each of them."""
    actuators = Actuators(by, by, by, ENGINE)
    state = DEFAULT_START
    servos = resting_servos(Controls(Surfaces(start, start, start), 0.2), actuators)
    found = []
    for step, command in enumerate(commands):
        told = Controls(Surfaces(command, command, command), 0.2)
        _, servos, controls = step_on_actuators(
            state, servos, told, step * STEP, NOMINAL, actuators
        )
        servos = Servos(*servos)
        found.append(controls.surfaces.right_elevon)
    return np.array(found)


def test_a_step_of_first_order_is_an_exponential():
    found = follow(actuator(), [0.1] * 30)
    exact = [0.1 * (1.0 - exp(-30.0 * STEP * (n + 1))) for n in range(30)]
    assert found == pytest.approx(exact, abs=4e-6)  # the Runge-Kutta step's own error


def test_a_step_of_second_order_overshoots_as_it_should():
    w, z = 20.0, 0.5
    found = follow(actuator(2, w, damping=z), [0.1] * 60)
    damped = w * sqrt(1.0 - z * z)
    time = STEP * np.arange(1, 61)
    exact = 0.1 * (
        1.0
        - np.exp(-z * w * time)
        * (np.cos(damped * time) + z / sqrt(1.0 - z * z) * np.sin(damped * time))
    )
    assert found == pytest.approx(exact, abs=1e-5)
    assert max(found) == pytest.approx(0.1 * (1.0 + exp(-pi * z / sqrt(1 - z * z))), abs=1e-4)


@pytest.mark.parametrize("frequency", [2.0, 8.0, 20.0])
@pytest.mark.parametrize("order", [1, 2])
def test_a_sine_comes_out_with_the_gain_and_phase_of_the_transfer_function(order, frequency):
    """Of the servo behind a command that is held for a step, by scipy's zero-order hold."""
    w, z = 30.0, 0.7
    steps = 4000
    time = STEP * np.arange(steps)
    found = follow(actuator(order, w, damping=z), 0.05 * np.sin(frequency * time))
    late = slice(1000, steps)  # all transients are over
    at = time[late] + STEP
    basis = np.stack([np.sin(frequency * at), np.cos(frequency * at)], axis=1)
    (a, b), *_ = np.linalg.lstsq(basis, found[late], rcond=None)
    servo = ([w], [1.0, w]) if order == 1 else ([w * w], [1.0, 2.0 * z * w, w * w])
    top, bottom, _ = cont2discrete(servo, STEP, "zoh")
    exact = freqz(top[0], bottom, [frequency * STEP])[1][0]
    assert sqrt(a * a + b * b) / 0.05 == pytest.approx(abs(exact), rel=1e-3)
    assert atan2(b, a) == pytest.approx(np.angle(exact), abs=1e-3)


@pytest.mark.parametrize("order", [1, 2])
def test_at_its_rate_limit_an_actuator_ramps(order):
    limit = radians(60.0)
    found = follow(actuator(order, 50.0, rate_limit=limit), [SURFACE_MINIMUM] * 50)
    assert np.all(np.abs(np.diff(found)) <= limit * STEP * (1.0 + 1e-12))
    ramping = slice(5, 35)
    assert np.diff(found)[ramping] == pytest.approx(-limit * STEP, rel=1e-12)


@given(st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=40), st.sampled_from([1, 2]))
def test_no_command_takes_it_beyond_a_stop(commands, order):
    found = follow(actuator(order, 100.0, damping=0.1), commands)
    assert np.all((found >= SURFACE_MINIMUM) & (found <= SURFACE_MAXIMUM))


def test_what_lies_in_the_dead_zone_is_not_noticed():
    by = actuator(dead_zone=0.01)
    assert np.all(follow(by, [0.009] * 100) == 0.0)
    assert follow(by, [0.05] * 300)[-1] == pytest.approx(0.04, abs=1e-9)


def test_play_shows_twice_its_half_where_the_motion_turns():
    found = follow(actuator(1, 5.0, backlash=0.02), [*[0.1] * 300, *[-0.1] * 300])
    assert found[299] == pytest.approx(0.09, abs=1e-6)
    assert found[-1] == pytest.approx(-0.09, abs=1e-6)
    assert found[300] == found[299], "the play is crossed first"


@pytest.mark.parametrize(
    ("failure", "end"),
    [
        (Failure.STUCK, None),
        (Failure.HARD_UP, SURFACE_MINIMUM),
        (Failure.HARD_DOWN, SURFACE_MAXIMUM),
    ],
)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_failure_begins_at_its_time(order, failure, end):
    commands = 0.1 * np.sin(3.0 * STEP * np.arange(300))
    whole = follow(actuator(order), commands)
    found = follow(actuator(order, failure=failure, failure_time=1.0), commands)
    assert np.array_equal(found[:100], whole[:100])
    assert found[-1] == pytest.approx(found[99] if end is None else end, abs=1e-6)


def test_what_is_afloat_lies_in_the_wind_and_half_a_surface_has_half_the_effect():
    float_ = follow(actuator(failure=Failure.FLOATING), [0.1] * 2)
    alpha = atan2(DEFAULT_START.w, DEFAULT_START.u)
    assert float_[-1] == pytest.approx(-alpha, abs=0.02)
    half = actuator(0, failure=Failure.HALF_EFFECTIVE)
    whole = actuator(0)
    told = Controls(Surfaces(0.1, 0.1, 0.05), 0.2)
    ends = []
    for by, command in ((half, told), (whole, Controls(Surfaces(0.05, 0.05, 0.025), 0.2))):
        actuators = Actuators(by, by, by, ENGINE)
        servos = resting_servos(TRIM, actuators)
        later, _, _ = step_on_actuators(DEFAULT_START, servos, command, 0.0, NOMINAL, actuators)
        ends.append(later)
    assert ends[0] == ends[1]


def test_actuators_that_move_at_once_are_none():
    """Nor does the step with servos round otherwise than the vehicle's own."""
    by = actuator(0)
    actuators = Actuators(by, by, by, ENGINE)
    servos = resting_servos(TRIM, actuators)
    told = Controls(Surfaces(-0.2, -0.1, 0.05), 0.3)
    later, _, controls = step_on_actuators(DEFAULT_START, servos, told, 0.0, NOMINAL, actuators)
    assert later == vehicle_step(DEFAULT_START, told.surfaces, told.throttle, 0.0, NOMINAL)
    assert controls == told


@given(st.integers(0, LONGEST), st.lists(st.booleans(), min_size=60, max_size=60))
def test_a_delay_is_a_shift_and_what_is_late_leaves_the_one_before_in_force(delay, late):
    line = line_at(TRIM)
    sent = [Controls(Surfaces(0.01 * n, -0.01 * n, 0.001 * n), 0.2 + 0.001 * n) for n in range(60)]
    for step in range(60):
        arrived = through(line, sent[step], step, delay, float(late[step]))
        due = step - delay - late[step]
        assert arrived == (sent[due] if due >= 0 else TRIM)


def test_a_resting_actuator_rests():
    assert resting(0.1, actuator()) == (0.1, 0.0, 0.1)
    assert follow(actuator(2), [0.1] * 50, start=0.1) == pytest.approx([0.1] * 50, abs=1e-15)
