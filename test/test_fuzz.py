# Copyright 2026 ahv developers, Apache-2.0
"""Bad messages, ten thousand to every subscription of every node: none obeyed, all counted."""

import math
from functools import partial

import pytest
import rclpy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ahv_analysis.flight.case import load_case
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.layout import NamedVector
from ahv_msgs_py.node.faults import PERIOD, Fault
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.topics import (
    DISTURBANCE_ESTIMATE,
    LEARNER,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
)
from test.waiting import wait_until

EXAMPLES, BATCH = 100, 100
SUBSCRIPTIONS = [
    ("outer_intermediate", STATE),
    ("disturbance_learner", STATE),
    ("disturbance_learner", RATE_COMMAND),
    ("disturbance_learner", SURFACE_COMMAND),
    ("inner_loop", STATE),
    ("inner_loop", RATE_COMMAND),
    ("inner_loop", LEARNER),
    ("inner_loop", DISTURBANCE_ESTIMATE),
    ("velocity", STATE),
    ("velocity", SURFACE_COMMAND),
    ("plant", SURFACE_COMMAND),
    ("plant", THROTTLE_COMMAND),
]
NUMBERS = st.floats(-0.5, 0.5)
NO_NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf])
CASE = load_case("neuro_adaptive_di")


def good_values(topic):
    """Values that would be obeyed."""
    return tuple(max(low, min(0.1, high)) for low, high in topic.bounds)


@st.composite
def bad_batches(draw, topic):
    """One way of being bad, many times over."""
    layout, values = topic.layout, list(good_values(topic))
    ways = ["bytes", "short", "number", "off the grid", "old", "frame"]
    if isinstance(layout, NamedVector):
        ways += ["names", "count"]
    if any(abs(low) < 1e300 for low, _ in topic.bounds):
        ways.append("range")
    way = draw(st.sampled_from(ways))
    place = draw(st.integers(0, len(values) - 1))
    number = draw(NUMBERS)
    random = draw(st.randoms(use_true_random=False))
    batch = []
    for step in range(BATCH):
        stamp = (1000 + step) * PERIOD
        worse = [number + 1e-3 * step if value != 1.0 else value for value in values]
        worse = [
            max(low, min(x, high)) for x, (low, high) in zip(worse, topic.bounds, strict=True)
        ]
        whole = layout.encode(stamp, worse)
        if way == "bytes":
            batch.append(b"\x00\x01\x00\x00" + random.randbytes(random.randrange(4, 600)))
        elif way == "short":
            batch.append(whole[: random.randrange(4, len(whole) - 8)])
        elif way == "number":
            worse[place] = draw(NO_NUMBERS) if step < 3 else math.nan
            batch.append(layout.encode(stamp, worse))
        elif way == "range":
            place = next(k for k, (low, _) in enumerate(topic.bounds) if abs(low) < 1e300)
            worse[place] = random.choice((-1, 1)) * 10.0 ** random.randrange(8, 300)
            batch.append(layout.encode(stamp, worse))
        elif way == "off the grid":
            batch.append(layout.encode(stamp + random.randrange(1, PERIOD), worse))
        elif way == "old":
            batch.append(layout.encode(random.randrange(0, 11) * PERIOD, worse))
        else:
            batch.append(foreign(topic, way, random).encode(stamp, worse))
    return batch


def foreign(topic, way, random):
    """Layout that nearly is the topic's."""
    layout = topic.layout
    if way == "frame":
        name = random.choice(("map", "base_link", "odom", "x" * random.randrange(1, 40)))
        return type(layout)(name, layout.fields)
    names = list(layout.fields)
    if way == "names" and len(names) > 1:
        names = names[1:] + names[:1]
    elif way == "names":
        names = ["thrust"]
    else:
        names[random.randrange(len(names))] += "_"
    return type(layout)(layout.frame, names)


class Fuzzed:
    """A node alone in its graph, with a publisher on one of its topics."""

    def __init__(self, name, topic, domain):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        values = CASE.parameters[name] | ({"listeners": 1} if name == "plant" else {})
        self.node = NODES[name].node_class(values, self.context)
        self.node.bring_up()
        self.sender = rclpy.create_node("sender", context=self.context)
        self.publisher = self.sender.create_publisher(
            message_class(topic.layout.type_name), topic.name, self.node.loop_quality()
        )
        self.executor = EventsExecutor(context=self.context)
        for node in (self.node, self.sender):
            self.executor.add_node(node)
        look = partial(self.executor.spin_once, 0.01)
        wait_until(self.publisher.get_subscription_count, f"{name} hears {topic.name}", look)
        self.sent = 0
        if name == "plant":  # as if it had flown that far
            self.node._flying, self.node.step = True, 5000

    def refused(self):
        """Messages that were refused; a good one may ask for more than the vehicle is allowed."""
        limits = (Fault.CLIMB_LIMITED, Fault.ALPHA_LIMITED)
        total = self.node.health.total
        return sum(count for fault, count in total.items() if fault not in limits)

    def send(self, batch):
        before = self.refused()
        for data in batch:
            self.publisher.publish(data)
        wait_until(
            lambda: self.refused() - before >= len(batch),
            f"{len(batch)} messages are refused",
            partial(self.executor.spin_once, 0.05),
        )
        self.sent += len(batch)
        return self.refused() - before

    def close(self):
        for node in (self.node, self.sender):
            self.executor.remove_node(node)
        self.executor.shutdown()
        self.sender.destroy_node()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.mark.parametrize(
    "name, topic", SUBSCRIPTIONS, ids=lambda entry: getattr(entry, "name", entry)
)
def test_bad_messages_are_refused_and_counted(name, topic, domain):
    fuzzed = Fuzzed(name, topic, domain)
    fuzzed.publisher.publish(topic.layout.encode(10 * PERIOD, good_values(topic)))
    fuzzed.executor.spin_once(0.2)
    assert fuzzed.refused() == 0

    @settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
    @given(bad_batches(topic))
    def fuzz(batch):
        assert fuzzed.send(batch) == len(batch)

    try:
        fuzz()
        assert fuzzed.sent >= 10_000
        kinds = {Fault.MALFORMED, Fault.NOT_FINITE, Fault.WRONG_STAMP}
        assert kinds <= fuzzed.node.health.total.keys()
    finally:
        fuzzed.close()
