# Copyright 2026 ahv developers, Apache-2.0
"""Somebody outside the graph who listens to its diagnostics."""

import time
from collections.abc import Callable

import rclpy
from diagnostic_msgs.msg import DiagnosticArray

from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.topics import DIAGNOSTICS, NAMESPACE
from ahv_plant.model.constants import STEP_NS

LOOK = 0.2  # [s] between looks for an interruption


class Watcher:
    """Listens to the diagnostics of the graph from outside it."""

    def __init__(self, interrupted: Callable[[], bool] = lambda: False):
        """Start to listen; once `interrupted()` there is no more looking."""
        self._interrupted = interrupted
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self._node = rclpy.create_node("watcher", namespace=NAMESPACE, context=self.context)
        self._executor = EventsExecutor(context=self.context)
        self._executor.add_node(self._node)
        self._node.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._take, quality(durable=True)
        )
        self.step = -1  # of the newest report of the plant
        self.over: dict[str, str] | None = None  # what the plant said at the end
        self.reason = ""  # why it ended early
        self.statuses: list[tuple[int, str, int, str, dict[str, str]]] = []

    def _take(self, message: DiagnosticArray) -> None:
        stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
        for status in message.status:
            facts = {fact.key: fact.value for fact in status.values}
            namespace, _, name = status.name.rpartition("/")
            if namespace != NAMESPACE:
                continue  # of another vehicle
            self.statuses.append((stamp, name, status.level[0], status.message, facts))
            if name == "plant":
                self.step = stamp // STEP_NS
                if "over" in facts:
                    self.over = facts
                    self.reason = "" if status.level == b"\x00" else status.message

    def look(self, seconds: float) -> None:
        """Listen for so long."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0 and not self._interrupted():
            self._executor.spin_once(min(left, LOOK))

    def close(self) -> None:
        """Stop listening."""
        self._executor.remove_node(self._node)
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self.context)
