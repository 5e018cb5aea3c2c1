# Copyright 2026 ahv developers, Apache-2.0
"""What a replay takes from a bag: the messages of the loop by their stamps, changes in flight."""

from ast import literal_eval
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from struct import Struct
from struct import error as StructError
from typing import Any, NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message

from ahv_analysis.bag.reader import Recorded, load_bag, notes_of
from ahv_msgs_py.layout import NANOSECONDS, MessageError
from ahv_msgs_py.node.guard import Guard, Refusal
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import DIAGNOSTICS, LOOP_TOPICS, LoopTopic
from ahv_plant.model.constants import STEP_NS

LEARNER_NODE = "disturbance_learner"
CHANGED = "parameters changed"  # how a node announces a change, with the values and the stamp
ONE_VOICE = b""  # a bag does not tell who published a message
_STAMPS = {1: Struct("<iI"), 0: Struct(">iI")}  # by the second byte of a message: its byte order


class Message(NamedTuple):
    """A recorded message: as it crosses a topic, and what it says."""

    data: bytes  # CDR
    values: Values


class Change(NamedTuple):
    """Parameters that a node got in flight."""

    stamp: int  # [ns] of the first input that must meet the new values
    node: str
    values: dict[str, Value]


class Recording(NamedTuple):
    """What a bag holds of the control loop."""

    path: Path
    notes: dict[str, Any] | None  # what `ahv fly` filed with it
    topics: dict[LoopTopic, dict[int, Message]]  # by stamp [ns], rising; topics with messages only
    changes: list[Change]
    refused: int  # messages that no receiver obeys
    namespace: str  # of the vehicle that flew


def read_recording(path: Path) -> Recording:
    """The control loop in the bag folder `path`, ordered by stamps, whatever the order of filing.

    Raises BagError for what cannot be read.
    """
    bag = load_bag(path)
    topics: dict[LoopTopic, dict[int, Message]] = {}
    refused = 0
    for topic in LOOP_TOPICS:
        recorded = _messages(bag.recorded(topic), topic.layout.type_name)
        obeyed = _obeyed(topic, recorded)
        refused += len(recorded) - len(obeyed)
        if obeyed:
            topics[topic] = obeyed
    diagnostics = _messages(bag.recorded(DIAGNOSTICS), DIAGNOSTICS.type_name)
    changes = _changes(diagnostics, bag.namespace)
    return Recording(path, notes_of(bag.metadata), topics, changes, refused, bag.namespace)


def _messages(recorded: Recorded | None, type_name: str) -> list[bytes]:
    """Messages of a topic, if it is of the type that we know."""
    return recorded.messages if recorded and recorded.type_name == type_name else []


def _obeyed(topic: LoopTopic, recorded: Iterable[bytes]) -> dict[int, Message]:
    """Messages that a receiver obeys, by their stamps; of two with one stamp the first."""

    def general(data: bytes) -> tuple[int, Values]:
        message: Any = _deserialized(data, message_class(topic.layout.type_name))
        return topic.layout.values_of(message)

    guard = Guard(topic, general, clock=lambda: 0, realtime=False, publishers=list)
    obeyed = {}
    for data in sorted(recorded, key=_stamp):
        with suppress(Refusal):
            stamp, values = guard.read(data, ONE_VOICE, None)
            obeyed[stamp] = Message(data, values)
    return obeyed


def _stamp(data: bytes) -> int:
    """Stamp [ns] at the start of a message, -1 if it has none."""
    try:
        seconds, nanoseconds = _STAMPS[data[1] & 1].unpack_from(data, 4)
    except (StructError, IndexError):
        return -1
    return int(seconds * NANOSECONDS + nanoseconds)


def _deserialized(data: bytes, message_type: type) -> Any:
    try:
        return deserialize_message(data, message_type)
    except rclpy._rclpy_pybind11.RMWError as error:
        raise MessageError("the bytes are no message of the topic's type") from error


def _changes(diagnostics: Iterable[bytes], namespace: str) -> list[Change]:
    """Changes of parameters that nodes of a namespace announced, in the order of their stamps."""
    changes = []
    for data in diagnostics:
        with suppress(MessageError):
            message = _deserialized(data, DiagnosticArray)
            stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
            for status in message.status:
                where, _, node = status.name.rpartition("/")
                if (where, status.message) == (namespace, CHANGED):
                    # the learner goes through step k when state k + 1 comes
                    first = stamp + STEP_NS if node == LEARNER_NODE else stamp
                    values = {fact.key: _value(fact.value) for fact in status.values}
                    changes.append(Change(first, node, values))
    return sorted(changes, key=lambda change: change.stamp)


def _value(text: str) -> Value:
    """Value of a parameter as `str` wrote it."""
    with suppress(ValueError, SyntaxError):
        value = literal_eval(text)
        if isinstance(value, bool | int | float):
            return value
    return text
