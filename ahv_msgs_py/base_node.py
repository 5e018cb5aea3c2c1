"""The shell that all nodes share: parameters, topics as exact bytes, diagnostics, start, end."""

import os
import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.task import Future

from ahv_msgs_py.layout import NANOSECONDS, MessageError
from ahv_msgs_py.parameters import (
    SHARED,
    Parameter,
    ParameterError,
    Value,
    check_parameters,
)
from ahv_msgs_py.stepwise import Stepwise, Values
from ahv_msgs_py.topics import DIAGNOSTICS, NAMESPACE, QUEUE_DEPTH, LoopTopic


def _quality(durability: DurabilityPolicy) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=QUEUE_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


QOS = _quality(DurabilityPolicy.TRANSIENT_LOCAL)
VOLATILE_QOS = _quality(DurabilityPolicy.VOLATILE)
FOREVER = 1e6  # [s] the executor must wait with a finite time, or it spins and is deaf to signals

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


def message_class(type_name: str) -> Any:
    """Class of a message type like `sensor_msgs/msg/JointState`; ModuleNotFoundError if none."""
    package, _, name = type_name.split("/")
    return getattr(import_module(f"{package}.msg"), name)


class BaseNode(Node):
    """A node of the graph, without its law.

    `finished` is the future that ends the process; a node that runs until it is stopped leaves it.
    """

    def __init__(
        self,
        name: str,
        parameters: Sequence[Parameter],
        values: dict[str, Value] | None = None,
        context: rclpy.Context | None = None,
    ):
        """`values` overrides parameters, as a YAML file of `--params-file` does."""
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
        self.settings = self._declare(name, parameters)
        self._diagnostics = self.create_publisher(DiagnosticArray, DIAGNOSTICS.name, QOS)
        self._reported: tuple[bytes, str] | None = None

    def _declare(self, name: str, parameters: Sequence[Parameter]) -> dict[str, Value]:
        """Check the given parameters, then declare them all with description, unit and range."""
        own = {parameter.name for parameter in parameters}
        ignored = {"use_sim_time", "start_type_description_service", *SHARED} - own
        given = {
            key: parameter.value
            for key, parameter in self.get_parameters_by_prefix("").items()
            if key not in ignored and not key.startswith("qos_overrides.")
        }
        values = check_parameters(name, parameters, given)
        for parameter in parameters:
            if self.has_parameter(parameter.name):
                self.undeclare_parameter(parameter.name)
            descriptor = ParameterDescriptor(
                description=f"{parameter.description} [{parameter.unit or '-'}]", read_only=True
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

    def sender(
        self, topic: LoopTopic, matched: Callable[[Any], None] | None = None
    ) -> Callable[[int, Sequence[float]], None]:
        """Advertise a loop topic; the returned function publishes values at a stamp [ns]."""
        encode = topic.layout.encode
        publish = self._publisher(topic, matched).publish
        return lambda stamp, values: publish(encode(stamp, values))

    def _publisher(self, topic: LoopTopic, matched: Callable[[Any], None] | None) -> Publisher:
        return self.create_publisher(
            message_class(topic.layout.type_name),
            topic.name,
            QOS,
            event_callbacks=PublisherEventCallbacks(matched=matched),
        )

    def receive(self, topic: LoopTopic, handle: Callable[[int, Values], None]) -> None:
        """Subscribe to a loop topic; `handle(stamp, values)` gets every message that fits it."""
        message_type = message_class(topic.layout.type_name)
        decode = topic.layout.decode

        def read(data: bytes) -> None:
            known = decode(data)
            if known is None:
                try:
                    known = topic.layout.values_of(deserialize_message(data, message_type))
                except MessageError as error:
                    self.get_logger().error(f"{topic.name}: ignored a message: {error}")
                    return
            handle(*known)

        self.create_subscription(message_type, topic.name, read, QOS, raw=True)

    def receive_together(self, topics: Sequence[LoopTopic], answer: Callable[..., None]) -> None:
        """Subscribe to loop topics; `answer(stamp, values, ...)` gets those of one step."""
        inputs = Stepwise([topic.name for topic in topics], answer)
        for topic in topics:
            self.receive(topic, partial(inputs.put, topic.name))

    def report(self, stamp: int, level: bytes, text: str, **facts: object) -> None:
        """Publish a diagnostic status at `stamp` [ns], if it differs from the last one."""
        if (level, text) == self._reported:
            return
        self._reported = (level, text)
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


def run(node_class: Callable[..., BaseNode]) -> None:
    """Entry point of a node: run it until its `finished` is set or a signal comes."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    try:
        rclpy.init()
    except RuntimeError as error:  # arguments that ROS itself refuses
        print(" ".join(str(error).split()), file=sys.stderr)
        sys.exit(2)
    code = 0
    node = None
    executor = EventsExecutor()
    try:
        node = node_class()
        executor.add_node(node)
        executor.spin_until_future_complete(node.finished, FOREVER)
        code = 1 if node.finished.result() else 0
    except ParameterError as error:
        print(error, file=sys.stderr)
        code = 2
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    finally:
        signal.signal(
            signal.SIGINT, signal.SIG_IGN
        )  # a second Ctrl-C must not cut the ending short
        if node is not None:
            executor.remove_node(node)
        executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    sys.exit(code)
