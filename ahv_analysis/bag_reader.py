"""Reading a bag back as arrays."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.errors import ReaderError

from ahv_analysis.bag_writer import NOTES
from ahv_analysis.errors import BagError
from ahv_analysis.record import FlightRecord
from ahv_msgs_py.layout import MessageError
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    DISTURBANCE_ESTIMATE,
    LEARNER,
    LOOP_TOPICS,
    NOMINAL_TOPICS,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
    LoopTopic,
)


def read_bag(path: Path) -> FlightRecord:
    """The flight in the bag folder `path`; BagError says in one sentence what is wrong with it.

    Only steps with a state and all its answers are returned, in the order of their stamps.
    """
    if not (path / "metadata.yaml").is_file():
        raise BagError(f"{path} is not a bag: a bag is a folder with a metadata.yaml")
    try:
        with Reader(path) as reader:
            series = {topic.name: _series(reader, topic) for topic in LOOP_TOPICS}
    except (ReaderError, MessageError, OSError, KeyError, ValueError, AssertionError) as error:
        raise BagError(
            f"{path} cannot be read as a bag: {' '.join(str(error).split())}"
        ) from error
    missing = [topic.name for topic in NOMINAL_TOPICS if not series[topic.name]]
    if missing:
        raise BagError(f"{path} holds no messages on {', '.join(missing)}")
    flown = {name: messages for name, messages in series.items() if messages}
    stamps = sorted(set.intersection(*(set(messages) for messages in flown.values())))
    arrays = {
        name: np.array([messages[stamp] for stamp in stamps]) for name, messages in flown.items()
    }
    estimates = arrays.get(DISTURBANCE_ESTIMATE.name)
    return FlightRecord(
        np.array(stamps),
        arrays[STATE.name],
        arrays[ATTITUDE_COMMAND.name],
        arrays[RATE_COMMAND.name],
        arrays[SURFACE_COMMAND.name],
        arrays[THROTTLE_COMMAND.name][:, 0],
        _geometric(path),
        arrays.get(LEARNER.name),
        None if estimates is None else estimates[:, 3:],
    )


def read_notes(path: Path) -> dict[str, Any] | None:
    """What `ahv fly` filed with a bag: the case and its parameters; None in other bags."""
    try:
        metadata = yaml.safe_load((path / "metadata.yaml").read_text(encoding="utf-8"))
        notes = json.loads(metadata["rosbag2_bagfile_information"]["custom_data"][NOTES])
    except (yaml.YAMLError, ValueError, KeyError, TypeError):
        return None  # a recorder of somebody else's, or none of our notes
    ours = isinstance(notes, dict) and {"case", "parameters"} <= notes.keys()
    return notes if ours else None


def _series(reader: Reader, topic: LoopTopic) -> dict[int, tuple[float, ...]]:
    """Values of a topic by stamp [ns]."""
    connections = [
        connection
        for connection in reader.connections
        if (connection.topic, connection.msgtype) == (topic.name, topic.layout.type_name)
    ]
    return dict(
        topic.layout.decode(data) or _general(topic, data)
        for _, _, data in reader.messages(connections)
    )


def _general(topic: LoopTopic, data: bytes) -> tuple[int, tuple[float, ...]]:
    """Read a message of another sender, whose layout is not the usual one.

    By rclpy and not by rosbags, which refuses the surplus bytes that rclpy leaves behind the end;
    only such a bag needs ROS to be read.
    """
    from rclpy.serialization import deserialize_message

    from ahv_msgs_py.base_node import message_class

    return topic.layout.values_of(deserialize_message(data, message_class(topic.layout.type_name)))


def _geometric(path: Path) -> bool:
    """Which altitude the flight used; a bag without notes is taken to use the default."""
    notes = read_notes(path)
    return notes is not None and bool(notes["parameters"]["plant"]["geometric_altitude"])
