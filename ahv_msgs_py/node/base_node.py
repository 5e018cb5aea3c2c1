# Copyright 2026 ahv developers, Apache-2.0
"""The shell that all nodes share: lifecycle, parameters, guarded topics as exact bytes, health."""

import gc
import inspect
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter as RosParameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.task import Future

from ahv_msgs_py.layout import NANOSECONDS, MessageError
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.guard import Guard, Refusal
from ahv_msgs_py.node.health import ERROR, OK, WARN, Health
from ahv_msgs_py.node.real_time import reserve_memory
from ahv_msgs_py.node.synchronizer import Fallback, RealTimeSteps, Stepwise, Values
from ahv_msgs_py.parameters import (
    SHARED,
    Parameter,
    ParameterError,
    Value,
    check_parameters,
)
from ahv_msgs_py.topics import DIAGNOSTICS, NAMESPACE, QUEUE_DEPTH, STATE, LoopTopic

REALTIME = Parameter("realtime", False, "100 Hz by the wall clock; if false, lockstep")
AUTOSTART = Parameter("autostart", True, "configure and activate when started as a process")
SHELL_PARAMETERS = (REALTIME, AUTOSTART)
REALTIME_DEPTH = 10  # messages kept by a receiver in real time: older ones would not be obeyed
SENDER_DEPTH = 1000  # and by a sender there, for a receiver that is slow, as a recorder
STATE_LOST_AFTER = 500_000_000  # [ns]


def quality(durable: bool, depth: int = QUEUE_DEPTH) -> QoSProfile:
    """Reliable quality of service; `durable` gives a node that joins late what it missed."""
    local = DurabilityPolicy.TRANSIENT_LOCAL if durable else DurabilityPolicy.VOLATILE
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=local,
    )


def message_class(type_name: str) -> Any:
    """Class of a message type like `sensor_msgs/msg/JointState`; ModuleNotFoundError if none."""
    package, _, name = type_name.split("/")
    return getattr(import_module(f"{package}.msg"), name)


class BaseNode(LifecycleNode):
    """A node of the graph, without its law: a managed node by the standard lifecycle.

    A subclass fills in `prepare`, which makes the law from the settings (on configure, and when
    parameters change in flight), and `start`, which opens the topics (on activate; what it opened
    is closed on deactivate). `finished` is the future that ends the process.
    """

    def __init__(
        self,
        name: str,
        parameters: Sequence[Parameter],
        values: Mapping[str, Value] | None = None,
        context: rclpy.Context | None = None,
    ):
        """`values` overrides parameters, as a YAML file of `--params-file` does.

        Parameters that do not fit are refused by name when the node is configured.
        """
        overrides = [RosParameter(key, value=value) for key, value in (values or {}).items()]
        super().__init__(
            name,
            namespace=NAMESPACE,
            context=context,
            parameter_overrides=overrides,
            automatically_declare_parameters_from_overrides=True,
            start_parameter_services=True,
        )
        self.finished = Future(executor=None)
        self.refusal = ""  # why the node could not be configured
        self.settings: dict[str, Value] = {}
        self._known = {entry.name: entry for entry in (*parameters, *SHELL_PARAMETERS)}
        try:
            self.settings = self._declare(name)
        except ParameterError as error:
            self.refusal = str(error)
        self.realtime = bool(self.settings.get(REALTIME.name))
        self.sender_depth = SENDER_DEPTH if self.realtime else QUEUE_DEPTH
        self.now: int | None = None  # [ns] stamp of the newest state
        self.health = Health(time.monotonic_ns)
        self._state_heard = 0  # [ns] by the steady clock
        self._state_lost = False
        self._judges: list[Guard] = []
        self._opened: list[Callable[[], object]] = []  # closes what `start` opened
        self._changed: dict[str, Value] = {}  # in flight, not yet in force
        self._diagnostics = self.create_publisher(
            DiagnosticArray, DIAGNOSTICS.name, quality(True, self.sender_depth)
        )
        self.add_on_set_parameters_callback(self._change)
        # an impossible transition is answered with a refusal; rclpy would end the process
        self._service_change_state.callback = partial(
            self._change_state, self._service_change_state.callback
        )

    # Parameters

    def _declare(self, name: str) -> dict[str, Value]:
        """Check the given parameters, then declare them all with description, unit and range."""
        ignored = {"use_sim_time", "start_type_description_service", *SHARED} - {*self._known}
        given = {
            key: parameter.value
            for key, parameter in self.get_parameters_by_prefix("").items()
            if key not in ignored and not key.startswith("qos_overrides.")
        }
        values = check_parameters(name, self._known.values(), given)
        for parameter in self._known.values():
            if self.has_parameter(parameter.name):
                self.undeclare_parameter(parameter.name)
            descriptor = ParameterDescriptor(
                description=f"{parameter.description} [{parameter.unit or '-'}]",
                read_only=not parameter.in_flight,
            )
            if parameter.minimum is not None and parameter.maximum is not None:
                if isinstance(parameter.default, float):
                    bounds = FloatingPointRange(
                        from_value=parameter.minimum, to_value=parameter.maximum
                    )
                    descriptor.floating_point_range = [bounds]
                else:
                    limits = IntegerRange(
                        from_value=int(parameter.minimum), to_value=int(parameter.maximum)
                    )
                    descriptor.integer_range = [limits]
            self.declare_parameter(
                parameter.name, values[parameter.name], descriptor, ignore_override=True
            )
        return values

    def _change(self, parameters: Sequence[RosParameter]) -> SetParametersResult:
        """Take parameters that change in flight; they are in force from the next step on."""
        own = [entry for entry in parameters if entry.name in self._known and self.settings]
        try:
            given = {
                entry.name: self._known[entry.name].check(self.get_name(), entry.value)
                for entry in own
            }
            if given:
                self.prepare(self.settings | given)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.settings |= given
        self._changed |= given
        return SetParametersResult(successful=True)

    # Lifecycle

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the law from checked settings; ParameterError if they do not go together."""

    def start(self) -> None:
        """Open the topics and start from the beginning."""

    def bring_up(self) -> None:
        """Configure and activate at once; ParameterError if the node cannot be configured."""
        for trigger in (self.trigger_configure, self.trigger_activate):
            if trigger() != TransitionCallbackReturn.SUCCESS:
                raise ParameterError(self.refusal or f"{self.get_name()} could not be started")

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the law; refuse bad parameters in one sentence."""
        return self._transition(self._configure)

    def _configure(self) -> None:
        if not self.settings:
            raise ParameterError(self.refusal)
        self.prepare(self.settings)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the topics."""
        return self._transition(self._activate)

    def _activate(self) -> None:
        self.now = None
        if self.realtime:
            timer = self.create_timer(1.0, self._watch)
            self._opened.append(partial(self.destroy_timer, timer))
            reserve_memory()
            gc.collect()
            gc.freeze()  # what lives until the end need not be looked at again
            gc.disable()  # from here on `_watch` collects, between two steps
        self.start()

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the topics."""
        return self._transition(self._close)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the node."""
        if not self.finished.done():
            self.finished.set_result("")
        return self._transition(self._close)

    def _close(self) -> None:
        while self._opened:
            self._opened.pop()()
        self._judges.clear()

    def _transition(self, work: Callable[[], None]) -> TransitionCallbackReturn:
        """Do the work of a transition; rclpy would swallow what it raises."""
        try:
            work()
        except ParameterError as error:
            self.refusal = str(error)
            self.get_logger().error(self.refusal)
            return TransitionCallbackReturn.FAILURE
        except Exception:
            self.refusal = traceback.format_exc()
            self.get_logger().error(self.refusal)
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _change_state(self, change: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        try:
            return change(request, response)
        except rclpy._rclpy_pybind11.RCLError as error:
            self.get_logger().warning(f"impossible transition: {str(error).splitlines()[0]}")
            response.success = False
            return response

    # Topics

    def loop_quality(self) -> QoSProfile:
        """Quality of service of a receiver: lockstep keeps a whole flight, real time little."""
        return quality(durable=False, depth=REALTIME_DEPTH) if self.realtime else quality(True)

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
            name,
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
        qos = quality(durable=not self.realtime, depth=self.sender_depth)
        publish = self.publisher(topic.layout.type_name, topic.name, qos, matched).publish
        low = min(low for low, _ in topic.bounds)
        high = max(high for _, high in topic.bounds)

        def send(stamp: int, values: Sequence[float]) -> None:
            if not (low <= min(values) and max(values) <= high and sum(values) - sum(values) == 0):
                self.fault(stamp, Fault.OUTPUT_NOT_FINITE, f"{topic.name}: {list(values)}")
                return
            publish(encode(stamp, values))

        return send

    def receive(self, topic: LoopTopic, handle: Callable[[int, Values], None]) -> None:
        """Subscribe to a loop topic; `handle(stamp, values)` gets every message that is obeyed."""
        message_type = message_class(topic.layout.type_name)

        def general(data: bytes) -> tuple[int, Values]:
            try:
                message = deserialize_message(data, message_type)
            except rclpy._rclpy_pybind11.RMWError as error:
                raise MessageError("the bytes are no message of the topic's type") from error
            return topic.layout.values_of(message)

        publishers = partial(self.count_publishers, topic.name)
        guard = Guard(topic, general, time.monotonic_ns, self.realtime, publishers)
        self._judges.append(guard)
        judge = guard.read
        paces = topic is STATE

        def read(*arguments: Any) -> None:
            data, info = arguments[0] if len(arguments) == 1 else arguments
            try:
                stamp, values = judge(
                    data, info["publication_sequence_number"], None if paces else self.now
                )
            except Refusal as refusal:
                self.fault(self.now or 0, refusal.fault, f"{topic.name}: {refusal}")
                return
            if paces:
                self._state_came(stamp, guard)
            handle(stamp, values)

        # two arguments ask for the message's number; the EventsExecutor gives both in one
        read.__signature__ = inspect.signature(lambda data, info: None)
        subscription = self.create_subscription(
            message_type, topic.name, read, self.loop_quality(), raw=True
        )
        self._opened.append(partial(self.destroy_subscription, subscription))

    def _state_came(self, stamp: int, guard: Guard) -> None:
        """Keep the time of the flight; a stamp that goes back starts a new one."""
        self.health.state_came()
        if self.realtime:
            self._state_heard = time.monotonic_ns()
            self._state_lost = False
        if self.now is not None and stamp <= self.now:
            for other in self._judges:
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
        return Stepwise(inputs, ready).put

    def receive_together(
        self, answer: Callable[..., None], fallbacks: Mapping[LoopTopic, Fallback]
    ) -> None:
        """Subscribe to the state and other loop topics; `answer(stamp, state, ...)` gets a step's.

        `fallbacks` names the other topics, and what stands in for each in real time.
        """
        topics = (STATE, *fallbacks)
        put = self.join(
            [topic.name for topic in topics],
            answer,
            {topic.name: fallback for topic, fallback in fallbacks.items()},
        )
        for topic in topics:
            self.receive(topic, partial(put, topic.name))

    def _missing(self, stamp: int, name: str) -> None:
        self.fault(stamp, Fault.INPUT_MISSING, name)

    # Health

    def fault(self, stamp: int, fault: Fault, text: str, times: int = 1) -> None:
        """Count a fault; tell of the first of its kind in every second."""
        if self.health.count(fault, times):
            name = fault.name.lower().replace("_", " ")
            self.announce(stamp, ERROR if fault.value.error else WARN, f"{name}: {text}")

    def announce(self, stamp: int, level: bytes, text: str, **facts: object) -> None:
        """Publish a diagnostic status at `stamp` [ns]."""
        status = DiagnosticStatus(
            level=level,
            name=self.get_fully_qualified_name(),
            message=text,
            hardware_id="ahv",
            values=[KeyValue(key=key, value=str(value)) for key, value in facts.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, NANOSECONDS)
        self._diagnostics.publish(message)

    def report_health(self, stamp: int) -> None:
        """Publish what happened since the last report."""
        level, text, facts = self.health.report()
        if self._state_lost:
            level, text = ERROR, "no state"
        self.announce(stamp, level, text, **facts)

    def _watch(self) -> None:
        """Once a second in real time: look for a state that has gone, report, tidy up."""
        silent = time.monotonic_ns() - self._state_heard
        if self._state_heard and silent > STATE_LOST_AFTER and not self._state_lost:
            self._state_lost = True
            self.fault(self.now or 0, Fault.STATE_LOST, f"none for {silent * 1e-9:.1f} s")
        self.report_health(self.now or 0)
        gc.collect(0)
