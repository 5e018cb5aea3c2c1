# Copyright 2026 ahv developers, Apache-2.0
"""Recovering a bag: what is readable of it goes into a new, complete one beside it."""

import json
import re
import shutil
from collections import defaultdict
from collections.abc import Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.records import Channel, Metadata, Schema, Statistics

from ahv_analysis.bag.mcap_file import Index, McapFile
from ahv_analysis.bag.mcap_scan import Block, Damage, scan
from ahv_analysis.bag.metadata import (
    METADATA_FILE,
    BagFile,
    Topic,
    bag_metadata,
    custom_of_record,
    metadata_record,
    missing_files,
    read_metadata,
    write_metadata,
)
from ahv_analysis.errors import BagError

RECOVERED = "ahv_recovered"  # key of the losses in the custom data of a recovered bag, as JSON
LARGEST = 2**20  # [bytes] of a chunk


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

    name: str
    topics: dict[int, tuple[Channel, Schema]]  # by channel
    blocks: list[Block]
    custom: dict[str, str]
    losses: list[Loss]
    messages: int | None  # by its index, if there is one


def recover(path: Path, out: Path) -> Recovery | None:
    """Write what is readable of the bag folder `path` to the new folder `out`.

    None, and nothing written, if the bag is whole. Nothing in `path` is touched: a recovery that
    is stopped itself can be begun again, and another tool may yet read more. BagError if nothing
    is readable, or `out` exists or cannot be written.
    """
    files = sorted(path.glob("*.mcap"), key=_natural)
    if not files:
        raise BagError(f"{path} is not a bag: there is no MCAP file in it")
    metadata, losses = {}, []
    try:
        metadata = read_metadata(path)
        absent = missing_files(path, metadata)
        losses += [Loss(name, 0, 0, "it is missing") for name in absent]
    except BagError as error:
        there = (path / METADATA_FILE).exists()
        losses.append(Loss(METADATA_FILE, 0, 0, str(error) if there else "it is missing"))
    mode = str(metadata.get("compression_mode") or "none").lower()
    if mode != "none":
        raise BagError(
            f"{path} is compressed by {mode}, but only bags of plain files are recovered"
        )
    found = [_read(file) for file in files]
    losses += [loss for file in found for loss in file.losses]
    if not losses:
        return None
    counts = [file.messages for file in found]
    expected = metadata.get("message_count", None if None in counts else sum(filter(None, counts)))
    messages = sum(len(block.messages) for file in found for block in file.blocks)
    if not messages:
        what = "; ".join(f"{loss.file}: {loss.what}" for loss in losses)
        raise BagError(f"{path} holds no message that can be read ({what})")
    recovery = Recovery(messages, expected and expected - messages, losses)
    custom = metadata.get("custom_data")
    custom = dict(custom) if isinstance(custom, dict) else {}
    for file in found:
        custom = file.custom | custom
    custom[RECOVERED] = json.dumps(recovery.as_json())
    _write_bag(out, found, custom)
    return recovery


def _natural(file: Path) -> list[str | int]:
    """Key that puts file 10 of a split bag behind file 9."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", file.name)]


def _read(file: Path) -> _Found:
    try:
        data = file.read_bytes()
    except OSError as error:
        raise BagError(f"{file} cannot be read: {error.strerror}") from error
    pieces = list(scan(data))
    schemas = {piece.id: piece for piece in pieces if isinstance(piece, Schema)}
    topics = {
        piece.id: (piece, schemas[piece.schema_id])
        for piece in pieces
        if isinstance(piece, Channel) and piece.schema_id in schemas
    }
    losses = [Loss(file.name, *piece) for piece in pieces if isinstance(piece, Damage)]
    blocks, nameless = [], 0
    for piece in pieces:
        if isinstance(piece, Block):
            kept = [message for message in piece.messages if message[0] in topics]
            nameless += len(piece.messages) - len(kept)
            blocks.append(Block(piece.records, kept))
    if nameless:
        losses.append(Loss(file.name, 0, 0, f"{nameless} messages are of topics without a name"))
    custom: dict[str, str] = {}
    counted = None
    for piece in pieces:
        if isinstance(piece, Metadata):
            custom |= custom_of_record(piece)
        elif isinstance(piece, Statistics):
            counted = piece.message_count
    return _Found(file.name, topics, blocks, custom, losses, counted)


def _write_bag(out: Path, found: Sequence[_Found], custom: dict[str, str]) -> None:
    if out.exists():
        raise BagError(f"{out} exists already: choose another --out")
    try:
        out.mkdir(parents=True)
        try:
            files = [_write_file(out / file.name, file, custom) for file in found]
            write_metadata(out, bag_metadata(files, custom))
        except OSError:
            shutil.rmtree(out)  # it was begun here
            raise
    except OSError as error:
        raise BagError(f"cannot write a bag to {out}: {error.strerror}") from error


def _write_file(path: Path, found: _Found, custom: dict[str, str]) -> BagFile:
    file = McapFile(path, f"ahv {version('ahv')}")
    for schema in {schema.id: schema for _, schema in found.topics.values()}.values():
        file.add_schema(schema)
    for channel, _ in found.topics.values():
        file.add_channel(channel)
    for records, index in _chunks(found.blocks):
        file.add_chunk(records, index)
    topics = {key: Topic.of(*pair) for key, pair in found.topics.items()}
    written = BagFile(path.name, file.contents, topics)
    file.add_metadata(metadata_record(bag_metadata([written], custom)))
    file.finish()
    return written


def _chunks(blocks: Sequence[Block]) -> Iterator[tuple[bytes, Index]]:
    """Records and index of new chunks: of the blocks, and of parts of those that are large."""
    for records, messages in blocks:
        parts: list[bytes] = []
        entries: dict[int, list[tuple[int, int]]] = defaultdict(list)
        size = 0
        for place, (channel, log_time, start, end) in enumerate(messages, 1):
            entries[channel].append((log_time, size))
            parts.append(records[start:end])
            size += end - start
            if size >= LARGEST or place == len(messages):
                index = {key: np.array(rows, np.uint64) for key, rows in entries.items()}
                yield b"".join(parts), index
                parts, entries, size = [], defaultdict(list), 0
