# Copyright 2026 ahv developers, Apache-2.0
"""Messages as ROS's own classes, for what is not a loop topic of constant layout."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.serialization import deserialize_message

from ahv_msgs_py.layout import NANOSECONDS, Layout, MessageError
from ahv_msgs_py.node.rclpy_internals import RMWError


def message_class(type_name: str) -> Any:
    """Class of a message type like `sensor_msgs/msg/JointState`; ModuleNotFoundError if none."""
    package, _, name = type_name.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def general_reader(layout: Layout) -> Callable[[bytes], tuple[int, tuple[float, ...]]]:
    """Return what reads a message of the topic's type, but of another layout than ours.

    It gives the stamp [ns] and the values, in their units; MessageError if the bytes are none.
    """
    message_type = message_class(layout.type_name)

    def read(data: bytes) -> tuple[int, tuple[float, ...]]:
        try:
            message = deserialize_message(data, message_type)
        except RMWError as error:
            raise MessageError("the bytes are no message of the topic's type") from error
        return layout.values_of(message)

    return read


def diagnostics(
    stamp: int, name: str, level: bytes, text: str, facts: Mapping[str, object]
) -> DiagnosticArray:
    """Diagnostic status of the node `name` at `stamp` [ns]."""
    status = DiagnosticStatus(
        level=level,
        name=name,
        message=text,
        hardware_id="ahv",
        values=[KeyValue(key=key, value=str(value)) for key, value in facts.items()],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, NANOSECONDS)
    return message
