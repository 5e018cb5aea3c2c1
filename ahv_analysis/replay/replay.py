# Copyright 2026 ahv developers, Apache-2.0
"""A recorded flight fed to the controller nodes again, on a live graph.

A feeder publishes the messages of the bag on their own topics, as the bytes they were recorded as,
and every node answers as in flight. What the replayed nodes publish goes by ROS's remapping to
topics under `/replay`: every node hears recorded inputs alone, and is thereby tested alone. Where
the bag does not have a topic, as when an adaptive controller is tried on a nominal flight, the
replayed node's own messages take its place.

Nodes are in lockstep, also at a chosen rate: they wait for inputs of one stamp, so that neither
the order of messages nor the clock changes what they answer.
"""

import os
import time
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial, reduce
from typing import NamedTuple

import numpy as np
import rclpy
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.task import Future

from ahv_analysis.bag.rows import GrowingRows, one_by_one, part_of
from ahv_analysis.bag.series import Series
from ahv_analysis.errors import BagError, GraphError
from ahv_analysis.flight.case import Case
from ahv_analysis.interrupt import signals_wait
from ahv_analysis.replay.inputs import LEARNER_NODE, Change, Recording
from ahv_analysis.replay.result import Comparison, Stamps, common_stamps, compare
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.namespace import ros_arguments
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.log_folder import log_where_it_can
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.network import DISCOVERY_RANGE, keep_to_this_machine
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.node.warm_up import warm_up_nodes
from ahv_msgs_py.parameters import ParameterError
from ahv_msgs_py.topics import (
    BY_NAME,
    DIAGNOSTICS,
    LEARNER_TOPICS,
    LOOP_TOPICS,
    STATE,
    SURFACES,
    LoopTopic,
    within,
)
from ahv_plant.model.constants import STEP_NS

REPLAYED = "/replay"  # before the names of the topics of replayed nodes
BATCH = 100  # steps that are fed before the answers are waited for
DEPTH = 2 * BATCH  # messages that a sender keeps: more than are ever on their way
LISTEN = 1.0  # [s] at most for other graphs, before anything is said where they could hear it
LONGEST_SILENCE = 10.0  # [s] without an answer, after which the graph has failed
LOOK = 0.2  # [s] between looks at the progress


def answers(name: str) -> list[LoopTopic]:
    """What a node answers a state with."""
    return [BY_NAME[topic] for topic in NODES[name].sends]


class Answers:
    """What a node commands on a topic, as it comes."""

    def __init__(self, topic: LoopTopic):
        """Begin with nothing."""
        self._stamps, self._values = array("q"), GrowingRows(len(topic.layout.fields))

    def append(self, stamp: int, values: Values) -> None:
        """Take one command at `stamp` [ns]."""
        self._stamps.append(stamp)
        self._values.append(values)

    def series(self) -> Series:
        """All of them in the order of their stamps; of two with one stamp the last."""
        stamps = np.frombuffer(self._stamps, np.int64)
        if np.all(stamps[1:] > stamps[:-1]):
            return Series(stamps, self._values.rows())
        unique, last = np.unique(stamps[::-1], return_index=True)
        return Series(unique, part_of(self._values.rows(), len(stamps) - 1 - last))


def _union(stamps: Iterable[Stamps]) -> Stamps:
    return reduce(np.union1d, stamps, np.empty(0, np.int64))


class Replay(NamedTuple):
    """A flight as it was replayed."""

    steps: Stamps  # that were fed
    answers: dict[LoopTopic, Series]  # what the nodes commanded
    comparisons: list[Comparison]  # of every topic of every node, with the bag
    skipped: dict[str, int]  # steps of each node that lack inputs in the bag


def replay(
    recording: Recording,
    case: Case,
    names: Sequence[str],
    *,
    rate: float | None = None,
    domain: int | None = None,
    progress: Callable[[int], None] = lambda steps: None,
) -> Replay:
    """Feed a recording to the controllers `names` with the parameters of `case`.

    As fast as the nodes answer, on a graph that nobody else hears; or `rate` times real time, to
    be watched, in a ROS domain where nobody flies. `progress(steps)` is called now and then.
    A signal has its effect once the graph is gone.
    Raises ParameterError for settings that a node refuses, BagError if the bag lacks a topic that
    a node needs, GraphError if a node stops answering or somebody flies here.
    """
    warm_up_nodes(names)  # before anything must be left in order
    hidden = rate is None
    with (
        signals_wait() as interrupted,
        _context(_remapping(recording, names), domain, hidden) as context,
    ):
        graph = _Graph(recording, case, names, context)
        try:
            if rate is not None:
                graph.refuse_company()
            graph.bring_up()
            graph.feed(rate, progress, interrupted)
        finally:
            graph.close()
    commanded = {
        topic: given.series().sharing(recording.topics.values())
        for topic, given in graph.answers.items()
    }
    comparisons = [
        compare(
            name,
            topic,
            within(recording.namespace, topic.name),
            recording.topics.get(topic),
            commanded[topic],
            graph.complete[name],
        )
        for name in names
        for topic in answers(name)
    ]
    if not any(entry.compared for entry in comparisons):
        raise BagError(f"{recording.path} holds no command of {', '.join(names)} with its inputs")
    states = len(recording.topics[STATE].stamps)
    skipped = {name: states - len(graph.complete[name]) for name in names}
    return Replay(graph.steps, commanded, comparisons, skipped)


def _remapping(recording: Recording, names: Sequence[str]) -> list[str]:
    """Remapping rules of ROS: where each replayed node publishes."""
    rules = []
    for name in names:
        for topic in (*answers(name), DIAGNOSTICS):
            if topic is DIAGNOSTICS or topic in recording.topics:
                flown = within(recording.namespace, topic.name)
                rules += ["-r", f"{name}:{flown}:={REPLAYED}{flown}"]
    return [*ros_arguments(recording.namespace), "--disable-stdout-logs", *rules]


@contextmanager
def _context(
    arguments: Sequence[str], domain: int | None, hidden: bool
) -> Iterator[rclpy.Context]:
    """Context of its own; a hidden one is not discovered by anybody, and discovers nobody."""
    keep_to_this_machine()
    before = os.environ[DISCOVERY_RANGE]
    if hidden:
        os.environ[DISCOVERY_RANGE] = "OFF"
    log_where_it_can()
    context = rclpy.Context()
    try:
        rclpy.init(args=list(arguments), context=context, domain_id=domain)
    finally:
        os.environ[DISCOVERY_RANGE] = before
    try:
        yield context
    finally:
        rclpy.shutdown(context=context)


class _Graph:
    """The feeder and the replayed nodes."""

    def __init__(
        self, recording: Recording, case: Case, names: Sequence[str], context: rclpy.Context
    ):
        self._recording = recording
        self.steps = _union(series.stamps for series in recording.topics.values())
        self.answers = {topic: Answers(topic) for name in names for topic in answers(name)}
        self.complete: dict[str, Stamps] = {}  # of the steps that a node can answer
        self._received = 0
        self._wanted = 0
        self._reached = Future(executor=None)
        self._executor: Executor = EventsExecutor(context=context)
        self._feeder: Node = rclpy.create_node("replay", context=context)
        self._executor.add_node(self._feeder)
        self._nodes: dict[str, BaseNode] = {}
        for name in names:
            self._nodes[name] = NODES[name].node_class(case.parameters[name], context)
            self._nodes[name].sender_depth = DEPTH

    def _name(self, topic: LoopTopic) -> str:
        """Name of a topic where the recorded vehicle flew."""
        return within(self._recording.namespace, topic.name)

    def refuse_company(self) -> None:
        """Raise GraphError if somebody flies here: recorded commands must not reach a vehicle."""
        until = time.monotonic() + LISTEN
        while (left := until - time.monotonic()) > 0.0:
            self._spin(min(left, LOOK))
            for topic in LOOP_TOPICS:
                if self._feeder.count_publishers(self._name(topic)):
                    raise GraphError(
                        f"somebody publishes {self._name(topic)} in this ROS domain: "
                        "set ROS_DOMAIN_ID to one of your own"
                    )

    def bring_up(self) -> None:
        """Start the nodes and find out which steps of the recording each of them can answer."""
        for topic in self.answers:
            moved = REPLAYED if topic in self._recording.topics else ""
            self._feeder.create_subscription(
                message_class(topic.layout.type_name),
                moved + self._name(topic),
                partial(self._take, topic),
                quality(durable=True, depth=DEPTH),
                raw=True,
            )
        for name, node in self._nodes.items():
            node.bring_up()
            self._executor.add_node(node)
            self.complete[name] = self._complete(name, node)

    def _take(self, topic: LoopTopic, data: bytes) -> None:
        decoded = topic.layout.decode(data)
        assert decoded is not None  # our own nodes keep to the layout
        stamp, values = decoded
        self.answers[topic].append(stamp, values)
        self._received += 1
        if self._received == self._wanted and not self._reached.done():
            self._reached.set_result(None)

    def _complete(self, name: str, node: BaseNode) -> Stamps:
        """Stamps of the steps that a node has all inputs of; BagError if it can have none."""
        inputs = [topic for topic in LOOP_TOPICS if topic in node.heard]
        self._check(name, [*inputs, *answers(name)])
        states = self._stamps(STATE)
        common = states
        ends = states  # of steps: by what is measured there
        for topic in inputs:
            if topic is SURFACES:
                ends = common_stamps(ends, self._stamps(topic))
            else:
                common = common_stamps(common, self._stamps(topic))
        if name == LEARNER_NODE:  # learns from the step before; starts at any state
            later = np.intersect1d(common + STEP_NS, ends, assume_unique=True)
            common = np.union1d(states[:1], later)
        return common

    def _check(self, name: str, topics: Sequence[LoopTopic]) -> None:
        notes = self._recording.notes
        nominal = notes is None or not notes.adaptive
        for topic in topics:
            replayed = nominal and topic in LEARNER_TOPICS and topic in self.answers
            if topic not in self._recording.topics and not replayed:
                raise BagError(
                    f"{self._recording.path} holds no messages on {self._name(topic)}, "
                    f"without which {name} cannot be replayed"
                )

    def _stamps(self, topic: LoopTopic) -> Stamps:
        """Stamps at which the nodes hear a topic, recorded or replayed."""
        recorded = self._recording.topics.get(topic)
        return self.complete[LEARNER_NODE] if recorded is None else recorded.stamps

    def feed(
        self,
        rate: float | None,
        progress: Callable[[int], None],
        interrupted: Callable[[], bool],
    ) -> None:
        """Publish the recording in the order of its stamps, at `rate` or as fast as possible."""
        publish = {
            topic: self._feeder.create_publisher(
                message_class(topic.layout.type_name),
                self._name(topic),
                quality(durable=True, depth=DEPTH),
            ).publish
            for topic in self._recording.topics
        }
        changes = list(self._recording.changes)
        following = dict.fromkeys(publish, 0)  # place of the message of every topic that is next
        rows = {
            topic: one_by_one(series.values) for topic, series in self._recording.topics.items()
        }
        started = time.monotonic()
        for number, stamp in enumerate(map(int, self.steps)):
            if rate is not None:
                due = started + (stamp - self.steps[0]) / NANOSECONDS / rate
                while (left := due - time.monotonic()) > 0.0 and not interrupted():
                    self._spin(min(left, LOOK))
            changed = changes and changes[0].stamp <= stamp
            if changed or number % BATCH == 0:
                self._await_answers(stamp)
                progress(number)
            if interrupted():
                return
            while changes and changes[0].stamp <= stamp:
                self._change(changes.pop(0))
            for topic, (stamps, _) in self._recording.topics.items():
                place = following[topic]
                if place < len(stamps) and stamps[place] == stamp:
                    publish[topic](topic.layout.encode(stamp, next(rows[topic])))
                    following[topic] += 1
        self._await_answers(int(self.steps[-1]) + 1)
        progress(len(self.steps))

    def _await_answers(self, end: int) -> None:
        """Wait until all steps before `end` [ns] are answered."""
        since = time.monotonic()
        while True:
            unsent = sum(
                node.health.total[Fault.OUTPUT_NOT_FINITE] for node in self._nodes.values()
            )
            self._wanted = self._expected(end) - unsent
            received = self._received
            if received >= self._wanted:
                return
            self._reached = Future(executor=None)
            self._executor.spin_until_future_complete(self._reached, LOOK)
            if self._received > received:
                since = time.monotonic()
            elif time.monotonic() - since > LONGEST_SILENCE:
                raise GraphError(
                    f"{self._wanted - received} commands up to {end / NANOSECONDS:g} s have not "
                    f"come for {LONGEST_SILENCE:g} s"
                )

    def _expected(self, end: int) -> int:
        return sum(
            len(answers(name)) * int(np.searchsorted(stamps, end))
            for name, stamps in self.complete.items()
        )

    def _change(self, change: Change) -> None:
        """Change parameters as in flight."""
        node = self._nodes.get(change.node)
        if node is None:
            return
        given = [RosParameter(name, value=value) for name, value in change.values.items()]
        result = node.set_parameters_atomically(given)  # one by one they may not go together
        if not result.successful:
            raise ParameterError(f"a change in flight cannot be made again: {result.reason}")

    def _spin(self, seconds: float) -> None:
        if seconds > 0.0:
            self._executor.spin_until_future_complete(Future(executor=None), seconds)

    def close(self) -> None:
        """Leave nothing behind."""
        nodes = [self._feeder, *self._nodes.values()]
        for node in nodes:
            self._executor.remove_node(node)
        self._executor.shutdown()
        for node in reversed(nodes):
            node.destroy_node()
