# Copyright 2026 ahv developers, Apache-2.0
"""What a flight leaves on the console: its end by every node, faults at their level, throttled."""

import subprocess
import sys
import time

import pytest
from rcl_interfaces.msg import Log

from ahv_analysis.flight.case import load_case
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.topics import FLIGHT, STATE
from test.test_nodes import graph  # noqa: F401  nodes and a client

LISTENERS = ["recorder", *load_case("neuro_adaptive_di").controllers]


@pytest.fixture
def said(graph, tmp_path):  # noqa: F811
    """What every node logged of a flight in lockstep, in which somebody spoke wrongly 30 times."""
    recorder = {"bag": str(tmp_path / "bag")}
    flown = graph(*LISTENERS, "plant", recorder=recorder, plant={"listeners": 6})
    found = []
    client = flown.client
    client.create_subscription(Log, "/rosout", found.append, quality(True))
    wrong = client.create_publisher(
        message_class(FLIGHT.layout.type_name), FLIGHT.name, quality(True)
    )
    states = []

    def speak(data):
        if not states:
            for _ in range(30):
                wrong.publish(FLIGHT.layout.encode(0, (1.0, float("nan"), 0.0)))
        states.append(data)

    state_type = message_class(STATE.layout.type_name)
    client.create_subscription(state_type, STATE.name, speak, quality(True), raw=True)
    for node in flown.nodes.values():
        node.bring_up()
    flown.executor.spin_until_future_complete(flown.nodes["recorder"].finished, 30.0)
    until = time.monotonic() + 10.0  # the log comes behind what it tells of
    while sum("flight over" in one.msg for one in found) <= len(LISTENERS):
        assert time.monotonic() < until, [one.msg for one in found]
        flown.executor.spin_once(0.01)
    return {
        name: [(one.level, one.msg) for one in found if one.name == f"ahv.{name}"]
        for name in flown.nodes
    }


def test_every_node_logs_transitions_a_fault_once_at_its_level_and_the_end(said):
    info, warn = Log.INFO, Log.WARN
    assert said.pop("plant") == [
        (info, "configured"),
        (info, "active"),
        (info, "flight over after 2000 steps: flown to its end"),
    ]
    assert set(said) == set(LISTENERS)
    for name, lines in said.items():
        assert lines == [
            (info, "configured"),
            (info, "active"),
            (warn, "not finite at 0 s: /ahv/flight: steps is nan"),
            (info, "flight over at 20.01 s; faults: not finite 30"),
        ], name


KILLED_IN_FLIGHT = """
import multiprocessing
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.process_per_node import fly_processes

killed = []

def kill(step):
    if step > 100 and not killed:
        (velocity,) = [one for one in multiprocessing.active_children() if one.name == "velocity"]
        killed.append(velocity.kill())

fly_processes(load_case("nominal_di", {"duration": 4.0}), None, realtime=True, progress=kill)
assert killed
"""


def test_a_killed_controller_leaves_a_word_on_the_console(domain, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    flown = subprocess.run(
        [sys.executable, "-c", KILLED_IN_FLIGHT], capture_output=True, text=True, timeout=100
    )
    assert flown.returncode == 0, flown.stderr
    said = [line.split("[", 1)[1] for line in flown.stderr.splitlines() if "ahv.plant" in line]
    assert any("late at" in line and "/ahv/throttle_command" in line for line in said), said
    assert any(line.startswith("ERROR") and "command lost at" in line for line in said), said
