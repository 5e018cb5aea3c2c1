# Copyright 2026 ahv developers, Apache-2.0
"""Nodes that can be told to fail: the same nodes, with publishers that send wrong messages."""

import json
from collections.abc import Callable
from math import inf, nan
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from ahv_msgs_py.layout import Layout, NamedVector
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import PERIOD
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.topics import LOOP_TOPICS, NAMESPACE, LoopTopic, relative

INJECT = f"{NAMESPACE}/inject"  # what to send wrongly, as JSON: topic, kind, count
_TOPICS = {topic.name: topic for topic in LOOP_TOPICS}


def _foreign(layout: Layout) -> Layout:
    """Return a layout of other names, or where there are none, of another frame."""
    if isinstance(layout, NamedVector):
        return NamedVector(layout.frame, [f"wrong_{name}" for name in layout.fields])
    return type(layout)("base_link_flu", layout.fields)  # type: ignore[call-arg]


def wrong_messages(topic: LoopTopic, kind: str, data: bytes, before: bytes) -> list[bytes]:
    """What a publisher that fails in a way of `kind` sends instead of `data`."""
    layout = topic.layout
    known = layout.decode(data)
    assert known is not None
    stamp, values = known

    def with_first(value: float) -> list[bytes]:
        return [layout.encode(stamp, (value, *values[1:]))]

    ways: dict[str, Callable[[], list[bytes]]] = {
        "silent": lambda: [],
        "nan": lambda: with_first(nan),
        "infinity": lambda: with_first(inf),
        "out of range": lambda: with_first(50.0),
        "wrong names": lambda: [_foreign(layout).encode(stamp, values)],
        "cut short": lambda: [data[:-9]],
        "garbage": lambda: [bytes((17 * number) % 251 for number in range(len(data)))],
        "twice": lambda: [data, data],
        "out of order": lambda: [data, before],
        "stale": lambda: [layout.encode(max(0, stamp - 50 * PERIOD), values)],
        "ahead": lambda: [layout.encode(stamp + 100 * PERIOD, values)],
        "off the grid": lambda: [layout.encode(stamp + 3, values)],
        "wild": lambda: [layout.encode(stamp, (values[0], 1.5, *values[2:]))],
    }
    return ways[kind]()


class _FaultyPublisher:
    """A publisher that fails when told to."""

    def __init__(self, publisher: Publisher, topic: LoopTopic):
        self._publisher = publisher
        self._topic = topic
        self._before = b""
        self.kind = ""
        self.left = 0  # messages still to be sent wrongly

    def publish(self, data: bytes) -> None:
        if self.left and self._before:
            self.left -= 1
            for wrong in wrong_messages(self._topic, self.kind, data, self._before):
                self._publisher.publish(wrong)
        else:
            self._publisher.publish(data)
        self._before = data


class FaultyMixin(BaseNode):
    """Listens to what it should send wrongly."""

    def start(self) -> None:
        """Open the topics, and the one for orders."""
        self._faulty: dict[str, _FaultyPublisher] = {}
        self.create_subscription(String, relative(INJECT), self._order, quality(durable=False))
        super().start()

    def publisher(
        self,
        type_name: str,
        name: str,
        qos: QoSProfile,
        matched: Callable[[Any], None] | None = None,
    ) -> Any:
        """Open a publisher that can fail, if it is one of the loop."""
        real = super().publisher(type_name, name, qos, matched)
        if name not in _TOPICS:
            return real
        self._faulty[name] = _FaultyPublisher(real, _TOPICS[name])
        return self._faulty[name]

    def _order(self, message: String) -> None:
        order = json.loads(message.data)
        if order["topic"] in self._faulty:
            publisher = self._faulty[order["topic"]]
            publisher.kind, publisher.left = order["kind"], order["count"]


def faulty(node_class: type[BaseNode]) -> type[BaseNode]:
    """Return the class of a node that can be told to fail."""
    return type(f"Faulty{node_class.__name__}", (FaultyMixin, node_class), {})
