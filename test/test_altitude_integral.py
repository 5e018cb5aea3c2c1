# Copyright 2026 ahv developers, Apache-2.0
"""Integral action in altitude: what the report's loops leave is gone, and nothing winds up."""

import math

import numpy as np
import pytest

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case, make_case
from ahv_analysis.flight.closed_loop import start_loop
from ahv_analysis.flight.library import fly, fly_on
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.replay.inputs import read_recording
from ahv_analysis.replay.replay import replay
from ahv_control.outer_loop import (
    AltitudeIntegral,
    Integral,
    OuterLoop,
    attitude_command,
    first_integral,
    next_integral,
)
from ahv_control.reference import Reference, held
from ahv_msgs_py.topics import STATE
from ahv_plant.model.constants import RADIANS, STEP
from ahv_plant.model.vectors import State
from ahv_plant.trim import trim
from test.flights import CRUISE

OUTER = OuterLoop(24000.0, 0.01, math.pi, math.pi / 2, AltitudeIntegral(0.02, 10.0))
SECOND = 100  # steps


def with_outer(case, **values):
    """The case with other parameters of the outer loop."""
    outer = case.parameters["outer_intermediate"] | values
    return make_case(case.name, case.parameters | {"outer_intermediate": outer})


def flown(seconds, sinking=0.0, winds_up=False, **values):
    """Altitudes [m] of every second over 24 km, of the nominal vehicle from level flight.

    Each second it is put `sinking` metres lower, as a constant disturbance would. What `winds_up`
    has its integral replaced by one without limits of any kind.
    """
    case = with_outer(load_case("nominal_di"), **values)
    truth, control, outer = case.plant.truth, case.control, case.control.outer
    loop = start_loop(trim().state, truth, control, None, None)
    altitudes, climb = [loop.plant.state.h], 0.0
    for second in range(seconds):
        *steps, loop = fly_on(loop, second * SECOND, SECOND, truth, control, None, None)
        state = loop.plant.state
        loop = loop._replace(plant=loop.plant._replace(state=state._replace(h=state.h - sinking)))
        if winds_up:
            errors = [outer.altitude - step.plant.state.h for step in steps]
            climbed = state.h - altitudes[-1]
            climb += outer.integral.gain * (outer.k_h * sum(errors) * STEP - climbed)
            kept = loop.memory.integral._replace(climb=climb)
            loop = loop._replace(memory=loop.memory._replace(integral=kept))
        altitudes.append(loop.plant.state.h)
    return np.array(altitudes) - 24000.0


@pytest.mark.unit
def test_an_integral_that_begins_adds_nothing_to_what_the_report_commands():
    """So does that of a node which is started again in flight."""
    wanted = held(24100.0, 0.0)
    first = first_integral(CRUISE, OUTER.integral)
    assert attitude_command(CRUISE, wanted, first, OUTER) == attitude_command(
        CRUISE, wanted, None, OUTER._replace(integral=None)
    )


@pytest.mark.unit
def test_it_integrates_what_the_altitude_lacks_of_the_closing_that_is_asked_for():
    kept, wanted = Integral(1.0, 23999.0), held(24100.0, 0.0)
    asked = 0.01 * (24100.0 - CRUISE.h)  # [m/s]
    later = next_integral(kept, CRUISE, wanted, OUTER, OUTER.integral)
    lacking = asked * STEP - (CRUISE.h - 23999.0)
    assert later == (pytest.approx(1.0 + 0.02 * lacking), CRUISE.h)
    closing = kept._replace(altitude=CRUISE.h - asked * STEP)
    assert next_integral(closing, CRUISE, wanted, OUTER, OUTER.integral).climb == pytest.approx(1)


@pytest.mark.unit
@pytest.mark.parametrize("limited", [{"climb_limit": 0.1 * RADIANS}, {"alpha_limit": 1e-3}])
def test_it_waits_while_a_limit_keeps_what_it_would_add_from_being_flown(limited):
    outer, high = OUTER._replace(**limited), held(CRUISE.h + 2000.0, 0.0)
    level = trim().state._replace(h=CRUISE.h)
    kept = Integral(5.0, level.h)
    assert next_integral(kept, level, high, outer, outer.integral) == kept
    sinking = held(CRUISE.h - 200.0, 0.0)
    assert next_integral(kept, level, sinking, outer, outer.integral).climb < 5.0


@pytest.mark.unit
def test_it_adds_no_more_than_its_own_limit():
    kept = Integral(9.9999, CRUISE.h + 100.0)
    assert next_integral(kept, CRUISE, held(25000.0, 0.0), OUTER, OUTER.integral).climb == 10.0


def test_the_error_that_burning_fuel_leaves_is_gone():
    left = {gain: flown(700, k_i_h=gain)[-1] for gain in (1e-12, 0.01)}
    assert left[1e-12] == pytest.approx(11.0, abs=1.0), "that of the report's loops"
    assert abs(left[0.01]) < 1.0


def test_a_constant_sinking_leaves_no_error_and_passes_as_the_poles_predict():
    """5 m/s, as a round Earth would: 500 m at k_h = 0.01 1/s; with integral action t exp(-k t)."""
    time = np.arange(701.0)
    missed = flown(700, sinking=5.0, k_i_h=0.01)
    assert np.max(np.abs(missed + 5.0 * time * np.exp(-0.01 * time))) < 25.0
    assert abs(missed[-1]) < 6.0
    assert flown(300, sinking=5.0, k_i_h=1e-12)[-1] < -450.0


def test_a_long_climb_at_its_limit_winds_nothing_up():
    """A thousand metres at half a degree, three times faster loops than the report's."""
    climb = {"altitude": 25000.0, "climb_limit": 0.5, "k_h": 0.03, "k_i_h": 0.03}
    climb |= {"integral_limit": 1000.0}
    over = [np.max(flown(250, winds_up=one, **climb)) - 1000.0 for one in (False, True)]
    assert over[0] < 20.0 and over[1] > 10.0 * over[0], over


def test_with_integral_action_nodes_fly_to_the_bits_of_the_library_and_again(tmp_path, domain):
    case = load_case(
        "neuro_adaptive_sc_gdi_protected",
        {"duration": 5.0},
        hardware="typical",
        profile="altitude_step",
    )
    case = with_outer(case, k_i_h=0.1)
    library = record_of(fly(case), False)
    fly_graph(case, tmp_path / "bag", domain=domain)
    graph = read_bag(tmp_path / "bag")
    for name in ("states", "attitude_commands", "surfaces", "throttle"):
        assert np.array_equal(getattr(graph, name), getattr(library, name)), name
    recording = read_recording(tmp_path / "bag")
    again = replay(recording, case, case.controllers)
    assert all(entry.compared == 501 and not entry.differences for entry in again.comparisons)
    told = State(*recording.topics[STATE].values[-1].tolist())
    wanted = Reference(*graph.references[-1].tolist())
    without = attitude_command(told, wanted, None, case.control.outer)
    assert abs(without.theta - graph.attitude_commands[-1, 1]) > 1e-6, "it does add something"
