# Copyright 2026 ahv developers, Apache-2.0
"""The shell that all nodes share: guarded topics as exact bytes, and the node's health."""

import gc
import json
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from ahv_msgs_py.layout import NANOSECONDS, text_bytes
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.guard import Guard, Refusal, participant
from ahv_msgs_py.node.health import ERROR, OK, WARN, Health
from ahv_msgs_py.node.managed_node import ManagedNode
from ahv_msgs_py.node.messages import diagnostics, general_reader, message_class
from ahv_msgs_py.node.quality import SENDER_DEPTH, newest, quality
from ahv_msgs_py.node.real_time import reserve_memory
from ahv_msgs_py.node.subscription import Listener, gids
from ahv_msgs_py.node.synchronizer import Fallback, RealTimeSteps, Stepwise, Values
from ahv_msgs_py.parameters import Parameter, Value
from ahv_msgs_py.topics import (
    DIAGNOSTICS,
    FLIGHT,
    FLYING,
    QUEUE_DEPTH,
    SETTINGS,
    STATE,
    LoopTopic,
    relative,
)

LOG_PERIOD = 5.0  # [s] of wall time; a flight in lockstep is thirty times as fast as time
STATE_LOST_AFTER = 500_000_000  # [ns]
PATIENCE = 3  # [s] for an input that no node sends


class BaseNode(ManagedNode):
    """A node of the graph, without its law.

    Its `advice` is what to do about a topic that it waits for and that no node sends.
    """

    advice: ClassVar[Mapping[LoopTopic, str]] = {}

    def __init__(
        self,
        name: str,
        parameters: Sequence[Parameter],
        values: Mapping[str, Value] | None = None,
        context: rclpy.Context | None = None,
    ):
        """`values` overrides parameters."""
        super().__init__(name, parameters, values, context)
        self.sender_depth = SENDER_DEPTH if self.realtime else QUEUE_DEPTH
        self.now: int | None = None  # [ns] stamp of the newest state
        self.health = Health(time.monotonic_ns)
        self._state_heard = 0  # [ns] by the steady clock
        self._state_lost = False
        self._flight_over = False  # the plant has told the end of the flight
        self._awaited: tuple[int, tuple[str, ...]] | None = None  # by the step that waits
        self._waited = 0  # [s] for that
        self._logged: dict[Fault, float] = {}  # [s] by the steady clock when each was last
        self.heard: dict[LoopTopic, Guard] = {}  # what the node listens to of the loop
        self._diagnostics = self.create_publisher(
            DiagnosticArray, DIAGNOSTICS.name, quality(True, self.sender_depth)
        )

    # Lifecycle

    def activate(self) -> None:
        """Open the topics and start from the beginning, in real time with memory at hand."""
        self.now = None
        if self.realtime:
            self._every_second(self._watch)
            reserve_memory()
            gc.collect()
            gc.freeze()  # what lives until the end need not be looked at again
            gc.disable()  # from here on `_watch` collects, between two steps
        self._tell_settings()
        super().activate()

    def _every_second(self, look: Callable[[], None]) -> None:
        timer = self.create_timer(1.0, look)
        self._opened.append(partial(self.destroy_timer, timer))

    def close(self) -> None:
        """Close what was opened."""
        super().close()
        self.heard.clear()

    def _tell_settings(self) -> None:
        """Let everybody know, also who comes later, how this node flies."""
        own = {entry.name: self.settings[entry.name] for entry in self.own_parameters}
        text = json.dumps({"node": self.get_name(), "settings": own})
        publisher = self.publisher(SETTINGS.type_name, SETTINGS.name, quality(True, depth=1))
        publisher.publish(text_bytes(text))

    # Topics

    def full_name(self, topic: LoopTopic) -> str:
        """Name of a topic of the loop in the namespace of this node."""
        return self.resolve_topic_name(relative(topic.name))

    def loop_quality(self) -> QoSProfile:
        """Quality of a receiver: a whole flight in lockstep, the newest in real time."""
        return newest() if self.realtime else quality(True)

    def publisher(
        self,
        type_name: str,
        name: str,
        qos: QoSProfile,
        matched: Callable[[Any], None] | None = None,
    ) -> Publisher:
        """Open a publisher until the node is deactivated."""
        publisher = self.create_publisher(
            message_class(type_name),
            relative(name),
            qos,
            event_callbacks=PublisherEventCallbacks(matched=matched),
        )
        self._opened.append(partial(self.destroy_publisher, publisher))
        return publisher

    def sender(
        self, topic: LoopTopic, matched: Callable[[Any], None] | None = None
    ) -> Callable[[int, Sequence[float]], None]:
        """Advertise a loop topic; the returned function publishes values at a stamp [ns].

        Values that no receiver would take are not sent, and counted.
        """
        encode = topic.layout.encode
        durable = not self.realtime or topic is FLIGHT  # it is told to who comes later too
        qos = quality(durable, self.sender_depth)
        publish = self.publisher(topic.layout.type_name, topic.name, qos, matched).publish
        name = self.full_name(topic)
        low = min(low for low, _ in topic.bounds)
        high = max(high for _, high in topic.bounds)

        def send(stamp: int, values: Sequence[float]) -> None:
            if not (low <= min(values) and max(values) <= high and sum(values) - sum(values) == 0):
                self.fault(stamp, Fault.OUTPUT_NOT_FINITE, f"{name}: {list(values)}")
                return
            publish(encode(stamp, values))

        return send

    def receive(self, topic: LoopTopic, handle: Callable[[int, Values], None]) -> None:
        """Subscribe to a loop topic; `handle(stamp, values)` gets every message that is obeyed."""
        message_type = message_class(topic.layout.type_name)
        name = self.full_name(topic)
        of_plant = topic is FLIGHT  # one message a second, by whoever sends the states
        publishers = list if of_plant else partial(gids, self, name)
        hurry = self.realtime and not of_plant
        guard = Guard(topic, general_reader(topic.layout), time.monotonic_ns, hurry, publishers)
        self.heard[topic] = guard
        judge = guard.read
        paces = topic is STATE

        def read(data: bytes, publisher: bytes) -> None:
            if of_plant and not self._is_plant(publisher):
                return
            try:
                stamp, values = judge(data, publisher, None if paces else self.now)
            except Refusal as refusal:
                self.fault(self.now or 0, refusal.fault, f"{name}: {refusal}")
                return
            if paces:
                self._state_came(stamp, guard)
            handle(stamp, values)

        qos = self.loop_quality() if topic is not FLIGHT else quality(True)
        listener = Listener(self, message_type, relative(topic.name), qos, read)
        self._opened.append(listener.close)
        if paces:
            self.receive(FLIGHT, self._flight_told)

    def _is_plant(self, publisher: bytes) -> bool:
        """Whether who tells of the flight is who sends its states; before the first nobody is."""
        plant = self.heard[STATE].voice
        if plant is None:
            return False
        known = participant(plant) == participant(publisher)
        if not known:
            text = f"{self.full_name(FLIGHT)}: not by the plant"
            self.fault(self.now or 0, Fault.SECOND_PUBLISHER, text)
        return known

    def _flight_told(self, stamp: int, values: Values) -> None:
        """Learn that the flight is over: from then on no state is missed."""
        over = values[-1] != FLYING
        if over and not self._flight_over:
            self.log_end(stamp)
        self._flight_over = over

    def log_end(self, stamp: int) -> None:
        """Log that the flight is over, and what went wrong in it."""
        faults = ", ".join(
            f"{fault.name.lower().replace('_', ' ')} {count}"
            for fault, count in self.health.total.items()
        )
        self.get_logger().info(
            f"flight over at {stamp / NANOSECONDS:g} s; faults: {faults or 'none'}"
        )

    def _state_came(self, stamp: int, guard: Guard) -> None:
        """Keep the time of the flight; a stamp that goes back starts a new one."""
        self.health.state_came()
        if self.realtime:
            self._state_heard = time.monotonic_ns()
            self._state_lost = False
        self._flight_over = False
        if self.now is not None and stamp <= self.now:
            for other in self.heard.values():
                if other is not guard:
                    other.forget()
            self.new_flight()
        self.now = stamp

    def new_flight(self) -> None:
        """Start from the beginning, with the topics as they are."""

    def join(
        self,
        inputs: Sequence[str],
        answer: Callable[..., None],
        fallbacks: Mapping[str, Fallback],
        wait: bool = True,
    ) -> Callable[[str, int, Values], None]:
        """Collect the inputs of a step, the first one setting the pace; returns what takes them.

        In lockstep every step waits for all of them; in real time `fallbacks` stand in.
        """

        def ready(stamp: int, *values: Values | None) -> None:
            if self._changed:
                self.announce(stamp, OK, "parameters changed", **self._changed)
                self._changed = {}
            answer(stamp, *values)
            self.health.answered()
            if not self.realtime and stamp % NANOSECONDS == 0:
                self.report_health(stamp)

        if self.realtime:
            return RealTimeSteps(inputs, ready, fallbacks, self._missing, wait).put
        return self.in_lockstep(inputs, ready)

    def in_lockstep(
        self, inputs: Sequence[str], ready: Callable[..., None]
    ) -> Callable[[str, int, Values], None]:
        """Collect the inputs of a step, and tell which one no node sends; returns what takes them.

        An input is known by the full name of its topic.
        """
        steps = Stepwise(inputs, ready)
        self._every_second(partial(self._watch_steps, steps))
        return steps.put

    def receive_together(
        self, answer: Callable[..., None], fallbacks: Mapping[LoopTopic, Fallback]
    ) -> None:
        """Subscribe to the state and other loop topics; `answer(stamp, state, ...)` gets a step's.

        `fallbacks` names the other topics, and what stands in for each in real time.
        """
        topics = (STATE, *fallbacks)
        put = self.join(
            [self.full_name(topic) for topic in topics],
            answer,
            {self.full_name(topic): fallback for topic, fallback in fallbacks.items()},
        )
        for topic in topics:
            self.receive(topic, partial(put, self.full_name(topic)))

    def _missing(self, stamp: int, name: str) -> None:
        self.fault(stamp, Fault.INPUT_MISSING, name)

    # Health

    def fault(self, stamp: int, fault: Fault, text: str, times: int = 1) -> None:
        """Count a fault; tell of the first of its kind in every second."""
        if self.health.count(fault, times):
            name = fault.name.lower().replace("_", " ")
            level = ERROR if fault.value.error else WARN
            self.announce(stamp, level, f"{name}: {text}")
            self._log(fault, level, f"{name} at {stamp / NANOSECONDS:g} s: {text}")

    def _log(self, fault: Fault, level: bytes, text: str) -> None:
        """Log a fault at the level of its diagnostics, one of its kind in `LOG_PERIOD`."""
        now = time.monotonic()
        if now - self._logged.get(fault, -LOG_PERIOD) < LOG_PERIOD:
            return
        self._logged[fault] = now
        if level == ERROR:  # rclpy ties a level to the line that logs
            self.get_logger().error(text)
        else:
            self.get_logger().warning(text)

    def refused(self, reason: str) -> None:
        """Count a change of parameters that was refused."""
        self.fault(self.now or 0, Fault.CHANGE_REFUSED, reason)

    def announce(self, stamp: int, level: bytes, text: str, **facts: object) -> None:
        """Publish a diagnostic status at `stamp` [ns]."""
        name = self.get_fully_qualified_name()
        self._diagnostics.publish(diagnostics(stamp, name, level, text, facts))

    def report_health(self, stamp: int) -> None:
        """Publish what happened since the last report."""
        level, text, facts = self.health.report()
        if self._state_lost:
            level, text = ERROR, "no state"
        self.announce(stamp, level, text, **facts)

    def _watch_steps(self, steps: Stepwise) -> None:
        """Once a second in lockstep, when there is nothing else to do: look for what is not sent.

        Lockstep waits for ever, and rightly so; whoever started the nodes should know for what.
        """
        awaited = steps.awaited()
        self._waited = self._waited + 1 if awaited == self._awaited else 0
        self._awaited = awaited
        if awaited is None or self._waited != PATIENCE or self._flight_over:
            return
        stamp, absent = awaited
        for topic in self.heard:
            name = self.full_name(topic)
            if name in absent and not self.count_publishers(name):
                text = f"{name} is waited for, and no node sends it"
                advice = f": {self.advice[topic]}" if topic in self.advice else ""
                self.fault(stamp, Fault.INPUT_NOT_SENT, text + advice)

    def _watch(self) -> None:
        """Once a second in real time: look for a state that has gone, report, tidy up."""
        silent = time.monotonic_ns() - self._state_heard
        missed = self._state_heard and silent > STATE_LOST_AFTER and not self._flight_over
        if missed and not self._state_lost:
            self._state_lost = True
            self.fault(self.now or 0, Fault.STATE_LOST, f"none for {silent * 1e-9:.1f} s")
        self.report_health(self.now or 0)
        gc.collect(0)
