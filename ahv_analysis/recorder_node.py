"""Node `recorder`: every topic of the graph into an MCAP bag, the bytes as they came."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message

from ahv_analysis.bag_writer import BagWriter
from ahv_analysis.errors import BagError
from ahv_msgs_py.base_node import BaseNode, message_class, quality
from ahv_msgs_py.health import OK
from ahv_msgs_py.node_process import run
from ahv_msgs_py.parameters import Parameter, ParameterError, Value
from ahv_msgs_py.topics import (
    DIAGNOSTICS,
    LOOP_TOPICS,
    NAMESPACE,
    NOMINAL_TOPICS,
    VIEWER_TOPICS,
    LoopTopic,
)

RECORDER_PARAMETERS = (
    Parameter("bag", "bag", "folder of the bag to write; it must not exist"),
    Parameter("notes", "", "text to file with the bag"),
)


QUIET = 0.5  # [s] after the end of a flight in real time, for what is still under way


class RecorderNode(BaseNode):
    """Listens to every topic; the bag is complete once the node is destroyed.

    `finished` is set when the flight is over and all of its messages are in the bag.
    """

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters; ParameterError if the bag cannot be made."""
        super().__init__("recorder", RECORDER_PARAMETERS, values, context)
        self._bag: BagWriter | None = None
        self._steps: int | None = None  # of the flight, once it is over
        self._flown: Sequence[LoopTopic] = ()  # topics of the loop that flew

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the bag."""
        try:
            self._bag = BagWriter(Path(str(settings["bag"])), str(settings["notes"]))
        except BagError as error:
            raise ParameterError(f"recorder: bag: {error}") from error

    def start(self) -> None:
        """Listen to every topic; in real time as in lockstep nothing may be missed."""
        durable = not self.realtime
        topics = [(topic.name, topic.layout.type_name, durable) for topic in LOOP_TOPICS]
        topics += [(topic.name, topic.type_name, topic.durable) for topic in VIEWER_TOPICS]
        for name, type_name, durable in topics:
            try:
                message_type = message_class(type_name)
            except ModuleNotFoundError:
                continue  # /tf without tf2_msgs installed: then nobody here can send it either
            write = self._write_status if name == DIAGNOSTICS.name else partial(self._write, name)
            subscription = self.create_subscription(
                message_type, name, write, quality(durable), raw=True
            )
            self._opened.append(partial(self.destroy_subscription, subscription))
        self.announce(0, OK, f"recording to {self._bag.path}")

    def _write(self, topic: str, data: bytes) -> None:
        self._bag.write(topic, data)
        if self._steps is not None and not self.realtime:
            self._end_if_complete()

    def _end_if_complete(self) -> None:
        if not self.missing(self._flown, self._steps) and not self.finished.done():
            self.finished.set_result("")

    def _write_status(self, data: bytes) -> None:
        """Learn from the plant that the flight is over, and after how many steps."""
        for status in deserialize_message(data, DiagnosticArray).status:
            facts = {fact.key: fact.value for fact in status.values}
            if status.name == f"{NAMESPACE}/plant" and "over" in facts:
                self._steps = int(facts["steps"])
                self._flown = [
                    topic
                    for topic in LOOP_TOPICS
                    if topic in NOMINAL_TOPICS or self.count_publishers(topic.name)
                ]
                if self.realtime:  # messages may be missing; what comes comes soon
                    self.create_timer(QUIET, partial(self.finished.set_result, ""))
        self._write(DIAGNOSTICS.name, data)

    def missing(self, topics: Sequence[LoopTopic], steps: int) -> int:
        """How many messages of these topics are still to come from a flight of so many steps."""
        return sum(max(0, steps + 1 - self._bag.counts[topic.name]) for topic in topics)

    def balance(self, topics: Sequence[LoopTopic], steps: int) -> int:
        """How many messages the bag lacks of a flight of so many steps; negative: others flew."""
        return sum(steps + 1 - self._bag.counts[topic.name] for topic in topics)

    def destroy_node(self) -> None:
        """Close the bag, then the node."""
        if self._bag is not None:
            self._bag.close()
        super().destroy_node()


def main() -> None:
    """Run the node."""
    run(RecorderNode)
