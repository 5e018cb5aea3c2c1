# Copyright 2026 ahv developers, Apache-2.0
"""Reading a bag back as arrays: ours, or any that rosbag2 recorded as MCAP."""

from collections.abc import Collection, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.records import Channel, Metadata, Schema
from numpy.typing import NDArray

from ahv_analysis.bag.files import bag_files
from ahv_analysis.bag.mcap_scan import HEAD, Block, Damage, scan
from ahv_analysis.bag.messages import deserialized
from ahv_analysis.bag.metadata import custom_of_record
from ahv_analysis.bag.notes import Notes, read_notes, told_notes
from ahv_analysis.bag.plain_file import ZSTD_MAGIC, PlainFile, UnpackError
from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Rows, part_of
from ahv_analysis.bag.series import AmbiguousError, Collector, Refused, Series
from ahv_analysis.bag.solver_status import Losses, losses_in, says_a_law
from ahv_analysis.errors import BagError
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    DIAGNOSTICS,
    DISTURBANCE_ESTIMATE,
    LEARNER,
    LEARNER_TOPICS,
    LOOP_TOPICS,
    NAMESPACE,
    NOMINAL_TOPICS,
    RATE_COMMAND,
    REFERENCE,
    SETTINGS,
    STATE,
    SURFACE_COMMAND,
    SURFACES,
    THROTTLE_COMMAND,
    TRUTH,
    LoopTopic,
    relative,
    within,
)

_SETTINGS = relative(SETTINGS.name), SETTINGS.type_name
_LOOP = {relative(topic.name): topic for topic in LOOP_TOPICS}


class BagTopic(NamedTuple):
    """A topic of a bag."""

    type_name: str
    messages: int


class Bag(NamedTuple):
    """What a bag holds, every checksum found right."""

    path: Path
    bytes: int  # of its files
    custom: dict[str, str]  # texts by their keys
    notes: Notes | None  # of its recorder, else of what the nodes told; None if nobody did
    topics: dict[str, BagTopic]  # by name, those without messages too
    series: dict[LoopTopic, Series]  # of the control loop: topics with messages that were obeyed
    refused: list[Refused]  # messages of the control loop that no receiver obeyed
    kept: dict[str, list[bytes]]  # messages of the topics asked for, CDR
    namespace: str  # of the vehicle that flew
    losses: Losses  # of the flight, as its law told of them


class Recorded(NamedTuple):
    """All messages of a topic, in the order of the file."""

    type_name: str
    log_times: list[int]  # [ns] simulated time in our bags, time of arrival in those of rosbag2
    messages: list[bytes]  # CDR


class _Portion(NamedTuple):
    """Messages of one topic that lie together in a bag."""

    topic: str
    type_name: str
    block: Block
    places: NDArray[np.intp]  # in the block
    heads: NDArray[np.void]  # of these messages
    packed: bool  # each for itself, as rosbag2 does
    file: PlainFile

    def bodies(self) -> Iterator[tuple[int, bytes]]:
        """Publisher and CDR of the messages."""
        for place, publisher in zip(self.places, self.heads["publisher"].tolist(), strict=True):
            body = self.block.body(place)
            yield publisher, self.file.room.unpack("zstd", body) if self.packed else body


def read_bag(path: Path) -> FlightRecord:
    """The flight in the bag `path`; BagError says in one sentence what is wrong with it.

    Only steps with a state and all its answers are returned, in the order of their stamps.
    """
    return flight_of(read(path))


def read(path: Path, keep: Collection[str] = ()) -> Bag:
    """What is in the bag `path`, and the messages of the topics `keep`; BagError if it is damaged.

    A message that no receiver obeyed is left out, and counted.
    """
    collectors: dict[str, Collector] = {}
    topics: dict[str, BagTopic] = {}
    own: list[Metadata] = []
    kept: dict[str, list[bytes]] = {name: [] for name in keep}
    diagnostics: list[tuple[int, bytes]] = []  # with the number of their publisher
    told: dict[str, list[bytes]] = {}  # settings of nodes, by topic
    others: dict[str, str] = {}  # topics of the loop with messages of another type
    found = bag_files(path)
    for portion in _portions(found.path, found.files, topics, own):
        name, topic = portion.topic, _LOOP.get(portion.topic.rpartition("/")[2])
        if topic is not None and portion.type_name == topic.layout.type_name:
            if name not in collectors:
                collectors[name] = Collector(topic, name, partial(_general, topic))
            _collect(portion, topic, collectors[name])
        elif topic is not None:
            others[name] = portion.type_name
        elif (name.rpartition("/")[2], portion.type_name) == _SETTINGS:
            told.setdefault(name, []).extend(data for _, data in portion.bodies())
        elif name in kept:
            kept[name] += [data for _, data in portion.bodies()]
        if (name, portion.type_name) == (DIAGNOSTICS.name, DIAGNOSTICS.type_name):
            diagnostics += [entry for entry in portion.bodies() if says_a_law(entry[1])]
    namespace = _namespace(found.path, topics)
    series: dict[LoopTopic, Series] = {}
    refused: list[Refused] = []
    for topic in LOOP_TOPICS:
        name = within(namespace, topic.name)
        if name in collectors:
            collector = collectors.pop(name)
            try:
                obeyed = collector.series()
            except AmbiguousError as error:
                raise BagError(
                    f"{found.path} holds more than one flight, or messages of publishers that it "
                    f"does not tell apart: {error}"
                ) from error
            if len(obeyed.stamps):
                series[topic] = obeyed.sharing(series.values())
            refused += collector.refused
        elif name in others:
            raise BagError(
                f"{found.path}: {name} is of type {others[name]}, "
                f"but must be {topic.layout.type_name}"
            )
    if found.metadata is not None:
        custom = found.metadata.custom
    else:
        custom = custom_of_record(own[0]) if own else {}
    notes = read_notes(custom) or told_notes(told.get(within(namespace, SETTINGS.name), []))
    size = sum(file.stat().st_size for file in found.files)
    return Bag(
        found.path,
        size,
        custom,
        notes,
        topics,
        series,
        refused,
        kept,
        namespace,
        losses_in(diagnostics, namespace),
    )


def _namespace(path: Path, topics: Mapping[str, BagTopic]) -> str:
    """Namespace of the vehicle that a bag is of: where its state and its surface command are."""
    flown = {name for name, topic in topics.items() if topic.messages}
    found = sorted(
        namespace
        for namespace, _, last in (name.rpartition("/") for name in flown)
        if last == relative(STATE.name) and within(namespace, SURFACE_COMMAND.name) in flown
    )
    if len(found) > 1:
        raise BagError(
            f"{path} holds the flights of {len(found)} vehicles, {' and '.join(found[:5])}: "
            "record each into a bag of its own"
        )
    return found[0] if found else NAMESPACE


def load_bag(path: Path) -> dict[str, Recorded]:
    """All messages of the bag `path` by topic, as they are: for bags that memory holds."""
    found = bag_files(path)
    types: dict[str, BagTopic] = {}
    topics: dict[str, Recorded] = {}
    for portion in _portions(found.path, found.files, types, []):
        recorded = topics.setdefault(portion.topic, Recorded(portion.type_name, [], []))
        recorded.log_times.extend(portion.heads["log_time"].tolist())
        recorded.messages.extend(data for _, data in portion.bodies())
    return {name: Recorded(types[name].type_name, [], []) for name in types} | topics


def _portions(
    bag: Path, files: list[Path], topics: dict[str, BagTopic], own: list[Metadata]
) -> Iterator[_Portion]:
    """Messages of a whole bag, in the order of its files; BagError where one is damaged.

    Fills `topics`, and `own` with the last metadata that the files themselves carry.
    """
    for path in files:
        with PlainFile(path) as file:
            schemas: dict[int, str] = {}
            channels: dict[int, tuple[str, str]] = {}
            for piece in scan(file):
                if isinstance(piece, Damage):
                    raise BagError(
                        f"{bag} is not whole: {path.name}: {piece.what}, from byte "
                        f"{piece.offset} of {file.size}; `ahv bag recover {bag}` gives what is"
                    )
                if isinstance(piece, Schema):
                    schemas[piece.id] = piece.name
                elif isinstance(piece, Channel):
                    type_name = schemas.get(piece.schema_id, "")
                    channels[piece.id] = piece.topic, type_name
                    topics.setdefault(piece.topic, BagTopic(type_name, 0))
                elif isinstance(piece, Metadata):
                    own[:] = [piece]
                elif isinstance(piece, Block):
                    try:
                        yield from _by_channel(piece, file, channels, topics)
                    except UnpackError as error:
                        raise BagError(f"{bag} cannot be read: {path.name}: {error}") from error


def _by_channel(
    block: Block,
    file: PlainFile,
    channels: dict[int, tuple[str, str]],
    topics: dict[str, BagTopic],
) -> Iterator[_Portion]:
    heads = block.heads
    for channel in np.unique(heads["channel"]).tolist():
        if channel not in channels:
            continue  # messages without a name
        name, type_name = channels[channel]
        places = np.flatnonzero(heads["channel"] == channel)
        packed = block.body(places[0]).startswith(ZSTD_MAGIC)
        topic = topics[name]  # of a topic with channels of two types, the first with messages
        shown = topic.type_name if topic.messages else type_name
        topics[name] = BagTopic(shown, topic.messages + len(places))
        yield _Portion(name, type_name, block, places, heads[places], packed, file)


def _collect(portion: _Portion, topic: LoopTopic, collector: Collector) -> None:
    """Hand messages to their collector: in one go those that have the length of the layout."""
    if portion.packed:
        for publisher, data in portion.bodies():
            collector.message(data, publisher)
        return
    block, publishers = portion.block, portion.heads["publisher"]
    lengths = block.ends[portion.places] - block.starts[portion.places]
    usual = lengths - HEAD == topic.layout.size
    collector.rows(block.bodies(portion.places[usual], topic.layout.size), publishers[usual])
    for place, publisher in zip(portion.places[~usual], publishers[~usual].tolist(), strict=True):
        collector.message(block.body(place), publisher)


def flight_of(bag: Bag) -> FlightRecord:
    """The flight in a bag, as `read_bag` gives it."""
    missing = [
        within(bag.namespace, topic.name) for topic in _required(bag) if topic not in bag.series
    ]
    if missing:
        there = ", ".join(name for name, topic in bag.topics.items() if topic.messages)
        refused = [entry for entry in bag.refused if entry.topic in missing]
        why = f"; {refused[0].messages} were refused, first {refused[0].first}" if refused else ""
        raise BagError(
            f"{bag.path} holds no messages on {', '.join(missing)}, "
            f"but {f'on {there}' if there else 'none at all'}{why}"
        )
    stamps = bag.series[STATE].stamps
    for found, _ in bag.series.values():
        if not np.array_equal(stamps, found):
            stamps = np.intersect1d(stamps, found, assume_unique=True)
    if not len(stamps):
        raise BagError(f"{bag.path} holds no step with all of its messages")
    rows = {topic: _at(found, stamps) for topic, found in bag.series.items()}
    estimates = rows.get(DISTURBANCE_ESTIMATE)
    truth = rows.get(TRUTH)
    return FlightRecord(
        stamps,
        rows[STATE] if truth is None else truth,
        rows[ATTITUDE_COMMAND],
        rows[RATE_COMMAND],
        rows[SURFACE_COMMAND],
        rows[THROTTLE_COMMAND][:, 0],
        bag.notes is not None and bag.notes.geometric,
        rows.get(LEARNER),
        None if estimates is None else part_of(estimates, slice(None), slice(3, None)),
        bag.losses.surfaces,
        None if truth is None else rows[STATE],
        rows.get(SURFACES),
        rows.get(REFERENCE),
        bag.losses.law,
    )


def _at(found: Series, stamps: NDArray[np.int64]) -> Rows:
    """Values at stamps that are all there."""
    if len(found.stamps) == len(stamps):
        return found.values
    return part_of(found.values, np.searchsorted(found.stamps, stamps))


def _required(bag: Bag) -> tuple[LoopTopic, ...]:
    """Topics of the loop that flew: of the learner too, if the notes say so or one is there."""
    adaptive = bag.notes is not None and bag.notes.adaptive
    learned = any(topic in bag.series for topic in LEARNER_TOPICS)
    return NOMINAL_TOPICS + LEARNER_TOPICS if adaptive or learned else NOMINAL_TOPICS


def _general(topic: LoopTopic, data: bytes) -> tuple[int, tuple[float, ...]]:
    """Read a message of another sender, whose layout is not the usual one."""
    return topic.layout.values_of(deserialized(data, topic.layout.type_name))
