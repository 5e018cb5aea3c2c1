# Copyright 2026 ahv developers, Apache-2.0
"""One rule decides what is a success: alone, recorded, or as a run of a campaign."""

import pytest

from ahv_analysis.bag.record import record
from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly, fly_library
from ahv_analysis.flight.outcome import Cause
from ahv_analysis.report.page_flight import read_flights
from ahv_analysis.report.summary import summarize

SHORT = {"duration": 2.0}


def verdicts(case):
    """What a campaign makes of a case, and what the summary of its flight does."""
    steps = list(fly(case))
    found = summarize(record(steps, False), steps[-1].ended_early, case.control)
    alone = fly_alone(case.plant.initial, case.plant.truth, case.control, case.plant.steps)
    assert found["success"] == (found["cause"] == "success")
    return Cause(int(alone.cause)).name.lower(), found["cause"]


@pytest.mark.parametrize("name", ["nominal_di", "neuro_adaptive_sc_gdi"])
@pytest.mark.parametrize(
    "change, cause",
    [
        ({}, "success"),
        ({"w": 200.0}, "inlet_unstart"),
        ({"h": 60000.0}, "left_the_atmosphere_model"),
        ({"u": 1.0, "w": 0.0}, "surfaces_lost_the_vehicle"),
    ],
)
def test_a_flight_has_the_verdict_of_its_run_in_a_campaign(name, change, cause):
    case = load_case(name, SHORT)
    start = case.plant.initial._replace(**change)
    case = case._replace(plant=case.plant._replace(initial=start))
    assert verdicts(case) == (cause, cause)


def test_a_flight_that_leaves_the_model_later_has_that_verdict_too():
    """The state that ends it is not in its record."""
    case = load_case("nominal_di", SHORT)
    dive = case.plant.initial._replace(h=20.0, u=1500.0, w=0.0, theta=-0.35)
    case = case._replace(plant=case.plant._replace(initial=dive))
    assert len(list(fly(case))) > 1
    assert verdicts(case) == ("left_the_atmosphere_model", "left_the_atmosphere_model")


def test_a_report_says_that_the_surfaces_lost_a_vehicle(tmp_path):
    case = load_case("nominal_di", SHORT)
    slow = case.plant.initial._replace(u=1.0, w=0.0)
    fly_library(case._replace(plant=case.plant._replace(initial=slow)), tmp_path / "bag")
    (flight,) = read_flights([tmp_path / "bag"])
    assert flight.verdict.word == "failure"
    assert "the surfaces lost the vehicle" in flight.verdict.reason
