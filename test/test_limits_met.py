# Copyright 2026 ahv developers, Apache-2.0
"""What is limited in flight is counted by the node that limits it, and stands in the summary."""

import math

import pytest

from ahv_analysis.bag.info import bag_info
from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.flight import case as cases
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.report.limited import limited
from ahv_analysis.report.summary import summarize
from ahv_control.limits_met import limits_met
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.model.constants import RADIANS, STEP
from test.flights import CRUISE

TOO_MUCH = """
/**: {ros__parameters: {base: nominal_di, guided: true}}
/**/plant: {ros__parameters: {duration: 4.0}}
/**/outer_intermediate: {ros__parameters: {climb_limit: 0.3}}
/**/guidance:
  ros__parameters:
    altitude_changes: '29000 at 1'
    heading_changes: '0.9 at 2 over 6'
    shape: ramp
    speed_changes: '1900 at 3'
    bank_limit: 26.0
"""


@pytest.mark.unit
def test_a_limit_is_met_where_the_command_stands_at_it():
    alpha = math.atan2(CRUISE.w, CRUISE.u)
    for climb, held, found in (
        (0.5, 90.0, (False, False)),
        (1.0, 90.0, (True, False)),
        (-1.0, 90.0, (True, False)),
        (0.5, 3.4, (False, True)),
    ):
        limits = 1.0 * RADIANS, held * RADIANS
        climb_angle = CRUISE.theta - alpha
        pitch = alpha + climb * RADIANS if held == 90.0 else climb_angle + held * RADIANS
        assert tuple(map(bool, limits_met(CRUISE, pitch, *limits))) == found, climb


def test_who_limits_what_is_asked_for_counts_it_and_the_summary_has_its_time(
    tmp_path, domain, monkeypatch
):
    """A profile that is refused before a flight, flown all the same."""
    file = tmp_path / "too_much.yaml"
    file.write_text(TOO_MUCH)
    with pytest.raises(ParameterError, match=r"at 1 s: no vehicle .* 29000 m .*alpha above 5 deg"):
        load_case(str(file))
    monkeypatch.setattr(cases, "check_reach", lambda *anything: None)
    case = load_case(str(file))
    totals = {}
    monkeypatch.setattr(
        BaseNode,
        "log_end",
        lambda node, stamp: totals.update({node.get_name(): dict(node.health.total)}),
    )
    fly_graph(case, tmp_path / "bag", domain=domain)
    counts = {
        fault.name.lower(): count
        for name in ("guidance", "outer_intermediate")
        for fault, count in totals[name].items()
    }
    assert counts["climb_limited"] == 301, "from 1 s on: 5 km are 50 m/s, a climb of 1.6 deg"
    assert counts["bank_limited"] == 101, "from 3 s on: 0.15 deg/s take 26.9 deg at 1900 m/s"
    assert counts["out_of_reach"] == 4, "looked for at 1, 2, 3 and 4 s"
    told = bag_info(tmp_path / "bag")["faults"]
    assert told["guidance"] | told["outer_intermediate"] == counts
    record = read_bag(tmp_path / "bag")
    found = summarize(record, "", control=case.control)["limited_s"]
    assert found == pytest.approx({"climb_limit": 3.01, "bank_limit": 1.01, "reach": 4.0})


def test_a_flight_within_its_limits_has_none_and_a_protected_one_its_angle_of_attack():
    case = load_case("nominal_di", {"duration": 1.0})
    assert limited(record_of(fly(case), False), case.control) == {}
    outer = case.control.outer._replace(alpha_limit=0.1 * RADIANS)
    control = case.control._replace(outer=outer)
    held = record_of(fly(case._replace(control=control)), False)
    assert limited(held, control) == pytest.approx({"alpha_limit": 101 * STEP})
