# Copyright 2026 ahv developers, Apache-2.0
"""The reference is changed in flight, by whoever may, and what cannot be flown is refused."""

import math
import threading
from functools import partial

import numpy as np
import pytest
import rclpy
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.replay.inputs import read_recording
from ahv_analysis.replay.replay import replay
from ahv_control.guidance_node import GuidanceNode
from ahv_control.guidance_parameters import GUIDANCE_PARAMETERS, plan
from ahv_control.guided_flight import next_followed, start_followed
from ahv_control.reach import check_change, check_reach, why_not_followed
from ahv_control.steady_turn import steady_turn
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.parameters import ParameterError, check_parameters
from ahv_msgs_py.topics import REFERENCE, SELECTION
from ahv_plant.dispersion import NOMINAL
from ahv_plant.model.constants import DEGREES, GRAVITY, RADIANS, STEP, STEP_NS
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.trim import trim
from ahv_plant.vehicle import state_rate
from test.flights import CRUISE
from test.waiting import PATIENCE, wait_until

MASS = CRUISE.mass


def planned(**values):
    """Plan of these parameters; the others are as by default."""
    return plan(check_parameters("guidance", GUIDANCE_PARAMETERS, values))


def flown_by(plans, steps, state=CRUISE):
    """References of a guidance of which the plan is that of `plans` from each of its steps on."""
    now, references = start_followed(state, 0, plans[0]), []
    for number in range(steps):
        current = plans[max(at for at in plans if at <= number)]
        if number:
            now = next_followed(now, state, number, current)
        references.append(now.last)
    return np.array(references)


@pytest.mark.unit
def test_a_selection_is_led_to_within_the_limits_and_the_rest_stays():
    flown = flown_by({0: planned(), 100: planned(selected="h 24300 psi -3")}, 6000)
    altitude, speed, psi = flown[:, 0], flown[:, 1], flown[:, 3] * DEGREES
    assert (altitude[99], speed[-1]) == (24000.0, 1786.4)
    assert altitude[-1] == pytest.approx(24300.0, abs=2.0)
    assert psi[-1] == pytest.approx(-3.0, abs=0.05)
    assert np.max(np.abs(np.diff(altitude))) / STEP == pytest.approx(15.0, abs=0.1)
    assert np.max(np.abs(np.diff(psi))) / STEP <= 0.15 + 1e-9


@pytest.mark.unit
def test_what_is_selected_later_leaves_what_was_selected_before():
    plans = {0: planned(), 10: planned(selected="h 24050"), 20: planned(selected="u 1790")}
    altitude, speed = flown_by(plans, 6000)[-1, :2]
    assert (altitude, speed) == (pytest.approx(24050.0, abs=1.0), pytest.approx(1790.0, abs=0.1))


@pytest.mark.unit
def test_a_heading_is_turned_to_by_the_shorter_way():
    psi = flown_by({0: planned(), 1: planned(selected="psi 355")}, 8000)[-1, 3] * DEGREES
    assert psi == pytest.approx(-5.0, abs=0.1)


@pytest.mark.unit
def test_a_flight_that_resumes_its_route_does_so_from_where_its_reference_is():
    mission = planned(waypoints="x 100e3 y 0 h 24500 u 1786.4")
    selected = planned(waypoints="x 100e3 y 0 h 24500 u 1786.4", selected="h 23900 psi 4")
    flown = flown_by({0: mission, 500: selected, 3000: mission}, 6000)
    assert flown[2999, 0] < 24000.0 < flown[-1, 0]
    assert np.max(np.abs(np.diff(flown[:, 0]))) <= 15.0 * STEP + 1e-6
    assert np.max(np.abs(np.diff(flown[:, 3]))) * DEGREES <= 0.15 * STEP + 1e-9


@pytest.mark.unit
def test_a_guidance_that_starts_again_in_a_turn_goes_on_to_climb_and_turn_as_the_vehicle_does():
    """By the rates of heading and altitude that the equations of motion give."""
    phi, theta = 20.0 * RADIANS, 3.2 * RADIANS
    turning = CRUISE._replace(phi=phi, theta=theta, Q=0.0005, R=0.0015)
    rate = state_rate(turning, Surfaces(0.0, 0.0, 0.0), 0.5, 0.0, NOMINAL)
    mission = planned(waypoints="x 100e3 y 0 h 24500 u 1786.4", feed_forward=True)
    started = start_followed(turning, 9000, mission).last
    assert started.psi_rate == pytest.approx(rate.psi, abs=1e-12)
    assert started.altitude_rate == pytest.approx(rate.h, abs=1e-9)
    assert 0.0 < rate.psi < 0.15 * RADIANS and 0.0 < rate.h < 15.0, "within the limits"
    faster = start_followed(turning._replace(R=0.1, theta=0.1), 9000, mission).last
    assert faster.psi_rate == pytest.approx(0.15 * RADIANS)
    assert faster.altitude_rate == pytest.approx(15.0)


@pytest.mark.unit
@pytest.mark.parametrize("bank", [0.0, 20.0, 45.0])
def test_a_steady_turn_is_one_of_the_vehicle_that_flies(bank):
    """By the equations of motion of the plant, which know nothing of steady turns."""
    phi = bank * RADIANS
    found = steady_turn(24000.0, 1786.4, MASS, phi, False)
    level = trim(24000.0, 1786.4, MASS)
    assert (found.alpha > level.alpha + 0.002) == (bank > 0.0)
    if not bank:
        assert found.alpha == pytest.approx(level.alpha, abs=1e-12)
        assert found.throttle == pytest.approx(level.throttle, abs=1e-9)
    theta = math.atan(math.tan(found.alpha) * math.cos(phi))
    turn = GRAVITY * math.tan(phi) / 1786.4  # nearly: w is not zero
    rates = (
        -turn * math.sin(theta),
        turn * math.sin(phi) * math.cos(theta),
        turn * math.cos(phi) * math.cos(theta),
    )
    w = 1786.4 * math.tan(found.alpha)
    state = State(1786.4, 0.0, w, *rates, phi, theta, 0.0, 0.0, 0.0, 24000.0, MASS)
    surfaces = Surfaces(found.elevon, found.elevon, 0.0)
    rate = state_rate(state, surfaces, found.throttle, 0.0, NOMINAL)
    assert [rate.u, rate.v, rate.w, rate.h] == pytest.approx([0.0] * 4, abs=0.05)
    assert [rate.Q, rate.theta, rate.phi] == pytest.approx([0.0] * 3, abs=1e-4)
    assert rate.psi == pytest.approx(turn, rel=5e-3)


@pytest.mark.unit
@pytest.mark.parametrize(
    "values, words",
    [
        ({"selected": "h 60000"}, ("selected", "60000 m", "atmosphere")),
        ({"selected": "h 35000"}, ("selected", "35000 m", "alpha above 5 deg")),
        ({"selected": "u 900"}, ("selected", "900 m/s", "Mach 4")),
        ({"selected": "h nan"}, ("selected", "h nan", "h 25000 u 1800 psi 10")),
        ({"selected": "climb 3"}, ("selected", "climb 3")),
        ({"selected": "h 24e3 h 25e3"}, ("selected", "h 24e3 h 25e3")),
        ({"selected": "psi 1e9"}, ("psi", "3600 deg")),
        ({"selected": "psi 90", "turn_rate": 0.5}, ("0.5 deg/s", "bank_limit is 45 deg")),
        ({"selected": "h 27000 psi 90", "turn_rate": 0.3}, ("0.3 deg/s", "alpha above 5 deg")),
        ({"waypoints": "x 1e5 y 0 h 40000 u 1800"}, ("waypoint 1", "40000 m")),
        ({"altitude_changes": "35000 at 100"}, ("at 100 s", "alpha above 5 deg")),
    ],
)
def test_a_change_that_leads_where_nobody_can_follow_is_refused(values, words):
    now = start_followed(CRUISE, 0, planned())
    with pytest.raises(ParameterError) as refused:
        check_change(planned(**values), now, CRUISE, 5000)
    assert all(word in str(refused.value) for word in words) and "\n" not in str(refused.value)


@pytest.mark.unit
def test_a_turn_that_takes_more_angle_of_attack_than_there_is_is_refused_before_the_flight():
    """The same turn is flown where the air is thicker, and by sideslip."""
    turn = {"heading_changes": "30 at 10 over 100", "shape": "ramp"}
    check_reach(planned(altitude=24000.0, **turn).guidance, MASS, False)
    check_reach(planned(altitude=26500.0, coordinated=False, **turn).guidance, MASS, False)
    with pytest.raises(ParameterError, match=r"bank of [\d.]+ deg.*alpha above 5 deg"):
        check_reach(planned(altitude=26500.0, **turn).guidance, MASS, False)


@pytest.mark.unit
def test_a_reference_beyond_the_vehicle_is_told_of_with_the_limit_that_it_passes():
    reference = start_followed(CRUISE, 0, planned()).last
    assert why_not_followed(reference, MASS, False) == ""
    why = why_not_followed(reference._replace(altitude=29000.0), MASS, False)
    assert "alpha above 5 deg" in why and "29000 m" in why
    assert "Mach" in why_not_followed(reference._replace(speed=1000.0), MASS, False)


class Operator:
    """Somebody who changes the reference of a flight by what any ROS tool has."""

    def __init__(self, domain):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("operator", context=self.context)
        service = "/ahv/guidance/set_parameters_atomically"
        self.setter = self.node.create_client(SetParametersAtomically, service)
        self.services = {
            name: self.node.create_client(Trigger, f"/ahv/guidance/{name}")
            for name in ("hold", "resume")
        }
        self.publisher = self.node.create_publisher(JointState, SELECTION.name, 10)
        self.answers = []
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.over = Future(executor=None)
        spin = partial(self.executor.spin_until_future_complete, self.over)
        self.thread = threading.Thread(target=spin, daemon=True)
        self.thread.start()

    def ready(self):
        clients = (self.setter, *self.services.values())
        known = all(client.service_is_ready() for client in clients)
        return known and self.publisher.get_subscription_count() > 0

    def set(self, **values):
        parameters = []
        for name, value in values.items():
            if isinstance(value, str):
                held = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)
            else:
                held = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
            parameters.append(ParameterMessage(name=name, value=held))
        request = SetParametersAtomically.Request(parameters=parameters)
        self.answers.append(self.setter.call_async(request))

    def call(self, name):
        self.answers.append(self.services[name].call_async(Trigger.Request()))

    def publish(self, **values):
        names, positions = list(values), list(map(float, values.values()))
        self.publisher.publish(JointState(name=names, position=positions))

    def close(self):
        self.over.set_result(None)
        self.executor.wake()
        self.thread.join(PATIENCE)
        rclpy.shutdown(context=self.context)


@pytest.fixture
def operator(domain):
    made = Operator(domain)
    yield made
    made.close()


@pytest.mark.parametrize("realtime, every", [(False, 1.5), (True, 0.5)])
def test_a_flight_that_is_changed_on_its_way_is_replayed_without_a_difference(
    tmp_path, domain, operator, monkeypatch, realtime, every
):
    acts = [
        lambda: operator.publish(altitude=24100.0, psi=0.01),
        lambda: operator.set(selected="h 60000"),
        lambda: operator.set(climb_rate=math.nan),
        lambda: operator.set(climb_rate=10.0, build_up=5.0),
        lambda: operator.publish(altitude=math.nan),
        lambda: operator.publish(bank=0.1),
        lambda: operator.set(bearing=0.1),
        lambda: operator.call("hold"),
        lambda: operator.set(altitude_changes="", waypoints="x 300e3 y 10e3 h 24200 u 1790"),
        lambda: operator.call("resume"),
    ]
    due = {round((place + 1) * every / STEP): act for place, act in enumerate(acts)}
    answer, nodes = GuidanceNode._answer, []

    def answered(self, stamp, values):
        if not nodes:
            wait_until(operator.ready, "the operator knows guidance, and is known to it")
            nodes.append(self)
        answer(self, stamp, values)
        act = due.pop(round(stamp * 1e-9 / STEP), None)
        if act:
            act()

    with monkeypatch.context() as flight:
        flight.setattr(GuidanceNode, "_answer", answered)
        duration = every * (len(acts) + 2)
        case = load_case("neuro_adaptive_sc_gdi", {"duration": duration}, profile="altitude_step")
        ended = fly_graph(case, tmp_path / "bag", domain=domain, realtime=realtime)
    assert ended[0] == ""
    results = [one.result() for one in operator.answers]
    verdicts = [one.result for one in results if hasattr(one, "result")]
    assert [verdict.successful for verdict in verdicts] == [False, False, True, False, True]
    assert verdicts[0].reason.startswith("guidance: selected: altitude 60000 m is outside")
    assert "nan" in verdicts[1].reason and "bearing" in verdicts[3].reason
    assert all(one.success for one in results if isinstance(one, Trigger.Response))
    assert nodes[0].health.total[Fault.CHANGE_REFUSED] == 5
    recording = read_recording(tmp_path / "bag")
    changed = [set(change.values) for change in recording.changes]
    limits, selected = {"climb_rate", "build_up"}, {"selected"}
    assert changed == [selected, limits, selected, {"altitude_changes", "waypoints"}, selected]
    references = read_bag(tmp_path / "bag").references
    assert references[-1, 0] > 24000.0 and references[-1, 3] > 0.0
    again = replay(recording, case, case.controllers)
    first = {entry.node: entry.first for entry in again.comparisons if entry.differences}
    if realtime:  # what others missed, and what guidance did from a state on that it missed
        answered = recording.topics[REFERENCE].stamps
        whole = np.flatnonzero(np.diff(answered) > STEP_NS)
        first = {name: one for name, one in first.items() if name == "guidance"}
        if len(whole):
            assert not first or first["guidance"].stamp > answered[whole[0]]
            return
    assert first == {}
