# Copyright 2026 ahv developers, Apache-2.0
"""Whom the graph believes: not who speaks last, nor who has the name, but who was heard first."""

from contextlib import contextmanager
from functools import partial

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.executors import SingleThreadedExecutor

from ahv_analysis.bag.reader import load_bag
from ahv_analysis.bag.recorder_node import RecorderNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.node.subscription import Listener, gids
from ahv_msgs_py.topics import (
    DIAGNOSTICS,
    FLIGHT,
    FLOWN,
    FLYING,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
)
from ahv_plant.plant_node import PlantNode
from test.waiting import wait_until


@contextmanager
def stranger(domain):
    """A node that is none of the graph's."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("stranger", context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.mark.parametrize("executor_class", [EventsExecutor, SingleThreadedExecutor])
def test_every_message_comes_with_the_gid_of_its_publisher(executor_class, domain):
    """Of two with the same numbers too; and the graph knows them by the same names."""
    with stranger(domain) as node:
        message_type, heard = message_class(RATE_COMMAND.layout.type_name), []
        listener = Listener(
            node, message_type, "rates", quality(True), lambda data, gid: heard.append((data, gid))
        )
        executor = executor_class(context=node.context)
        executor.add_node(node)
        publishers = [node.create_publisher(message_type, "rates", quality(True)) for _ in "12"]
        sent = [RATE_COMMAND.layout.encode(0, (float(number), 0.0, 0.0)) for number in range(2)]
        for publisher, data in zip(publishers, sent, strict=True):
            publisher.publish(data)
        spin(executor, lambda: len(heard) == len(sent), "both messages have come")
        assert [data for data, _ in heard] == sent
        assert {gid for _, gid in heard} == {*gids(node, "/rates")}
        listener.close()
        executor.remove_node(node)
        executor.shutdown()


def test_a_plant_with_two_publishers_of_a_command_refuses_to_fly(domain):
    with stranger(domain) as node, stranger(domain) as other:
        plant = PlantNode({"listeners": 1}, other.context)
        plant.bring_up()
        executor = EventsExecutor(context=other.context)
        executor.add_node(plant)
        message_type = message_class(SURFACE_COMMAND.layout.type_name)
        for _ in range(2):
            node.create_publisher(message_type, SURFACE_COMMAND.name, quality(True))
        spin(
            executor,
            lambda: plant.count_publishers(SURFACE_COMMAND.name) == 2,
            "the plant knows both publishers",
        )
        node.create_subscription(
            message_class(STATE.layout.type_name), STATE.name, print, quality(True)
        )
        spin(executor, plant.finished.done, "the plant has ended")
        says = "refused to fly: /ahv/surface_command has 2 publishers: end all but one of them"
        assert plant.finished.result() == says
        executor.remove_node(plant)
        executor.shutdown()
        plant.destroy_node()


@pytest.fixture
def recorder(tmp_path, domain):
    """A recorder in flight, and a node that can say what it likes."""
    with stranger(domain) as node:
        made = RecorderNode({"bag": str(tmp_path / "bag")}, node.context)
        executor = EventsExecutor(context=node.context)
        executor.add_node(made)
        made.bring_up()
        message_type = message_class(FLIGHT.layout.type_name)
        with stranger(domain) as plant_node, stranger(domain) as other:
            liar = other.create_publisher(message_type, FLIGHT.name, quality(True))
            liar.publish(FLIGHT.layout.encode(10_000_000, (5.0, 1.0, FLOWN)))
            states = plant_node.create_publisher(
                message_class(STATE.layout.type_name), STATE.name, quality(True)
            )
            states.publish(STATE.layout.encode(0, (1.0,) * 13))
            plant = plant_node.create_publisher(message_type, FLIGHT.name, quality(True))
            yield made, executor, plant, liar, node
        executor.remove_node(made)
        executor.shutdown()
        made.destroy_node()


def spin(executor, condition, what):
    wait_until(condition, what, partial(executor.spin_once, 0.02))


def test_nobody_but_the_plant_ends_a_recording(recorder):
    made, executor, plant, liar, node = recorder
    filed = made._bag.counts
    spin(executor, lambda: filed[STATE.name] and filed[FLIGHT.name], "both are filed")
    slander = node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, quality(True))
    for name in ("/factory/plant", "/ahv/plant"):
        status = DiagnosticStatus(name=name, values=[KeyValue(key="over", value="True")])
        slander.publish(DiagnosticArray(status=[status]))
    liar.publish(FLIGHT.layout.encode(20_000_000, (5.0, 1.0, FLOWN)))
    spin(executor, lambda: made.health.total[Fault.SECOND_PUBLISHER], "the lie is counted")
    assert made._steps is None and not made.finished.done()
    plant.publish(FLIGHT.layout.encode(10_000_000, (0.0, 0.0, FLOWN)))
    spin(executor, lambda: made._steps == 0, "the end is known")


def test_what_is_sent_again_after_a_pause_is_filed_once(recorder, tmp_path):
    """Latched topics are sent again to who starts to listen again; what came meanwhile as well."""
    made, executor, plant, liar, _ = recorder
    first, meanwhile, last, of_liar = (
        FLIGHT.layout.encode(10_000_000 * step, (5.0, float(step), FLYING)) for step in range(4)
    )
    plant.publish(first)
    spin(executor, lambda: made._bag.counts[FLIGHT.name] == 2, "it is filed, and the liar's one")
    made.trigger_deactivate()
    plant.publish(meanwhile)
    made.trigger_activate()
    plant.publish(last)  # behind all that is sent again by the same
    liar.publish(of_liar)
    spin(executor, lambda: made._bag.counts[FLIGHT.name] >= 5, "as many as were sent are filed")
    made.conclude()
    lie = FLIGHT.layout.encode(10_000_000, (5.0, 1.0, FLOWN))
    filed = load_bag(tmp_path / "bag")[FLIGHT.name].messages
    assert sorted(filed) == sorted([lie, first, meanwhile, last, of_liar])


def test_a_bag_that_is_deleted_in_flight_is_missed_at_once(recorder, tmp_path):
    made, executor, plant, _, _ = recorder
    spin(executor, lambda: made._bag.counts[STATE.name], "a state is filed")
    (tmp_path / "bag").rename(tmp_path / "elsewhere")
    plant.publish(FLIGHT.layout.encode(10_000_000, (5.0, 1.0, FLYING)))
    spin(executor, lambda: made.failure or made._bag.failure, "the loss is noticed")
    plant.publish(FLIGHT.layout.encode(20_000_000, (5.0, 2.0, FLYING)))
    spin(executor, made.finished.done, "the recorder has ended")
    assert "was deleted" in made.finished.result()
