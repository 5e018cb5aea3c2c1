# Copyright 2026 ahv developers, Apache-2.0
"""What a replay takes from a bag: the messages of the loop by their stamps, changes in flight."""

from ast import literal_eval
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message

from ahv_analysis.bag.notes import Notes
from ahv_analysis.bag.reader import read
from ahv_analysis.bag.series import Series
from ahv_msgs_py.layout import NANOSECONDS, MessageError
from ahv_msgs_py.node.rclpy_internals import RMWError
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import DIAGNOSTICS, LoopTopic
from ahv_plant.model.constants import STEP_NS

LONGEST_NUMBER = 40  # characters
LEARNER_NODE = "disturbance_learner"
CHANGED = "parameters changed"  # how a node announces a change, with the values and the stamp


class Change(NamedTuple):
    """Parameters that a node got in flight."""

    stamp: int  # [ns] of the first input that must meet the new values
    node: str
    values: dict[str, Value]


class Recording(NamedTuple):
    """What a bag holds of the control loop."""

    path: Path
    notes: Notes | None  # what `ahv fly` filed with it
    topics: dict[LoopTopic, Series]  # what was obeyed; topics with messages only
    changes: list[Change]
    refused: int  # messages that no receiver obeys
    namespace: str  # of the vehicle that flew


def read_recording(path: Path) -> Recording:
    """The control loop in the bag `path`, ordered by stamps, whatever the order of filing.

    Raises BagError for what cannot be read.
    """
    bag = read(path, keep=[DIAGNOSTICS.name])
    changes = _changes(bag.kept[DIAGNOSTICS.name], bag.namespace)
    refused = sum(entry.messages for entry in bag.refused)
    return Recording(bag.path, bag.notes, bag.series, changes, refused, bag.namespace)


def _deserialized(data: bytes, message_type: type) -> Any:
    try:
        return deserialize_message(data, message_type)
    except RMWError as error:
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
        value = literal_eval(text[:LONGEST_NUMBER])
        if isinstance(value, bool | int | float):
            return value
    return text
