# Copyright 2026 ahv developers, Apache-2.0
"""Where the model of the vehicle ends, a flight ends or says so."""

from dataclasses import replace

import numpy as np
import pytest

from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.flight.case import load_case, make_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.outcome import Cause
from ahv_analysis.report.summary import outside_the_model, summarize
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.model.vectors import State


def test_a_flight_ends_when_the_fuel_is_burnt():
    case = load_case("nominal_di", {"initial.mass": 60_050.0})
    steps = list(fly(case))
    assert steps[-1].ended_early.startswith("left the mass model at")
    assert 60_000.0 < steps[-1].state.mass < 60_001.0
    summary = summarize(record_of(steps, False), steps[-1].ended_early)
    assert not summary["success"] and summary["cause"] == "left_the_mass_model"
    assert fly_alone(case).cause == Cause.LEFT_THE_MASS_MODEL


@pytest.mark.parametrize(
    ("state", "value", "says"),
    [("u", 1100.0, "below Mach 4"), ("u", 7500.0, "above Mach 24"), ("theta", 1.56, "pitch bey")],
)
def test_a_flight_beyond_the_data_is_no_success_and_says_where_and_since_when(state, value, says):
    record = record_of(fly(load_case("nominal_di", {"duration": 1.0})), False)
    assert outside_the_model(record) == {}
    states = np.array(record.states)
    states[40:, State._fields.index(state)] = value
    if state == "u":
        states[40:, State._fields.index("w")] = 0.05 * value  # alpha as it was
    summary = summarize(replace(record, states=states), "")
    ((what, since),) = summary["outside_the_model"].items()
    assert what.startswith(says) and since == 0.4
    assert not summary["success"] and summary["cause"] == "outside_the_model"


@pytest.mark.parametrize(
    ("node", "name", "value", "says"),
    [
        ("velocity", "speed", 1000.0, "valid from Mach 4 to 24: 1191 to 7147 m/s at 24000 m"),
        ("outer_intermediate", "altitude", 47_900.0, "valid from 0 to 47000 m"),
    ],
)
def test_a_command_beyond_the_model_is_refused(node, name, value, says):
    given = load_case("nominal_di").parameters
    with pytest.raises(ParameterError, match=says) as caught:
        make_case("far", given | {node: given[node] | {name: value}})
    assert "commanded" in str(caught.value)
