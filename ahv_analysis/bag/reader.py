# Copyright 2026 ahv developers, Apache-2.0
"""Reading a bag back as arrays: ours, or any that rosbag2 recorded as MCAP."""

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zstandard
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from ahv_analysis.bag.mcap_scan import HEAD, Block, Damage, Piece, scan
from ahv_analysis.bag.metadata import NOTES, missing_files, read_metadata
from ahv_analysis.bag.record import Array, FlightRecord
from ahv_analysis.errors import BagError
from ahv_msgs_py.layout import MessageError
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    DISTURBANCE_ESTIMATE,
    LEARNER,
    LEARNER_TOPICS,
    LOOP_TOPICS,
    NAMESPACE,
    NOMINAL_TOPICS,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
    LoopTopic,
    ViewerTopic,
    relative,
    within,
)


class Recorded(NamedTuple):
    """A topic of a bag, its messages in the order of the file."""

    type_name: str
    log_times: list[int]  # [ns] simulated time in our bags, time of arrival in those of rosbag2
    messages: list[bytes]  # CDR


class Bag(NamedTuple):
    """What a bag holds, every checksum found right."""

    path: Path
    metadata: dict[str, Any]  # of metadata.yaml
    topics: dict[str, Recorded]  # by name, those without messages too
    namespace: str = NAMESPACE  # of the vehicle that flew

    def name(self, topic: LoopTopic | ViewerTopic) -> str:
        """Name of a topic in this bag."""
        return within(self.namespace, topic.name)

    def recorded(self, topic: LoopTopic | ViewerTopic) -> Recorded | None:
        """What the bag holds of a topic."""
        return self.topics.get(self.name(topic))


def read_bag(path: Path) -> FlightRecord:
    """The flight in the bag folder `path`; BagError says in one sentence what is wrong with it.

    Only steps with a state and all its answers are returned, in the order of their stamps.
    """
    return flight_of(load_bag(path))


def load_bag(path: Path) -> Bag:
    """All messages of the bag folder `path`; BagError says in one sentence what is wrong."""
    metadata = read_metadata(path)
    missing = missing_files(path, metadata)
    if missing:
        raise BagError(f"{path} lacks its {', '.join(missing)}")
    mode = str(metadata.get("compression_mode") or "").lower()
    topics: dict[str, Recorded] = {}
    for name in metadata["relative_file_paths"]:
        try:
            data = (path / name).read_bytes()
            if mode == "file":
                data = _decompressed(data)
        except (OSError, zstandard.ZstdError) as error:
            raise BagError(f"{path} cannot be read: {error}") from error
        pieces = list(scan(data))
        for piece in pieces:
            if isinstance(piece, Damage):
                raise BagError(
                    f"{path} is not whole: {name}: {piece.what}, from byte {piece.offset} of "
                    f"{len(data)}; `ahv bag recover {path}` gives what is"
                )
        _collect(pieces, topics)
    if mode == "message":
        for recorded in topics.values():
            recorded.messages[:] = map(_decompressed, recorded.messages)
    return Bag(path, metadata, topics, _namespace(path, topics))


def _namespace(path: Path, topics: Mapping[str, Recorded]) -> str:
    """Namespace of the vehicle that a bag is of: where its state and its surface command are."""
    found = [
        namespace
        for name in topics
        for namespace in [name.removesuffix(f"/{relative(STATE.name)}")]
        if name == within(namespace, STATE.name)
        and all(
            (recorded := topics.get(within(namespace, topic.name))) and recorded.messages
            for topic in (STATE, SURFACE_COMMAND)
        )
    ]
    if len(found) > 1:
        raise BagError(
            f"{path} holds the flights of {len(found)} vehicles, {' and '.join(sorted(found))}: "
            "record each into a bag of its own"
        )
    return found[0] if found else NAMESPACE


def _collect(pieces: Sequence[Piece], topics: dict[str, Recorded]) -> None:
    """Add the messages of a whole file to `topics`."""
    schemas = {piece.id: piece.name for piece in pieces if isinstance(piece, Schema)}
    channels: dict[int, Recorded] = defaultdict(lambda: Recorded("", [], []))  # nameless ones
    for piece in pieces:
        if isinstance(piece, Channel):
            empty = Recorded(schemas.get(piece.schema_id, ""), [], [])
            channels[piece.id] = topics.setdefault(piece.topic, empty)
    for piece in pieces:
        if isinstance(piece, Block):
            records = piece.records
            for channel, log_time, start, end in piece.messages:
                recorded = channels[channel]
                recorded.log_times.append(log_time)
                recorded.messages.append(records[start + HEAD : end])


def flight_of(bag: Bag) -> FlightRecord:
    """The flight in a bag, as `read_bag` gives it."""
    series = {topic: _series(bag, topic) for topic in LOOP_TOPICS}
    missing = [bag.name(topic) for topic in required_topics(bag) if not len(series[topic][0])]
    if missing:
        held = ", ".join(name for name, topic in bag.topics.items() if topic.messages)
        raise BagError(
            f"{bag.path} holds no messages on {', '.join(missing)}, "
            f"but {f'on {held}' if held else 'none at all'}"
        )
    flown = {topic: found for topic, found in series.items() if len(found[0])}
    stamps = next(iter(flown.values()))[0]
    for found, _ in flown.values():
        stamps = np.intersect1d(stamps, found, assume_unique=True)
    if not len(stamps):
        raise BagError(f"{bag.path} holds no step with all of its messages")
    arrays = {
        topic: values[np.searchsorted(found, stamps)] for topic, (found, values) in flown.items()
    }
    estimates = arrays.get(DISTURBANCE_ESTIMATE)
    return FlightRecord(
        stamps,
        arrays[STATE],
        arrays[ATTITUDE_COMMAND],
        arrays[RATE_COMMAND],
        arrays[SURFACE_COMMAND],
        arrays[THROTTLE_COMMAND][:, 0],
        _geometric(bag),
        arrays.get(LEARNER),
        None if estimates is None else estimates[:, 3:],
    )


def required_topics(bag: Bag) -> Sequence[LoopTopic]:
    """Topics of the loop that flew: of the learner too, if the notes say so or one is there."""
    notes = notes_of(bag.metadata)
    adaptive = notes is not None and notes["parameters"]["inner_loop"]["adaptive"]
    there = {name for name, topic in bag.topics.items() if topic.messages}
    learned = any(bag.name(topic) in there for topic in LEARNER_TOPICS)
    return LOOP_TOPICS if adaptive or learned else NOMINAL_TOPICS


def read_notes(path: Path) -> dict[str, Any] | None:
    """What `ahv fly` filed with a bag: the case and its parameters; None in other bags."""
    return notes_of(read_metadata(path))


def notes_of(metadata: dict[str, Any]) -> dict[str, Any] | None:
    """Notes of `ahv fly` in the metadata of a bag, or None."""
    try:
        notes = json.loads(metadata["custom_data"][NOTES])
    except (ValueError, KeyError, TypeError):
        return None  # a recorder of somebody else's, or none of our notes
    ours = isinstance(notes, dict) and {"case", "parameters"} <= notes.keys()
    return notes if ours and {"plant", "inner_loop"} <= notes["parameters"].keys() else None


def _decompressed(data: bytes) -> bytes:
    plain: bytes = zstandard.ZstdDecompressor().decompressobj().decompress(data)
    return plain


def _series(bag: Bag, topic: LoopTopic) -> tuple[NDArray[np.int64], Array]:
    """Stamps (n,) [ns] in ascending order and values (n, fields) of a topic."""
    width = len(topic.layout.fields)
    recorded = bag.recorded(topic)
    if recorded is None or not recorded.messages:
        return np.empty(0, np.int64), np.empty((0, width))
    if recorded.type_name != topic.layout.type_name:
        raise BagError(
            f"{bag.path}: {bag.name(topic)} is of type {recorded.type_name}, "
            f"but must be {topic.layout.type_name}"
        )
    messages = recorded.messages
    stamps, values, places = topic.layout.decode_all(messages)
    if len(places) < len(messages):
        others = np.setdiff1d(np.arange(len(messages)), places)
        try:
            read = [_general(topic, messages[place]) for place in others]
        except MessageError as error:
            raise BagError(f"{bag.path}: {bag.name(topic)}: {error}") from error
        stamps = np.concatenate((stamps, [stamp for stamp, _ in read]))
        values = np.concatenate((values, [row for _, row in read]))
    stamps, first, again = np.unique(stamps, return_index=True, return_inverse=True)
    if len(first) < len(messages) and values[first][again].tobytes() != values.tobytes():
        raise BagError(
            f"{bag.path} holds more than one flight, or messages of another publisher: "
            f"two messages on {bag.name(topic)} differ and have one stamp"
        )
    return stamps, values[first]


def _general(topic: LoopTopic, data: bytes) -> tuple[int, tuple[float, ...]]:
    """Read a message of another sender, whose layout is not the usual one.

    By rclpy and not by rosbags, which refuses the surplus bytes that rclpy leaves behind the end;
    only such a bag needs ROS to be read.
    """
    try:
        import rclpy
        from rclpy.serialization import deserialize_message

        from ahv_msgs_py.node.messages import message_class
    except ModuleNotFoundError as error:
        raise MessageError("a message of another sender, which only ROS can read") from error
    try:
        message = deserialize_message(data, message_class(topic.layout.type_name))
    except rclpy._rclpy_pybind11.RMWError as error:
        raise MessageError("a message whose bytes are none of the topic's type") from error
    return topic.layout.values_of(message)


def _geometric(bag: Bag) -> bool:
    """Which altitude the flight used; a bag without notes is taken to use the default."""
    notes = notes_of(bag.metadata)
    return notes is not None and bool(notes["parameters"]["plant"]["geometric_altitude"])
