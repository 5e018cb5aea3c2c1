# Copyright 2026 ahv developers, Apache-2.0
"""What an MCAP file holds and where it is damaged: one walk, for reading and for recovery.

The readers of the `mcap` package, whose records these are, stop at the first damage. Everything
that carries a checksum is checked against it; stock rosbag2 writes chunks without one by default.
"""

import re
from collections.abc import Iterator
from io import BytesIO
from struct import Struct
from struct import error as StructError
from typing import NamedTuple
from zlib import crc32

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics

from ahv_analysis.bag.mcap_file import MAGIC

LARGEST_CHUNK = 2**32  # [bytes] uncompressed; more is taken for damage
_HEAD = Struct("<BQ")  # opcode and length of a record
_MESSAGE = Struct("<HIQQ")  # channel, sequence, log time, publish time
_CHUNK = Struct("<QQQII")  # first and last log time, size, checksum, length of compression's name
_CHECKSUM = Struct("<I")
_SIZE = Struct("<Q")
_FOOTER = Struct("<QQI")  # start of the index, of its offsets, checksum
_MAYBE_CHUNK = re.compile(rb"(?=\x06.{5}\x00{3})", re.DOTALL)
_DECOMPRESSORS = {
    "": bytes,
    "zstd": lambda packed: zstandard.ZstdDecompressor().decompressobj().decompress(packed),
    "lz4": lambda packed: lz4.frame.LZ4FrameDecompressor().decompress(packed),
}
_PARSED = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
    Opcode.STATISTICS: Statistics,
}


HEAD = _HEAD.size + _MESSAGE.size  # [bytes] of a message's record before its body


class Block(NamedTuple):
    """Records of messages one behind the other: those of a chunk, or some that are in none."""

    records: bytes
    messages: list[tuple[int, int, int, int]]  # channel, log time [ns], start and end of record


class Damage(NamedTuple):
    """A part of a file that cannot be read."""

    offset: int
    size: int  # [bytes]
    what: str


Piece = Block | Schema | Channel | Metadata | Statistics | Damage


def scan(data: bytes) -> Iterator[Piece]:
    """Pieces of an MCAP file in their order, with a `Damage` for every part that is unreadable.

    Behind a damaged part it goes on with the next chunk. Schemas and channels come again from the
    index at the end, if there is one.
    """
    position, whole = len(MAGIC), True
    if data[:position] != MAGIC:
        yield Damage(0, position, "it does not begin as an MCAP file does")
        whole = False
    while position < len(data):
        opcode, end = _record(data, position, len(data))
        if opcode == Opcode.FOOTER and data[end:] == MAGIC:
            yield from _pieces(data, opcode, position, end)
            return
        if opcode is None:
            found = _next_chunk(data, position + 1)
            if found is None:
                break
            pieces, end = [Damage(position, found - position, "a record is damaged")], found
        elif opcode in (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
            pieces, end = _contents(data, position, len(data))
        elif opcode == Opcode.DATA_END and not whole:
            pieces = []  # its checksum cannot fit
        else:
            pieces = _pieces(data, opcode, position, end)
        whole = whole and not any(isinstance(piece, Damage) for piece in pieces)
        yield from pieces
        position = end
    rest = _cut_chunk(data, position)
    kept = sum(len(piece.messages) for piece in rest if isinstance(piece, Block))
    yield from rest
    unchecked = f", and {kept} messages at its end have no checksum" if kept else ""
    yield Damage(position, len(data) - position, f"it was not closed{unchecked}")


def _record(data: bytes, position: int, stop: int) -> tuple[int | None, int]:
    """Opcode and end of the record at `position`; no opcode where there is no whole record."""
    if stop - position < _HEAD.size:
        return None, stop
    opcode, length = _HEAD.unpack_from(data, position)
    end = position + _HEAD.size + length
    known = Opcode.HEADER <= opcode <= Opcode.DATA_END and end <= stop
    return (opcode, end) if known else (None, stop)


def _contents(data: bytes, position: int, stop: int) -> tuple[list[Piece], int]:
    """Messages, schemas and channels from `position` on, and where something else begins."""
    definitions: list[Piece] = []
    messages = []
    head, body = _HEAD.unpack_from, _MESSAGE.unpack_from
    while stop - position >= _HEAD.size:
        opcode, length = head(data, position)
        end = position + _HEAD.size + length
        if end > stop:
            break
        if opcode == Opcode.MESSAGE:
            if length < _MESSAGE.size:
                definitions.append(Damage(position, end - position, "a message is damaged"))
            else:
                channel, _, log_time, _ = body(data, position + _HEAD.size)
                messages.append((channel, log_time, position, end))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            definitions += _pieces(data, opcode, position, end)
        else:
            break
        position = end
    return [*definitions, Block(data, messages)], position


def _pieces(data: bytes, opcode: int, position: int, end: int) -> list[Piece]:
    """What one record comes to."""
    try:
        if opcode in _PARSED:
            stream = ReadDataStream(BytesIO(data[position + _HEAD.size : end]))
            return [_PARSED[opcode].read(stream)]
        if opcode in _CHECKED:
            return _CHECKED[opcode](data, position, end)
    except (McapError, StructError, ValueError) as error:
        return [Damage(position, end - position, f"a record is damaged: {error}")]
    return []  # indexes, which a walk has no use for


def _chunk(data: bytes, position: int, end: int) -> list[Piece]:
    """Contents of the chunk at `position`, if they are what was written."""
    size, checksum, records = _unpacked(data, position, end)
    if len(records) != size or (checksum and crc32(records) != checksum):
        raise ValueError("the checksum of a chunk does not fit")
    pieces, reached = _contents(records, 0, size)
    if reached != size:
        raise ValueError("the records of a chunk do not fit it")
    return pieces


def _unpacked(data: bytes, position: int, end: int) -> tuple[int, int, bytes]:
    """Size and checksum that a chunk should have, and its records as far as they go."""
    _, _, size, checksum, name_size = _CHUNK.unpack_from(data, position + _HEAD.size)
    start = position + _HEAD.size + _CHUNK.size
    name = data[start : start + name_size].decode()
    start += name_size + _SIZE.size
    if name not in _DECOMPRESSORS:
        raise ValueError(f"a chunk is compressed by {name!r}; known are zstd and lz4")
    if size > LARGEST_CHUNK:
        raise ValueError(f"a chunk claims {size} bytes")
    try:
        return size, checksum, _DECOMPRESSORS[name](data[start:end])
    except (zstandard.ZstdError, RuntimeError) as error:
        raise ValueError("a chunk cannot be decompressed") from error


def _cut_chunk(data: bytes, position: int) -> list[Piece]:
    """What the end of the file has left of the chunk at `position`, if it is one."""
    if data[position : position + 1] != bytes([Opcode.CHUNK]):
        return []
    try:
        size, _, records = _unpacked(data, position, len(data))
    except (StructError, ValueError):
        return []
    return _contents(records, 0, min(size, len(records)))[0]


def _next_chunk(data: bytes, position: int) -> int | None:
    """Where the next whole record begins that looks like a chunk."""
    for match in _MAYBE_CHUNK.finditer(data, position):
        start = match.start()
        opcode, end = _record(data, start, len(data))
        if opcode is None or end - start < _HEAD.size + _CHUNK.size + _SIZE.size:
            continue
        name_size = _CHUNK.unpack_from(data, start + _HEAD.size)[-1]
        filled = start + _HEAD.size + _CHUNK.size + name_size + _SIZE.size
        if filled <= end and _SIZE.unpack_from(data, filled - _SIZE.size)[0] == end - filled:
            return start
    return None


def _data_end(data: bytes, position: int, end: int) -> list[Piece]:
    """Compare the checksum of all data, which ends at `position`."""
    (checksum,) = _CHECKSUM.unpack(data[position + _HEAD.size : end])
    if checksum and crc32(memoryview(data)[:position]) != checksum:
        return [Damage(0, position, "the checksum of its data does not fit")]
    return []


def _footer(data: bytes, position: int, end: int) -> list[Piece]:
    """Compare the checksum of the index, which ends in the footer at `position`."""
    start, _, checksum = _FOOTER.unpack(data[position + _HEAD.size : end])
    last = end - _CHECKSUM.size
    if checksum and crc32(memoryview(data)[start:last]) != checksum:
        return [Damage(start, last - start, "the checksum of its index does not fit")]
    return []


_CHECKED = {Opcode.CHUNK: _chunk, Opcode.DATA_END: _data_end, Opcode.FOOTER: _footer}
