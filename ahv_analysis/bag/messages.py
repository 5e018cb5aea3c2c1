# Copyright 2026 ahv developers, Apache-2.0
"""Messages of any type as objects, without a ROS installation."""

from struct import error as StructError
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from ahv_msgs_py.layout import MessageError

STORE = get_typestore(Stores.ROS2_JAZZY)


def deserialized(data: bytes, type_name: str) -> Any:
    """The message in CDR bytes; MessageError if they are none of the type.

    With the reader of rosbags, though not through its front door, which refuses the surplus bytes
    that rclpy leaves behind the end.
    """
    if data[:2] not in (b"\x00\x00", b"\x00\x01"):
        raise MessageError("a message of an unknown encoding")
    definition = STORE.get_msgdef(type_name)
    read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
    try:
        message, _ = read(data[4:], 0, definition.cls, STORE)
    except (SerdeError, StructError, ValueError, IndexError) as error:
        raise MessageError("a message whose bytes are none of the topic's type") from error
    return message
