# Copyright 2026 ahv developers, Apache-2.0
"""A mission in real time goes on where its nodes are killed and started again."""

import numpy as np
import pytest

from ahv_analysis.bag.reader import flight_of, read
from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.report.summary import summarize
from ahv_msgs_py.node.network import DISCOVERY_RANGE, PROFILES
from ahv_plant.model.vectors import State
from studies.mission import CASE, PROFILE, course, fly_mission, longest_silence, on_course
from test.flights import CRUISE


@pytest.mark.unit
def test_a_course_is_judged_by_its_waypoints_and_its_end():
    route = load_case(CASE, profile=PROFILE).control.guidance.route
    good = np.array([CRUISE._replace(x=250e3), CRUISE._replace(x=600e3, y=60e3)])
    for place, change, right in (
        (0, {"y": 15e3}, True),
        (0, {"y": 25e3}, False),
        (1, {"h": 23900.0}, False),
        (1, {"u": 1750.0}, False),
    ):
        flown = good.copy()
        flown[place] = State(*good[place])._replace(**change)
        assert on_course(course(flown, good, route), route) == right, change


@pytest.mark.slow
def test_a_mission_is_on_course_after_guidance_and_inner_loop_were_killed(
    tmp_path, monkeypatch, domain
):
    """The first minute of it; `python -m studies.mission` flies all ten."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv(DISCOVERY_RANGE, "LOCALHOST")
    monkeypatch.delenv(PROFILES, raising=False)
    case = load_case(CASE, {"duration": 60.0}, profile=PROFILE)
    undisturbed = record_of(fly(case), False)
    ended_early = fly_mission(case, tmp_path / "bag", {"guidance": 15.0, "inner_loop": 30.0})
    bag = read(tmp_path / "bag")
    flown = flight_of(bag)
    assert summarize(flown, ended_early)["success"]
    assert 0.0 < longest_silence(bag, "guidance") < 2.0
    assert flown.stamps[-1] == undisturbed.stamps[-1]
    route = case.control.guidance.route
    assert on_course(course(flown.states[:], undisturbed.states[:], route), route)
