# Copyright 2026 ahv developers, Apache-2.0
"""One rule decides what is a success: alone, recorded, or as a run of a campaign."""

import pytest

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.bag.solver_status import losses_in, lost_status
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly, fly_library, write_step
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.flight.outcome import Cause
from ahv_analysis.report.page_flight import read_flights
from ahv_analysis.report.summary import summarize
from ahv_control.newton_raphson import SolverStatus
from ahv_msgs_py.topics import NAMESPACE

SHORT = {"duration": 2.0}


def verdicts(case):
    """What a campaign makes of a case, and what the summary of its flight does."""
    steps = list(fly(case))
    found = summarize(record_of(steps, False), steps[-1].ended_early)
    alone = fly_alone(case)
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


def test_graph_and_library_tell_alike_of_surfaces_that_were_lost(tmp_path):
    """At the same step: here after the angle of attack has left its bound."""
    case = load_case("nominal_di", {"duration": 1.5, "dispersion.Cm": 0.05})
    statuses = [(step.stamp, step.commands.status) for step in fly(case)]
    lost_at = next(stamp for stamp, status in statuses if status == SolverStatus.SINGULAR)
    assert lost_at == 1_400_000_000
    for fly_case in (fly_graph, fly_library):
        bag = tmp_path / fly_case.__name__
        ended_early, _ = fly_case(case, bag)
        flown = read_bag(bag)
        assert flown.surfaces_lost_at == lost_at
        assert summarize(flown, ended_early)["cause"] == "inlet_unstart"


def test_another_inner_loop_is_not_judged_by_our_solver(tmp_path):
    """It has no trouble where ours would lose a vehicle that stands still: it is silent."""
    case = load_case("nominal_di", SHORT)
    slow = case.plant.initial._replace(u=1.0, w=0.0)
    case = case._replace(plant=case.plant._replace(initial=slow))
    first = next(fly(case))
    assert first.commands.status == SolverStatus.SINGULAR
    for status, cause in (
        (SolverStatus.SINGULAR, "surfaces_lost_the_vehicle"),
        (0, "outside_the_model"),
    ):
        bag = BagWriter(tmp_path / cause)
        write_step(bag, first._replace(commands=first.commands._replace(status=status)))
        bag.close()
        assert summarize(read_bag(tmp_path / cause), "")["cause"] == cause


def test_only_the_inner_loop_of_the_flight_is_believed():
    word = lost_status(0)
    ours = 1, word.replace(b"newton singular", b"all is healthy.")
    assert losses_in([(1, word)], NAMESPACE).surfaces == 0
    assert losses_in([(1, word)], "/another").surfaces is None, "another vehicle"
    assert losses_in([(1, word.replace(b"inner", b"outer"))], NAMESPACE).surfaces is None
    assert losses_in([ours, (2, word), ours], NAMESPACE).surfaces is None, "another publisher"
    assert losses_in([ours, (2, word)], NAMESPACE).surfaces == 0, "one that was started again"
    assert losses_in([(1, word[:20])], NAMESPACE).surfaces is None, "no message"
