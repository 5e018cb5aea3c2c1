# Copyright 2026 ahv developers, Apache-2.0
"""The true vehicle may differ from the nominal one; the flight control never hears of it."""

import ast
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ahv_control
from ahv_analysis.flight.case import load_case, load_dispersion
from ahv_control.parameters import (
    INNER_LOOP_PARAMETERS,
    LEARNER_PARAMETERS,
    OUTER_INTERMEDIATE_PARAMETERS,
    VELOCITY_PARAMETERS,
)
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import (
    NOMINAL,
    AxisDisturbance,
    Dispersion,
    Disturbance,
    Truth,
    disperse_coefficients,
    disperse_inertia,
    disturbance_acceleration,
    draw_dispersion,
)
from ahv_plant.model.aerodynamics import aerodynamic_coefficients, air_data, loads
from ahv_plant.model.constants import GRAVITY
from ahv_plant.model.mass import Inertia, centre_of_gravity, inertia
from ahv_plant.model.vectors import Surfaces
from ahv_plant.vehicle import state_rate
from test.flights import STATES, SURFACES, between

pytestmark = pytest.mark.unit

LEVEL = Surfaces(-0.1, -0.1, 0.0)
MULTIPLIERS = st.builds(Dispersion, *[between(0.5, 1.5)] * 9)


def test_no_module_of_the_flight_control_can_see_a_dispersion():
    """Only what is imported can be seen: neither the dispersion nor the vehicle that has it."""
    for path in Path(ahv_control.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            modules = []
            if isinstance(node, ast.ImportFrom):
                modules = [node.module or ""]
            elif isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            for module in modules:
                assert module not in ("ahv_plant.dispersion", "ahv_plant.vehicle"), path
                assert not module.startswith("ahv_analysis"), path


def test_no_parameter_of_a_controller_is_a_dispersion():
    for parameter in (
        *OUTER_INTERMEDIATE_PARAMETERS,
        *INNER_LOOP_PARAMETERS,
        *LEARNER_PARAMETERS,
        *VELOCITY_PARAMETERS,
    ):
        assert not parameter.name.startswith(("dispersion", "disturbance"))


@given(MULTIPLIERS)
def test_a_dispersion_changes_the_plant_alone(dispersion):
    nominal = load_case("neuro_adaptive_di")
    changes = {f"dispersion.{name}": value for name, value in dispersion._asdict().items()}
    changed = load_case("neuro_adaptive_di", changes)
    assert changed.plant.truth.dispersion == dispersion
    assert changed.control == nominal.control
    for node, parameters in nominal.parameters.items():
        assert node == "plant" or changed.parameters[node] == parameters


@pytest.mark.parametrize("name", Dispersion._fields)
@given(STATES, SURFACES, between(0.5, 1.5))
def test_every_multiplier_multiplies_what_it_names(name, state, surfaces, factor):
    by = Dispersion(**{name: factor})
    if name in Inertia._fields:
        nominal = inertia(state.mass)
        expected = nominal._replace(**{name: getattr(nominal, name) * factor})
        assert disperse_inertia(nominal, by) == expected
    else:
        nominal = aerodynamic_coefficients(air_data(state, False), state, surfaces)
        expected = nominal._replace(**{name: getattr(nominal, name) * factor})
        assert disperse_coefficients(nominal, by) == expected


@given(STATES, SURFACES, MULTIPLIERS)
def test_the_dispersed_vehicle_accelerates_by_its_own_forces_and_inertias(state, surfaces, by):
    still = state._replace(phi=0.0, theta=0.0, P=0.0, Q=0.0, R=0.0)
    air = air_data(still, False)
    own = disperse_coefficients(aerodynamic_coefficients(air, still, surfaces), by)
    total = loads(air, own, centre_of_gravity(still.mass))
    body = disperse_inertia(inertia(still.mass), by)
    true = state_rate(still, surfaces, 0.0, 0.0, Truth(dispersion=by))
    assert (true.u, true.v, true.w - GRAVITY) == pytest.approx(
        [force / still.mass for force in total[:3]], rel=1e-9, abs=1e-9
    )
    assert pytest.approx(
        [moment / own for moment, own in zip(total[3:], body, strict=True)], rel=1e-9, abs=1e-12
    ) == (true.P, true.Q, true.R)


@given(STATES, SURFACES)
def test_no_dispersion_is_no_change(state, surfaces):
    zero = Truth(disturbance=Disturbance())
    assert state_rate(state, surfaces, 0.2, 3.0, zero) == state_rate(
        state, surfaces, 0.2, 3.0, NOMINAL
    )


@given(STATES, between(0.0, 100.0))
def test_a_disturbance_adds_to_the_angular_accelerations(state, time):
    axis = AxisDisturbance(0.01, 0.02, 50.0, 0.03, 2.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    d = disturbance_acceleration(Disturbance(Q=axis), time, state.P, state.Q, state.R)
    P, Q, R = state.P, state.Q, state.R
    expected = 0.01 + (0.02 if time >= 50.0 else 0.0) + 0.03 * math.sin(2.0 * time)
    expected += 0.1 * P + 0.2 * Q + 0.3 * R + 0.4 * P**2 + 0.5 * Q**2 + 0.6 * R**2
    assert d == pytest.approx((0.0, expected, 0.0), abs=1e-12)
    nominal = state_rate(state, LEVEL, 0.2, time, NOMINAL)
    true = state_rate(state, LEVEL, 0.2, time, Truth(disturbance=Disturbance(Q=axis)))
    assert pytest.approx(expected, abs=1e-12) == true.Q - nominal.Q
    assert true._replace(Q=0.0) == nominal._replace(Q=0.0)


def test_a_drawn_run_can_be_drawn_again_alone():
    runs = [draw_dispersion(0.3, 7, run) for run in range(5)]
    assert draw_dispersion(0.3, 7, 3) == runs[3]
    assert len(set(runs)) == 5
    assert draw_dispersion(0.3, 8, 3) != runs[3]


def test_draws_fill_their_interval_evenly():
    draws = np.array([draw_dispersion(0.4, 1, run) for run in range(4000)]).ravel()
    assert 0.6 <= draws.min() < 0.601 and 1.399 < draws.max() <= 1.4
    assert draws.mean() == pytest.approx(1.0, abs=0.005)
    assert draws.std() == pytest.approx(0.4 / math.sqrt(3), abs=0.005)


def test_disturbance_parameters_are_in_degrees():
    changes = {
        "disturbance.P.constant": 2.0,
        "disturbance.Q.P2": 0.5,
        "disturbance.R.frequency": 3.0,
        "disturbance.R.Q": -0.1,
    }
    d = load_case("nominal_di", changes).plant.truth.disturbance
    assert d.P.constant == pytest.approx(math.radians(2.0))
    assert pytest.approx(math.degrees(0.5)) == d.Q.P2
    assert (d.R.frequency, d.R.Q) == (3.0, -0.1)
    assert load_case("nominal_di").plant.truth.disturbance is None


def test_a_dispersion_file_holds_nothing_but_the_truth(tmp_path):
    path = tmp_path / "heavy.yaml"
    path.write_text("/ahv/plant: {ros__parameters: {dispersion: {Iyy: 1.3}}}")
    assert load_dispersion(path) == {"dispersion.Iyy": 1.3}
    path.write_text("/ahv/plant: {ros__parameters: {duration: 3.0}}")
    with pytest.raises(ParameterError, match=r"heavy\.yaml: plant: duration"):
        load_dispersion(path)
    path.write_text("/ahv/inner_loop: {ros__parameters: {k_P: 3.0}}")
    with pytest.raises(ParameterError, match="inner_loop: k_P"):
        load_dispersion(path)
