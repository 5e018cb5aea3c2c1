# Copyright 2026 ahv developers, Apache-2.0
"""Recovering a bag: what is readable of it goes into a new, complete one beside it.

Its files are walked twice: what the topics are called may stand at their ends.
"""

import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from struct import Struct
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics

from ahv_analysis.bag.files import find_bag, mcap_files, missing_files
from ahv_analysis.bag.mcap_file import Index, McapFile
from ahv_analysis.bag.mcap_scan import HEAD, Block, scan
from ahv_analysis.bag.metadata import (
    METADATA_FILE,
    BagFile,
    BagMetadata,
    Topic,
    bag_metadata,
    custom_of_record,
    metadata_record,
    read_metadata,
    write_metadata,
)
from ahv_analysis.bag.notes import RECOVERED
from ahv_analysis.bag.plain_file import ZSTD_MAGIC, PlainFile, Room, UnpackError
from ahv_analysis.errors import BagError
from ahv_analysis.interrupt import until

LARGEST = 2**20  # [bytes] of a chunk
MOST_LOSSES = 100  # of a file that are told one by one
_HEAD = Struct("<BQ")  # opcode and length of a record


class Loss(NamedTuple):
    """Something of a bag that could not be read."""

    file: str
    offset: int
    size: int  # [bytes]
    what: str


class Recovery(NamedTuple):
    """What came of recovering a bag."""

    messages: int
    lost_messages: int | None  # None where nothing tells how many there were
    losses: list[Loss]

    def as_json(self) -> dict[str, object]:
        """The same for JSON."""
        losses = [loss._asdict() for loss in self.losses]
        return {"messages": self.messages, "lost_messages": self.lost_messages, "losses": losses}


class _Found(NamedTuple):
    """What is readable of one file."""

    path: Path
    schemas: dict[int, Schema]
    channels: dict[int, Channel]
    messages: int  # readable, of channels that are known
    custom: dict[str, str]
    losses: list[Loss]
    counted: int | None  # messages by its index, if there is one

    @property
    def name(self) -> str:
        """Name of the file that takes it."""
        return self.path.name.removesuffix(".zstd")


def recover(
    path: Path, out: Path, interrupted: Callable[[], bool] = lambda: False
) -> Recovery | None:
    """Write what is readable of the bag `path`, a folder or a file, to the new folder `out`.

    None, and nothing written, if the bag is whole. Nothing in `path` is touched: a recovery that
    is stopped itself can be begun again, and another tool may yet read more. BagError if nothing
    is readable, or `out` exists or cannot be written; KeyboardInterrupt, and nothing written, once
    `interrupted()`.
    """
    path = find_bag(path)
    files = mcap_files(path)
    if not files:
        raise BagError(f"{path} is not a bag: there is no MCAP file in it")
    metadata, losses = BagMetadata([], None, {}), []
    if path.is_dir():
        try:
            metadata = read_metadata(path)
            losses += [Loss(name, 0, 0, "it is missing") for name in missing_files(path, metadata)]
        except BagError as error:
            there = (path / METADATA_FILE).exists()
            losses.append(Loss(METADATA_FILE, 0, 0, str(error) if there else "it is missing"))
    found = [_look(file, interrupted) for file in files]
    losses += [loss for file in found for loss in file.losses]
    if not losses:
        return None
    counts = [file.counted for file in found]
    expected = metadata.messages
    if expected is None and None not in counts:
        expected = sum(filter(None, counts))
    messages = sum(file.messages for file in found)
    if not messages:
        what = "; ".join(f"{loss.file}: {loss.what}" for loss in losses[:3])
        raise BagError(f"{path} holds no message that can be read ({what})")
    lost = None if expected is None else max(0, expected - messages)
    recovery = Recovery(messages, lost, losses)
    custom = dict(metadata.custom)
    for file in found:
        custom = file.custom | custom
    custom[RECOVERED] = json.dumps(recovery.as_json())
    _write_bag(out, found, custom, interrupted)
    return recovery


def _look(path: Path, interrupted: Callable[[], bool]) -> _Found:
    """Walk a file for its topics, its texts and its losses."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    custom: dict[str, str] = {}
    counts: Counter[int] = Counter()
    losses: list[Loss] = []
    counted, unpackable, more = None, 0, 0
    with PlainFile(path) as file:
        for piece in until(interrupted, scan(file)):
            if isinstance(piece, Schema):
                schemas[piece.id] = piece
            elif isinstance(piece, Channel):
                channels[piece.id] = piece
            elif isinstance(piece, Metadata):
                custom |= custom_of_record(piece)
            elif isinstance(piece, Statistics):
                counted = piece.message_count
            elif isinstance(piece, Block):
                numbers = piece.heads["channel"]
                counts.update(numbers.tolist())
                for place in np.flatnonzero(_packed(piece)):
                    if _unpacked(piece.body(place), file.room) is None:
                        counts[int(numbers[place])] -= 1
                        unpackable += 1
            elif len(losses) < MOST_LOSSES:
                losses.append(Loss(path.name, *piece))
            else:
                more += 1
    nameless = sum(count for channel, count in counts.items() if channel not in channels)
    for count, what in (
        (more, "more parts are damaged"),
        (nameless, "messages are of topics without a name"),
        (unpackable, "compressed messages cannot be unpacked"),
    ):
        if count:
            losses.append(Loss(path.name, 0, 0, f"{count} {what}"))
    messages = counts.total() - nameless
    return _Found(path, schemas, channels, messages, custom, losses, counted)


def _packed(block: Block) -> np.ndarray:
    """Which messages (n,) of a block are compressed each for itself, as rosbag2 does."""
    long = np.flatnonzero(block.ends - block.starts >= HEAD + len(ZSTD_MAGIC))
    packed = np.zeros(len(block.starts), bool)
    magic = np.frombuffer(ZSTD_MAGIC, np.uint8)
    packed[long] = np.all(block.bodies(long, len(ZSTD_MAGIC)) == magic, axis=1)
    return packed


def _unpacked(body: bytes, room: Room) -> bytes | None:
    try:
        return room.unpack("zstd", body)
    except UnpackError:
        return None


def _write_bag(
    out: Path,
    found: Sequence[_Found],
    custom: dict[str, str],
    interrupted: Callable[[], bool],
) -> None:
    if out.exists():
        raise BagError(f"{out} exists already: choose another --out")
    try:
        out.mkdir(parents=True)
        try:
            files = [_write_file(out / file.name, file, custom, interrupted) for file in found]
            write_metadata(out, bag_metadata(files, custom))
        except BaseException:
            shutil.rmtree(out)  # it was begun here
            raise
    except OSError as error:
        raise BagError(f"cannot write a bag to {out}: {error.strerror}") from error


def _write_file(
    path: Path, found: _Found, custom: dict[str, str], interrupted: Callable[[], bool]
) -> BagFile:
    file = McapFile(path, f"ahv {version('ahv')}")
    for schema in found.schemas.values():
        file.add_schema(schema)
    for channel in found.channels.values():
        file.add_channel(channel)
    with PlainFile(found.path) as source:
        for piece in until(interrupted, scan(source)):
            if isinstance(piece, Block):
                for records, index in _chunks(piece, found.channels, source.room):
                    file.add_chunk(records, index)
    topics = {
        number: Topic.of(channel, found.schemas.get(channel.schema_id))
        for number, channel in found.channels.items()
    }
    written = BagFile(path.name, file.contents, topics)
    file.add_metadata(metadata_record(bag_metadata([written], custom)))
    file.finish()
    return written


def _chunks(
    block: Block, channels: dict[int, Channel], room: Room
) -> Iterator[tuple[bytes, Index]]:
    """Records and index of new chunks: of a block, or of parts of one that is large."""
    parts: list[bytes] = []
    entries: dict[int, list[tuple[int, int]]] = {}
    size = 0
    heads, packed = block.heads, _packed(block)
    for place, channel in enumerate(heads["channel"].tolist()):
        if channel not in channels:
            continue
        record = block.records[block.starts[place] : block.ends[place]]
        if packed[place]:
            body = _unpacked(record[HEAD:], room)
            if body is None:
                continue
            length = HEAD - _HEAD.size + len(body)
            record = _HEAD.pack(Opcode.MESSAGE, length) + record[_HEAD.size : HEAD] + body
        entries.setdefault(channel, []).append((int(heads["log_time"][place]), size))
        parts.append(record)
        size += len(record)
        if size >= LARGEST:
            yield b"".join(parts), _index(entries)
            parts, entries, size = [], {}, 0
    if parts:
        yield b"".join(parts), _index(entries)


def _index(entries: dict[int, list[tuple[int, int]]]) -> Index:
    return {channel: np.array(rows, np.uint64) for channel, rows in entries.items()}
