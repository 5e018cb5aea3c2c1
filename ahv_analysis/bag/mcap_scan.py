# Copyright 2026 ahv developers, Apache-2.0
"""What an MCAP file holds and where it is damaged: one walk, for reading and for recovery.

The readers of the `mcap` package, whose records these are, stop at the first damage. Everything
that carries a checksum is checked against it; stock rosbag2 writes chunks without one by default.
The walk holds no more of a file than a chunk.
"""

import re
from array import array
from collections.abc import Iterable, Iterator
from io import BytesIO
from struct import Struct
from struct import error as StructError
from typing import NamedTuple
from zlib import crc32

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ahv_analysis.bag.mcap_file import MAGIC
from ahv_analysis.bag.plain_file import PlainFile

WINDOW = 2**20  # [bytes] read at a time of what is in no chunk
LARGEST_RECORD = 2**21  # [bytes] of a channel, or of metadata
_HEAD = Struct("<BQ")  # opcode and length of a record
# What MCAP calls the sequence, free for applications, is in our bags the number of the publisher.
_MESSAGE = np.dtype(
    [("channel", "<u2"), ("publisher", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")]
)
_CHUNK = Struct("<QQQII")  # first and last log time, size, checksum, length of compression's name
_CHECKSUM = Struct("<I")
_SIZE = Struct("<Q")
_FOOTER = Struct("<QQI")  # start of the index, of its offsets, checksum
_MAYBE_CHUNK = re.compile(rb"(?=\x06.{5}\x00{3})", re.DOTALL)
_MAYBE_CHUNK_SIZE = 9  # [bytes] that the expression looks at
_PARSED = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
    Opcode.STATISTICS: Statistics,
}
_LOOSE = (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL)  # in a chunk, or in none

HEAD = _HEAD.size + _MESSAGE.itemsize  # [bytes] of a message's record before its body


class Block(NamedTuple):
    """Records of messages one behind the other: those of a chunk, or some that are in none."""

    records: bytes
    starts: NDArray[np.int64]  # (n,) of the messages' records
    ends: NDArray[np.int64]  # (n,)

    @property
    def heads(self) -> NDArray[np.void]:
        """Channel, publisher, log time and publish time [ns] of the messages (n,)."""
        return self.bodies(np.arange(len(self.starts)), _MESSAGE.itemsize, _HEAD.size).view(
            _MESSAGE
        )[:, 0]

    def bodies(self, places: NDArray[np.intp], size: int, offset: int = HEAD) -> NDArray[np.uint8]:
        """The first `size` bytes (n, size) of the bodies of the messages at `places`."""
        if not len(places):
            return np.empty((0, size), np.uint8)
        windows = sliding_window_view(np.frombuffer(self.records, np.uint8), size)
        rows: NDArray[np.uint8] = windows[self.starts[places] + offset]
        return rows

    def body(self, place: int) -> bytes:
        """The body of one message."""
        return self.records[self.starts[place] + HEAD : self.ends[place]]


class Damage(NamedTuple):
    """A part of a file that cannot be read."""

    offset: int
    size: int  # [bytes]
    what: str


Piece = Block | Schema | Channel | Metadata | Statistics | Damage


def scan(file: PlainFile) -> Iterator[Piece]:
    """Pieces of an MCAP file in their order, with a `Damage` for every part that is unreadable.

    Behind a damaged part it goes on with the next chunk. Schemas and channels come again from the
    index at the end, if there is one. Records of opcodes that the standard leaves to the future,
    or to others, are passed over, as it demands.
    """
    whole, checksum, messages = True, 0, 0
    position = min(len(MAGIC), file.size)
    if (beginning := file.read(0, len(MAGIC))) != MAGIC:
        yield Damage(0, position, "it does not begin as an MCAP file does")
        whole = False
    checksum = crc32(beginning)
    while position < file.size:
        opcode, end = _record(file, position)
        ends_here = end == file.size - len(MAGIC) and file.read(end, len(MAGIC)) == MAGIC
        if opcode == Opcode.FOOTER and ends_here:
            yield from _footer(file, position, end)
            return
        pieces: Iterable[Piece]
        if opcode is None:
            found = _next_chunk(file, position + 1)
            if found is None:
                break
            pieces, end = [Damage(position, found - position, "a record is damaged")], found
        elif opcode in _LOOSE:
            window = file.read(position, max(WINDOW, end - position))
            pieces, reached = _contents(window, alone=True)
            end = position + reached
        elif opcode == Opcode.DATA_END:
            pieces = _data_end(file, position, end, checksum) if whole else []
        else:
            pieces = _pieces(file, opcode, position, end)
        for piece in pieces:
            if isinstance(piece, Block):
                messages += len(piece.starts)
            elif isinstance(piece, Statistics) and whole and piece.message_count != messages:
                what = f"it has {messages} messages, but {piece.message_count} by its index"
                yield Damage(0, file.size, what)
            whole = whole and not isinstance(piece, Damage)
            yield piece
        if whole:
            checksum = _checksum(file, position, end, checksum)
        position = end
    rest = _cut_chunk(file, position)
    kept = sum(len(piece.starts) for piece in rest if isinstance(piece, Block))
    yield from rest
    unchecked = f", and {kept} messages at its end have no checksum" if kept else ""
    yield Damage(position, file.size - position, f"it was not closed{unchecked}")


def _record(file: PlainFile, position: int) -> tuple[int | None, int]:
    """Opcode and end of the record at `position`; no opcode where there is no whole record."""
    head = file.read(position, _HEAD.size)
    if len(head) < _HEAD.size:
        return None, file.size
    opcode, length = _HEAD.unpack(head)
    end = position + _HEAD.size + length
    return (opcode, end) if opcode and end <= file.size else (None, file.size)


def _contents(records: bytes, alone: bool) -> tuple[list[Piece], int]:
    """Messages, schemas and channels, and where something else begins.

    `alone` is outside of chunks, where other records stand between them.
    """
    definitions: list[Piece] = []
    starts, ends = array("q"), array("q")
    head, stop, position = _HEAD.unpack_from, len(records), 0
    while stop - position >= _HEAD.size:
        opcode, length = head(records, position)
        end = position + _HEAD.size + length
        if end > stop:
            break
        if opcode == Opcode.MESSAGE:
            if length < _MESSAGE.itemsize:
                definitions.append(Damage(position, end - position, "a message is damaged"))
            else:
                starts.append(position)
                ends.append(end)
        elif opcode in _LOOSE:
            definitions += _parsed(opcode, records[position + _HEAD.size : end], position)
        elif alone or opcode <= Opcode.DATA_END:
            break
        position = end
    block = Block(records, np.frombuffer(starts, np.int64), np.frombuffer(ends, np.int64))
    return [*definitions, block], position


def _parsed(opcode: int, body: bytes, position: int) -> list[Piece]:
    """What a record comes to that is parsed as a whole."""
    if opcode != Opcode.SCHEMA and len(body) > LARGEST_RECORD:
        return [Damage(position, len(body), f"a record has more than {LARGEST_RECORD} bytes")]
    try:
        return [_PARSED[Opcode(opcode)].read(ReadDataStream(BytesIO(body)))]
    except (McapError, StructError, ValueError) as error:
        return [Damage(position, len(body), f"a record is damaged: {error}")]


def _pieces(file: PlainFile, opcode: int, position: int, end: int) -> list[Piece]:
    """What one record comes to."""
    if opcode in _PARSED:
        size = min(end - position, LARGEST_RECORD + 2 * _HEAD.size)
        return _parsed(opcode, file.read(position, size)[_HEAD.size :], position)
    if opcode != Opcode.CHUNK:
        return []  # indexes, which a walk has no use for, and what is of no concern to us
    try:
        return _chunk(file, position, end)
    except (StructError, ValueError) as error:
        return [Damage(position, end - position, f"a record is damaged: {error}")]


def _chunk(file: PlainFile, position: int, end: int) -> list[Piece]:
    """Contents of the chunk at `position`, if they are what was written."""
    size, checksum, records = _unpacked(file, position, end)
    if len(records) != size or (checksum and crc32(records) != checksum):
        raise ValueError("the checksum of a chunk does not fit")
    pieces, reached = _contents(records, alone=False)
    if reached != size:
        raise ValueError("the records of a chunk do not fit it")
    return pieces


def _unpacked(file: PlainFile, position: int, end: int) -> tuple[int, int, bytes]:
    """Size and checksum that a chunk should have, and its records as far as they go."""
    start = position + _HEAD.size
    _, _, size, checksum, name_size = _CHUNK.unpack(file.read(start, _CHUNK.size))
    start += _CHUNK.size
    if name_size > WINDOW:
        raise ValueError(f"the name of its compression has {name_size} bytes")
    name = file.read(start, name_size).decode()
    start += name_size + _SIZE.size
    if size > file.room.largest:
        raise ValueError(f"a chunk claims {size} bytes, but is read up to {file.room.largest}")
    return size, checksum, file.room.unpack(name, file.read(start, max(0, end - start)), size)


def _cut_chunk(file: PlainFile, position: int) -> list[Piece]:
    """What the end of the file has left of the chunk at `position`, if it is one."""
    if file.read(position, 1) != bytes([Opcode.CHUNK]):
        return []
    try:
        _, _, records = _unpacked(file, position, file.size)
    except (StructError, ValueError):
        return []
    return _contents(records, alone=False)[0]


def _next_chunk(file: PlainFile, position: int) -> int | None:
    """Where the next whole record begins that looks like a chunk."""
    while position < file.size:
        window = file.read(position, WINDOW)
        for match in _MAYBE_CHUNK.finditer(window):
            if _looks_like_a_chunk(file, position + match.start()):
                return position + match.start()
        position += max(1, len(window) - _MAYBE_CHUNK_SIZE + 1)
    return None


def _looks_like_a_chunk(file: PlainFile, position: int) -> bool:
    opcode, end = _record(file, position)
    start = position + _HEAD.size + _CHUNK.size
    if opcode is None or end < start + _SIZE.size:
        return False
    name_size = _CHUNK.unpack(file.read(position + _HEAD.size, _CHUNK.size))[-1]
    filled = start + name_size + _SIZE.size
    if filled > end:
        return False
    return bool(_SIZE.unpack(file.read(filled - _SIZE.size, _SIZE.size))[0] == end - filled)


def _checksum(file: PlainFile, start: int, end: int, checksum: int = 0) -> int:
    for position in range(start, end, WINDOW):
        checksum = crc32(file.read(position, min(WINDOW, end - position)), checksum)
    return checksum


def _data_end(file: PlainFile, position: int, end: int, checksum: int) -> list[Piece]:
    """Compare the checksum of all data, which ends at `position`."""
    body = file.read(position + _HEAD.size, end - position - _HEAD.size)
    if len(body) != _CHECKSUM.size:
        return [Damage(position, end - position, "the end of its data is damaged")]
    (expected,) = _CHECKSUM.unpack(body)
    if expected and checksum != expected:
        return [Damage(0, position, "the checksum of its data does not fit")]
    return []


def _footer(file: PlainFile, position: int, end: int) -> list[Piece]:
    """Compare the checksum of the index, or of the footer at `position` where there is none."""
    body = file.read(position + _HEAD.size, end - position - _HEAD.size)
    if len(body) != _FOOTER.size:
        return [Damage(position, end - position, "its footer is damaged")]
    start, _, expected = _FOOTER.unpack(body)
    start, last = min(start or position, position), end - _CHECKSUM.size
    if expected and _checksum(file, start, last) != expected:
        return [Damage(start, last - start, "the checksum of its index does not fit")]
    return []
