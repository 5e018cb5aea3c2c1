# Copyright 2026 ahv developers, Apache-2.0
"""What a flight leaves on the console: its end by every node, faults at their level, throttled."""

import subprocess
import sys
from functools import partial

import pytest
import rclpy
from rcl_interfaces.msg import Log

from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.process_per_node import fly_processes
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.topics import FLIGHT
from test.waiting import PATIENCE, wait_until

CASE = load_case("neuro_adaptive_di", {"duration": 20.0})
LISTENERS = {"recorder", *CASE.controllers}


@pytest.fixture
def said(tmp_path, domain, monkeypatch):
    """What every node logged of a flight in lockstep, whose end a stranger told 30 times."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    keep_to_this_machine(shared_memory=True)
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    stranger = rclpy.create_node("stranger", context=context)
    executor = EventsExecutor(context=context)
    executor.add_node(stranger)
    found, told = [], []
    stranger.create_subscription(Log, "/rosout", found.append, quality(True))
    end = stranger.create_publisher(
        message_class(FLIGHT.layout.type_name), FLIGHT.name, quality(True)
    )

    def look(step):
        executor.spin_once(0.1)
        if step > 50 and not told and end.get_subscription_count() == len(LISTENERS):
            told.extend(FLIGHT.layout.encode(stamp, (2000, 7, 1)) for stamp in range(30))
            for message in told:
                end.publish(message)

    fly_processes(CASE, tmp_path / "bag", progress=look)
    assert told, "the flight was over before the stranger knew its nodes"
    wait_until(  # the log comes behind what it tells of
        lambda: sum("flight over" in one.msg for one in found) > len(LISTENERS),
        "every node has logged the end",
        partial(executor.spin_once, 0.1),
    )
    executor.remove_node(stranger)
    executor.shutdown()
    stranger.destroy_node()
    rclpy.shutdown(context=context)
    return {
        name: [(one.level, one.msg) for one in found if one.name == f"ahv.{name}"]
        for name in (*LISTENERS, "plant")
    }


def test_every_node_logs_transitions_a_fault_once_at_its_level_and_the_end(said):
    assert said.pop("plant") == [
        (Log.INFO, "configured"),
        (Log.INFO, "active"),
        (Log.INFO, "flight over after 2000 steps: flown to its end"),
    ]
    for name, lines in said.items():
        *transitions, fault, end = lines
        assert transitions == [(Log.INFO, "configured"), (Log.INFO, "active")], name
        assert fault[0] == Log.ERROR, name
        assert fault[1].startswith("second publisher at ")
        assert fault[1].endswith(" s: /ahv/flight: not by the plant")
        assert end == (Log.INFO, "flight over at 20.01 s; faults: second publisher 30"), name


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
        [sys.executable, "-c", KILLED_IN_FLIGHT], capture_output=True, text=True, timeout=PATIENCE
    )
    assert flown.returncode == 0, flown.stderr
    said = [line.split("[", 1)[1] for line in flown.stderr.splitlines() if "ahv.plant" in line]
    # of a kind one in five seconds: on a busy machine another command may have been late before
    assert any(line.startswith("WARN") and "late at" in line for line in said), said
    assert any(line.startswith("ERROR") and "command lost at" in line for line in said), said
