# Copyright 2026 ahv developers, Apache-2.0
"""Node `recorder`: every topic of the graph into an MCAP bag, the bytes as they came."""

import json
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import rclpy
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from ahv_analysis.bag.notes import UNNAMED, told_of
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.errors import BagError
from ahv_analysis.versions import versions
from ahv_msgs_py.graph import case_nodes
from ahv_msgs_py.layout import MessageError
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.guard import Guard, Refusal, participant
from ahv_msgs_py.node.health import ERROR, OK, WARN
from ahv_msgs_py.node.messages import general_reader, message_class
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.subscription import Subscription
from ahv_msgs_py.parameters import Parameter, ParameterError, Value
from ahv_msgs_py.topics import (
    FLIGHT,
    FLYING,
    LOOP_TOPICS,
    NOMINAL_TOPICS,
    SETTINGS,
    STATE,
    VIEWER_TOPICS,
    LoopTopic,
    relative,
)

STOP, CONTINUE = "stop", "continue"
RECORDER_PARAMETERS = (
    Parameter("bag", "bag", "folder of the bag to write; it must not exist"),
    Parameter(
        "notes", "", "text to file with the bag; with JSON, parameters and versions are added"
    ),
    Parameter(
        "on_error",
        STOP,
        f"when the disk fails: {STOP} ends the recorder and with it the flight, "
        f"{CONTINUE} lets them go on without a record",
    ),
)
POLL = 0.02  # [s] of wall time between looks at the topics
POLLS = 5  # looks that a chunk has the messages of
QUIET = 0.5  # [s] after the end of a flight in real time, for what is still under way
LONGEST_WAIT = 5.0  # [s] in lockstep, where all messages come


class RecorderNode(BaseNode):
    """Listens to every topic; the bag is complete once the node is destroyed.

    It takes what has come every `POLL`, all messages of a topic in one go, which costs a flight
    half of what a call for each message would. A message is on its way to the disk a tenth of a
    second after it came, with every fifth look.

    `finished` is set when the flight is over and all of its messages are in the bag, or with the
    reason why the recording ended early; `failure` has that reason whatever `on_error` is.
    """

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters; ParameterError if the bag cannot be made."""
        self._polled: dict[str, Subscription] = {}
        super().__init__("recorder", RECORDER_PARAMETERS, values, context)
        self.failure: BagError | None = None
        self._bag: BagWriter | None = None
        self._numbers: dict[str, dict[bytes, int]] = {}  # of the publishers of a topic, by GID
        self._told: dict[str, dict[str, Value]] = {}  # settings of the nodes that fly
        self._polls = 0
        self._filed: dict[tuple[str, bytes], int] = {}  # newest message of topic and publisher
        self._steps: int | None = None  # of the flight, once it is over
        self._over = 0.0  # [s] by the steady clock when it was

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the bag."""
        if settings["on_error"] not in (STOP, CONTINUE):
            raise ParameterError(
                f"recorder: on_error is {settings['on_error']!r}, but must be {STOP} or {CONTINUE}"
            )
        try:
            self._bag = BagWriter(
                Path(str(settings["bag"])),
                str(settings["notes"]),
                background=self.realtime,
                names={
                    topic.name: self.resolve_topic_name(relative(topic.name))
                    for topic in (*LOOP_TOPICS, FLIGHT, *VIEWER_TOPICS)
                },
            )
        except BagError as error:
            raise ParameterError(f"recorder: bag: {error}") from error

    def start(self) -> None:
        """Listen to every topic; in real time as in lockstep nothing may be missed."""
        durable = not self.realtime
        self._end_guard = Guard(
            FLIGHT,
            general_reader(FLIGHT.layout),
            time.monotonic_ns,
            realtime=False,
            publishers=list,
        )
        topics = [(topic.name, topic.layout.type_name, durable) for topic in LOOP_TOPICS]
        topics.append((FLIGHT.name, FLIGHT.layout.type_name, True))
        topics += [(topic.name, topic.type_name, topic.durable) for topic in VIEWER_TOPICS]
        for name, type_name, durable in topics:
            try:
                message_type = message_class(type_name)
            except ModuleNotFoundError:
                continue  # /tf without tf2_msgs installed: then nobody here can send it either
            subscription = Subscription(self, message_type, relative(name), quality(durable))
            self._polled[name] = subscription
            self._opened.append(subscription.close)
            self._opened.append(partial(self._polled.pop, name))
        timer = self.create_timer(POLL, self._poll)
        self._opened.append(partial(self.destroy_timer, timer))
        self._opened.append(self._take)  # first of all to be done when the topics are closed
        self.announce(self._bag.now, OK, f"recording to {self._bag.path}")

    def _poll(self) -> None:
        """Take what has come; see whether that was all."""
        self._take()
        self._polls += 1
        if self._polls % POLLS == 0 and self.failure is None:
            self._bag.flush()
        if self._steps is None:
            return
        waited = time.monotonic() - self._over
        if self.failure is not None:
            self._end(str(self.failure))
        elif self.realtime:  # messages may be missing; what comes comes soon
            if waited > QUIET:
                self._end("")
        elif waited > LONGEST_WAIT or not self.missing(self._flown(), self._steps):
            self._end("")

    def _take(self) -> None:
        """Take what has come, until the bag is closed."""
        if self._bag is None:
            return
        for topic, subscription in self._polled.items():
            taken = [message for message in subscription if self._is_new(topic, *message)]
            messages = [data for data, _, _ in taken]
            numbers = self._numbers.setdefault(topic, {})
            publishers = [numbers.setdefault(gid, len(numbers) + 1) for _, gid, _ in taken]
            if messages and self.failure is None:
                try:
                    self._bag.write(topic, *messages, publishers=publishers)
                except BagError as error:
                    self._fail(error)
            if topic == FLIGHT.name:
                for data, publisher, _ in taken:
                    self._read_flight(data, publisher)
            if topic == SETTINGS.name and messages and self.failure is None:
                self._read_settings(messages)
        self.now = self._bag.now

    def _is_new(self, topic: str, data: bytes, publisher: bytes, number: int) -> bool:
        """Whether a message is not in the bag yet: who starts to listen again is sent it again."""
        new = number > self._filed.get((topic, publisher), 0)
        if new:
            self._filed[topic, publisher] = number
        return new

    def _fail(self, error: BagError) -> None:
        """Say once that the recording has ended, and end the node if it is set so."""
        self.failure = error
        self.get_logger().error(str(error))
        self.announce(self._bag.now, ERROR, str(error))
        if self.settings["on_error"] == STOP:
            self._end(str(error))

    def _end(self, reason: str) -> None:
        if not self.finished.done():
            self.finished.set_result(reason)

    def _read_flight(self, data: bytes, publisher: bytes) -> None:
        """Learn from the plant that the flight is over, and after how many steps."""
        plants = {participant(gid) for topic, gid in self._filed if topic == STATE.name}
        if participant(publisher) not in plants:
            if plants:
                text = f"{self.full_name(FLIGHT)}: not by the plant"
                self.fault(self._bag.now, Fault.SECOND_PUBLISHER, text)
            return
        try:
            stamp, (_, steps, end) = self._end_guard.read(data, publisher, None)
        except Refusal as refusal:
            self.fault(self._bag.now, refusal.fault, f"{self.full_name(FLIGHT)}: {refusal}")
            return
        if end != FLYING and self._steps is None:
            self.log_end(stamp)
        self._steps = None if end == FLYING else int(steps)
        self._over = time.monotonic()

    def _flown(self) -> list[LoopTopic]:
        """Topics of the loop that the flight has."""
        return [one for one in LOOP_TOPICS if one in NOMINAL_TOPICS or self._bag.counts[one.name]]

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the topics, and say that what follows is not recorded."""
        self.announce(self._bag.now, WARN, "not recording: deactivated")
        return super().on_deactivate(state)

    def _read_settings(self, messages: Sequence[bytes]) -> None:
        """Learn how the nodes fly, and note it."""
        for data in messages:
            try:
                node, settings = told_of(data)
            except MessageError as error:
                self.fault(self._bag.now, Fault.MALFORMED, f"{SETTINGS.name}: {error}")
            else:
                self._told |= {node: settings} if node in case_nodes() else {}
        self._bag.annotate(completed(str(self.settings["notes"]), self._told))

    def missing(self, topics: Sequence[LoopTopic], steps: int) -> int:
        """How many messages of these topics are still to come from a flight of so many steps."""
        return sum(max(0, steps + 1 - self._bag.counts[topic.name]) for topic in topics)

    def balance(self, topics: Sequence[LoopTopic], steps: int) -> int:
        """How many messages the bag lacks of a flight of so many steps; negative: others flew."""
        return sum(steps + 1 - self._bag.counts[topic.name] for topic in topics)

    def conclude(self) -> None:
        """Close the bag with what has come; the topics can wait, and the middleware may hang."""
        if self._bag is not None:
            self._take()
            try:
                self._bag.close()
            except BagError as error:
                if self.failure is None:
                    self._fail(error)
        self._bag = None


def completed(notes: str, told: Mapping[str, Mapping[str, Value]]) -> str:
    """Notes with what nodes told of their settings, where they do not say it themselves.

    What is no JSON object is somebody's own text, and stays as it is.
    """
    try:
        content = json.loads(notes or "{}")
    except ValueError:
        return notes
    if not isinstance(content, dict):
        return notes
    content = {"case": UNNAMED, "versions": versions()} | content
    return json.dumps(content | {"parameters": {**told, **content.get("parameters", {})}})


def main() -> None:
    """Run the node."""
    run(RecorderNode)
