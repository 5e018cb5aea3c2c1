# Copyright 2026 ahv developers, Apache-2.0
"""Writing a bag: message bytes as they come, in chunks."""

import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from importlib.metadata import version
from itertools import groupby
from math import ceil
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Schema
from numpy.typing import NDArray
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.typesys import Stores, get_typestore

from ahv_analysis.bag.mcap_file import Index, McapFile
from ahv_analysis.bag.metadata import (
    BagFile,
    Topic,
    bag_metadata,
    metadata_record,
    qos_text,
    write_metadata,
)
from ahv_analysis.bag.notes import NOTES
from ahv_analysis.errors import BagError
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.topics import (
    FLIGHT,
    LEARNER_TOPICS,
    NOMINAL_TOPICS,
    QUEUE_DEPTH,
    SPECIAL_TOPICS,
    VIEWER_TOPICS,
)

_FOREVER = QosTime(9223372036, 854775807)  # RMW_DURATION_INFINITE, as rosbag2 writes it
_QOS = Qos(
    QosHistory.KEEP_LAST,
    QUEUE_DEPTH,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    _FOREVER,
    _FOREVER,
    QosLiveliness.AUTOMATIC,
    _FOREVER,
    False,
)
ONE_PUBLISHER = 1
LONGEST = 1000  # messages of a topic in one chunk: what a damaged chunk takes with it
_SPECIAL = {topic.name: topic.layout.type_name for topic in SPECIAL_TOPICS}
_Chunk = tuple[bytes, Index]  # message records, and where they are
_STAMP = np.dtype([("seconds", "<i4"), ("nanoseconds", "<u4")])


class _Inbox(NamedTuple):
    """Messages of a topic that are not in a chunk yet."""

    channel: int
    stamp_offset: int | None  # [bytes]
    messages: list[bytes]
    publishers: list[int]  # of each message


class BagWriter:
    """A new bag with a connection for every topic of the graph.

    Messages are filed under simulated time: their own stamp, or the last one seen where a type has
    none, so that two bags of one flight are alike and play back at the vehicle's pace.

    `flush` makes chunks of what has come and writes them; in the `background` a thread compresses
    and writes them, so that nobody ever waits for the disk. That is for real time: beside a flight
    as fast as it can, a thread contends for the interpreter, at several times what it does there.
    When the disk fails, `failure` says so in one sentence, `write` and `close` raise it, and what
    is on disk stays.
    """

    def __init__(
        self,
        path: Path,
        notes: str = "",
        background: bool = False,
        names: Mapping[str, str] | None = None,
    ):
        """Create the bag folder `path`; BagError if it exists or cannot be made.

        `notes` are filed with the bag; `ahv fly` writes the parameters of the flight there as
        JSON. `names` are those of the topics of a vehicle that flies in another namespace.
        """
        self.path = path
        self.counts: dict[str, int] = {}
        self.failure: BagError | None = None
        self._custom = {NOTES: notes}
        self._name = f"{path.name}.mcap"
        self._names = names or {}
        self.now = 0  # [ns] latest stamp
        self._inboxes: dict[str, _Inbox] = {}
        self._topics: dict[int, Topic] = {}
        self._schemas: dict[str, int] = {}  # numbers of the types
        try:
            path.mkdir(parents=True)
            try:
                self._file = McapFile(path / self._name, f"ahv {version('ahv')}")
                self._begin()
            except OSError:
                shutil.rmtree(path)  # it was made here
                raise
        except FileExistsError as error:
            raise BagError(f"cannot write a bag to {path}: it exists already") from error
        except OSError as error:
            raise BagError(f"cannot write a bag to {path}: {error.strerror}") from error
        self._pending: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._thread: Thread | None = None
        if background:
            self._thread = Thread(target=self._work, name="bag writer", daemon=True)
            self._thread.start()

    def _begin(self) -> None:
        """File notes, message definitions and topics, before any message."""
        self._file.add_metadata(metadata_record(self._metadata()))
        for loop in (*NOMINAL_TOPICS, *LEARNER_TOPICS, FLIGHT):
            self._room(loop.name, loop.layout.type_name, 4)()
        for viewer in VIEWER_TOPICS:
            self._room(viewer.name, viewer.type_name, viewer.stamp_offset)()
        self.counts |= dict.fromkeys(_SPECIAL, 0)

    def _room(self, name: str, type_name: str, stamp_offset: int | None) -> Callable[[], None]:
        """Make room for the messages of a topic; what is returned files the topic itself."""
        known = type_name in self._schemas
        schema = self._schemas.setdefault(type_name, len(self._schemas) + 1)
        definition, hashed = _definition(type_name)
        topic = Topic(self._names.get(name, name), type_name, qos_text([_QOS]), hashed)
        channel = topic.channel(len(self._topics) + 1, schema)
        self._topics[channel.id] = topic
        self._inboxes[name] = _Inbox(channel.id, stamp_offset, [], [])
        self.counts[name] = 0

        def file() -> None:
            if not known:
                self._file.add_schema(Schema(schema, definition, "ros2msg", type_name))
            self._file.add_channel(channel)

        return file

    def write(self, topic: str, *messages: bytes, publishers: Sequence[int] = ()) -> None:
        """File messages of CDR bytes; BagError once the disk has failed.

        `publishers` are numbers of who sent each, from 1 on, by which a reader tells them apart;
        if not given, all messages are of one.
        """
        if self.failure is not None:
            raise self.failure
        if topic not in self._inboxes:  # only some flights have it
            self._do(self._room(topic, _SPECIAL[topic], 4))
        inbox = self._inboxes[topic]
        inbox.messages.extend(messages)
        inbox.publishers.extend(publishers or [ONE_PUBLISHER] * len(messages))
        self.counts[topic] += len(messages)

    def flush(self) -> None:
        """Bring what has come to the disk, or on its way there in the background."""
        if self.failure is None and not (self.path / self._name).exists():
            end = self._file.contents.end / NANOSECONDS
            self.failure = BagError(f"the bag {self.path} was deleted at {end:g} s of the flight")
        most = max(len(inbox.messages) for inbox in self._inboxes.values())
        for _ in range(ceil(most / LONGEST)):
            self._do(partial(self._file.add_chunk, *self._chunk()))

    def annotate(self, notes: str) -> None:
        """File notes in place of those before; a bag that is cut off has them as well."""
        self._custom[NOTES] = notes
        self._do(partial(self._file.add_metadata, metadata_record(self._metadata())))

    def close(self) -> None:
        """Write index and metadata; after this the bag is complete. BagError if it cannot be."""
        self.flush()
        if self._thread is not None:
            self._pending.put(None)
            self._thread.join()
        self._guarded(self._finish)
        if self.failure is not None:
            self._file.close()
            raise self.failure

    def _do(self, task: Callable[[], None]) -> None:
        """Have the disk written to, here or in the background."""
        if self._thread is None:
            self._guarded(task)
        else:
            self._pending.put(task)

    def _work(self) -> None:
        for task in iter(self._pending.get, None):
            self._guarded(task)

    def _guarded(self, task: Callable[[], None]) -> None:
        if self.failure is not None:
            return
        try:
            task()
        except OSError as error:
            end = self._file.contents.end / NANOSECONDS
            self.failure = BagError(
                f"the bag {self.path} ends at {end:g} s of the flight: {error.strerror}; "
                f"`ahv bag recover {self.path}` gives what it has"
            )

    def _finish(self) -> None:
        self._file.add_metadata(metadata_record(self._metadata()))
        self._file.finish()
        write_metadata(self.path, self._metadata())

    def _metadata(self) -> dict[str, object]:
        file = BagFile(self._name, self._file.contents, self._topics)
        return bag_metadata([file], self._custom)

    def _chunk(self) -> _Chunk:
        """Take messages topic by topic; the index tells their order."""
        parts: list[bytes] = []
        index: dict[int, NDArray[np.uint64]] = {}
        size = 0
        for channel, stamp_offset, inbox, numbers in self._inboxes.values():
            messages, publishers = inbox[:LONGEST], numbers[:LONGEST]
            del inbox[: len(messages)], numbers[: len(messages)]
            entries: list[NDArray[np.uint64]] = []
            done = 0
            for length, group in groupby(messages, len):
                run = list(group)
                rows = _rows(channel, run, length)
                rows["publisher"] = publishers[done : done + len(run)]
                done += len(run)
                times = self._times(rows["data"], stamp_offset)
                rows["log_time"] = rows["publish_time"] = times
                offsets = size + rows.itemsize * np.arange(len(rows), dtype=np.uint64)
                entries.append(np.column_stack((times, offsets)))
                parts.append(rows.tobytes())
                size += rows.nbytes
            if entries:
                index[channel] = np.concatenate(entries)
        return b"".join(parts), index

    def _times(self, data: NDArray[np.uint8], offset: int | None) -> NDArray[np.uint64]:
        """Log times (n,) [ns] of the messages `data` (n, length)."""
        if offset is None or data.shape[1] < offset + _STAMP.itemsize:
            return np.full(len(data), self.now, np.uint64)
        stamp = np.ascontiguousarray(data[:, offset : offset + _STAMP.itemsize])
        fields = stamp.view(_STAMP)[:, 0]
        stamps = fields["seconds"].astype(np.int64) * NANOSECONDS + fields["nanoseconds"]
        self.now = max(self.now, int(stamps.max()))
        return np.maximum(stamps, 0).astype(np.uint64)


@cache
def _definition(type_name: str) -> tuple[bytes, str]:
    """Definition of a type of messages, and its hash."""
    store = get_typestore(Stores.ROS2_JAZZY)
    return store.generate_msgdef(type_name, ros_version=2)[0].encode(), store.hash_rihs01(
        type_name
    )


def _rows(channel: int, messages: Sequence[bytes], length: int) -> NDArray[np.void]:
    """Message records (n,) of messages of one length, without their numbers and times."""
    rows = np.empty(len(messages), _record(length))
    rows["opcode"] = Opcode.MESSAGE
    rows["length"] = rows.itemsize - 9
    rows["channel"] = channel
    rows["data"] = np.frombuffer(b"".join(messages), np.uint8).reshape(len(messages), length)
    return rows


@cache
def _record(length: int) -> np.dtype:
    """An MCAP message record around `length` bytes of message."""
    head = [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("publisher", "<u4")]
    return np.dtype([*head, ("log_time", "<u8"), ("publish_time", "<u8"), ("data", "u1", length)])
