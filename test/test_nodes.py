# Copyright 2026 ahv developers, Apache-2.0
"""Nodes are managed by the standard lifecycle, and changed in flight at the border of a step."""

import gc
import math
from functools import partial

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParametersAtomically

from ahv_analysis.flight.case import case_names, load_case
from ahv_msgs_py.config import config_folder
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.quality import SENDER_DEPTH
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.parameters import ParameterError
from ahv_msgs_py.topics import CLOCK, DIAGNOSTICS, LOOP_TOPICS, ODOMETRY, STATE
from test.documents import ROOT
from test.waiting import PATIENCE, wait_until

CASE = load_case("neuro_adaptive_di", {"duration": 20.0})


class Graph:
    """Nodes of the adaptive case in a domain of their own, with a client beside them."""

    def __init__(self, domain, *names, **values):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.executor = EventsExecutor(context=self.context)
        self.client = rclpy.create_node("client", context=self.context)
        given = CASE.parameters | {"recorder": {}}
        self.nodes = {
            name: NODES[name].node_class(given[name] | values.get(name, {}), self.context)
            for name in names
        }
        for node in (*self.nodes.values(), self.client):
            self.executor.add_node(node)
        self.heard = {topic.name: 0 for topic in LOOP_TOPICS}

    def listen(self):
        for topic in LOOP_TOPICS:
            self.client.create_subscription(
                message_class(topic.layout.type_name),
                topic.name,
                partial(self._count, topic.name),
                next(iter(self.nodes.values())).loop_quality(),
                raw=True,
            )

    def _count(self, name, data):
        self.heard[name] += 1

    def ask(self, service_type, service, request):
        client = self.client.create_client(service_type, service)
        look = partial(self.executor.spin_once, 0.01)
        wait_until(client.service_is_ready, f"{service} is known", look)
        answer = client.call_async(request)
        self.executor.spin_until_future_complete(answer, PATIENCE)
        assert answer.done(), f"{service} has not answered for {PATIENCE:g} s"
        return answer.result()

    def change(self, name, transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        return self.ask(ChangeState, f"/ahv/{name}/change_state", request).success

    def state(self, name):
        return self.ask(GetState, f"/ahv/{name}/get_state", GetState.Request()).current_state.label

    def set(self, name, **values):
        types = {bool: ("bool", 1), int: ("integer", 2), float: ("double", 3), str: ("string", 4)}
        parameters = []
        for key, value in values.items():
            kind, number = types[type(value)]
            held = ParameterValue(type=number, **{f"{kind}_value": value})
            parameters.append(ParameterMessage(name=key.replace("__", "."), value=held))
        assert ParameterType.PARAMETER_DOUBLE == 3
        request = SetParametersAtomically.Request(parameters=parameters)
        service = f"/ahv/{name}/set_parameters_atomically"
        return self.ask(SetParametersAtomically, service, request).result

    def close(self):
        for node in (*self.nodes.values(), self.client):
            self.executor.remove_node(node)
        self.executor.shutdown()
        for node in (*self.nodes.values(), self.client):
            node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def graph(domain):
    graphs = []

    def make(*names, **values):
        graphs.append(Graph(domain, *names, **values))
        return graphs[-1]

    yield make
    for one in graphs:
        one.close()


@pytest.fixture
def collecting():
    """Garbage is collected again, which a node in real time does by itself."""
    yield
    gc.unfreeze()
    gc.enable()


@pytest.mark.usefixtures("collecting")
def test_in_real_time_what_a_publisher_keeps_has_an_end(graph):
    """Memory that grows in flight is asked for in flight."""
    plant = graph("plant", plant={"realtime": True}).nodes["plant"]
    plant.bring_up()
    depths = {one.topic_name: one.qos_profile.depth for one in plant.publishers}
    assert {STATE.name, CLOCK.name, ODOMETRY.name, DIAGNOSTICS.name} < depths.keys()
    assert max(depths.values()) == SENDER_DEPTH


@pytest.mark.parametrize("name", NODES)
def test_every_node_lives_by_the_standard_lifecycle(name, graph, tmp_path):
    law = {"law": str(ROOT / "examples" / "my_law" / "my_lqr.py")}
    flown = graph(name, recorder={"bag": str(tmp_path / "bag")}, flight_control=law)
    steps = [
        (Transition.TRANSITION_CONFIGURE, "inactive"),
        (Transition.TRANSITION_ACTIVATE, "active"),
        (Transition.TRANSITION_DEACTIVATE, "inactive"),
        (Transition.TRANSITION_ACTIVATE, "active"),
        (Transition.TRANSITION_DEACTIVATE, "inactive"),
        (Transition.TRANSITION_CLEANUP, "unconfigured"),
        (Transition.TRANSITION_UNCONFIGURED_SHUTDOWN, "finalized"),
    ]
    assert flown.state(name) == "unconfigured"
    for transition, label in steps:
        assert flown.change(name, transition)
        assert flown.state(name) == label
    assert flown.nodes[name].finished.done()


def test_an_impossible_transition_is_refused_and_changes_nothing(graph):
    flown = graph("velocity")
    assert not flown.change("velocity", Transition.TRANSITION_ACTIVATE)
    assert flown.state("velocity") == "unconfigured"
    assert flown.change("velocity", Transition.TRANSITION_CONFIGURE)
    assert not flown.change("velocity", Transition.TRANSITION_CONFIGURE)
    assert flown.state("velocity") == "inactive"


def test_a_topic_that_no_node_sends_is_named_and_not_waited_for_in_silence(graph):
    """Surfaces that are to be measured, of a plant on which nobody measures them."""
    flown = graph(
        *CASE.controllers,
        "plant",
        plant={"listeners": 4},
        disturbance_learner={"observer_surfaces": "measured"},
    )
    told = []
    flown.client.create_subscription(
        DiagnosticArray,
        DIAGNOSTICS.name,
        lambda message: told.extend(status.message for status in message.status),
        flown.nodes["plant"].loop_quality(),
    )
    for node in flown.nodes.values():
        node.bring_up()
    look = partial(flown.executor.spin_once, 0.01)
    wait_until(lambda: any("not sent" in text for text in told), "it is told", look)
    found = {text for text in told if "not sent" in text}
    assert len(found) == 1
    (sentence,) = found
    assert sentence.startswith("input not sent: /ahv/surfaces is waited for, and no node sends it")
    assert "hardware is not ideal" in sentence and "observer_surfaces" in sentence
    assert flown.nodes["disturbance_learner"].health.total[Fault.INPUT_NOT_SENT] == 1
    assert flown.nodes["plant"].step == 1


def test_an_inactive_node_does_not_answer(graph):
    flown = graph(*CASE.controllers, "plant", plant={"listeners": 5})
    flown.listen()
    for node in flown.nodes.values():
        node.trigger_configure()
    for _ in range(20):
        flown.executor.spin_once(0.01)
    assert not any(flown.heard.values())
    for node in flown.nodes.values():
        node.trigger_activate()
    flown.executor.spin_until_future_complete(flown.nodes["plant"].finished, PATIENCE)
    assert flown.nodes["plant"].step == 2000


@pytest.mark.parametrize(
    "name, values, words",
    [
        ("velocity", {"k_u": -1.0}, "k_u is -1.0"),
        ("velocity", {"speed": math.nan}, "speed is nan"),
        ("inner_loop", {"k_Q": "fast"}, "k_Q is 'fast'"),
        ("disturbance_learner", {"k_b": 0.0}, "k_b is 0.0"),
        ("outer_intermediate", {"altidude": 1.0}, "altidude"),
        ("plant", {"initial.h": 48000.0}, "initial altitude"),
        ("recorder", {"on_error": "cry"}, "on_error is 'cry'"),
        ("plant", {"use_sim_time": True}, "use_sim_time is True"),
    ],
)
def test_bad_parameters_fail_in_configure_in_one_sentence(name, values, words, graph):
    flown = graph(name, **{name: values})
    assert not flown.change(name, Transition.TRANSITION_CONFIGURE)
    assert flown.state(name) == "unconfigured"
    refusal = flown.nodes[name].refusal
    assert words in refusal and "\n" not in refusal
    with pytest.raises(ParameterError):
        flown.nodes[name].bring_up()


@pytest.mark.parametrize(
    "name, values",
    [
        ("velocity", {"k_u": -0.1}),
        ("velocity", {"k_u": math.nan}),
        ("velocity", {"k_u": "much"}),
        ("velocity", {"k_u": 0.2, "speed": math.inf}),
        ("velocity", {"geometric_altitude": True}),
        ("inner_loop", {"adaptive": False}),
        ("inner_loop", {"k_P": 1.0}),
        ("plant", {"initial__h": 20000.0}),
        ("plant", {"use_sim_time": True}),
        ("recorder", {"use_sim_time": True}),
    ],
)
def test_what_cannot_change_in_flight_is_refused_and_nothing_changes(
    name, values, graph, tmp_path
):
    flown = graph(name, recorder={"bag": str(tmp_path / "bag")})
    flown.nodes[name].bring_up()
    before = dict(flown.nodes[name].settings)
    result = flown.set(name, **values)
    assert not result.successful
    assert result.reason
    assert not flown.nodes[name].get_clock().ros_time_is_active
    assert flown.nodes[name].settings == before


def test_a_change_in_flight_is_in_force_from_a_step_on_and_announced(graph):
    flown = graph("outer_intermediate")
    node = flown.nodes["outer_intermediate"]
    node.bring_up()
    said = []
    node.announce = lambda stamp, level, text, **facts: said.append((stamp, text, facts))
    assert flown.set("outer_intermediate", altitude=25000.0, k_h=0.02).successful
    assert said == []
    put = node.join(("state",), lambda stamp, state: None, {})
    put("state", 70_000_000, ())
    put("state", 80_000_000, ())
    assert said == [(70_000_000, "parameters changed", {"altitude": 25000.0, "k_h": 0.02})]
    assert (node._outer.altitude, node._outer.k_h) == (25000.0, 0.02)


@pytest.mark.parametrize("name", case_names())
def test_a_node_takes_from_a_case_file_what_ahv_fly_takes(name, domain):
    """Also where the file names a base and says only what differs."""
    file = config_folder() / "cases" / f"{name}.yaml"
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--params-file", str(file)], context=context, domain_id=domain)
    case = load_case(name)
    for node in ("plant", *case.controllers):
        made = NODES[node].node_class(context=context)
        settings = {known: made.settings[known] for known in case.parameters[node]}
        made.destroy_node()
        assert settings == case.parameters[node], node
    rclpy.shutdown(context=context)
