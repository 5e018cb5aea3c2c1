# Copyright 2026 ahv developers, Apache-2.0
"""A growing MCAP file whose chunks are whole, checksummed and in the system's hands once added.

The records are those of the `mcap` package. Its writer gathers a chunk message by message in
Python, which costs a lockstep flight more than all of the graph; here a chunk comes as bytes.
"""

from collections.abc import Mapping
from io import FileIO
from pathlib import Path
from struct import Struct
from typing import NamedTuple
from zlib import crc32

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

MAGIC = b"\x89MCAP0\r\n"
PROFILE = "ros2"
COMPRESSION = "zstd"
_LEVEL = 1  # a quarter of the size for 2 us a step; higher levels gain nothing on doubles
_MESSAGE_INDEX = Struct("<BQHI")
_FOOTER = Struct("<BQQQ")

Index = Mapping[int, NDArray[np.uint64]]  # channel: (n, 2) log time [ns], offset in its chunk


class Contents(NamedTuple):
    """What a finished file holds."""

    start: int  # [ns] first log time; 0 if there are no messages
    end: int  # [ns] last log time
    counts: dict[int, int]  # messages per channel


class McapFile:
    """Schemas, channels and metadata, then chunks; `finish` adds the index.

    A process that dies leaves whole chunks, and at most one that is cut off, behind schemas and
    channels that stand at the start. Any method raises OSError where the disk does.
    """

    def __init__(self, path: Path, library: str):
        """Create the file `path`, which must not exist."""
        self._file = FileIO(path, "x")
        self._compressor = zstandard.ZstdCompressor(level=_LEVEL)
        self._size = self._crc = 0
        self._summary: dict[Opcode, list[McapRecord]] = {
            Opcode.SCHEMA: [],
            Opcode.CHANNEL: [],
            Opcode.CHUNK_INDEX: [],
            Opcode.METADATA_INDEX: [],
        }
        self._start, self._end = 2**64 - 1, 0
        self._counts: dict[int, int] = {}
        self._append(MAGIC + _encoded(Header(PROFILE, library)))

    def add_schema(self, schema: Schema) -> None:
        """File a message definition, before its channels."""
        self._append(_encoded(schema))
        self._summary[Opcode.SCHEMA].append(schema)

    def add_channel(self, channel: Channel) -> None:
        """File a topic, before its messages."""
        self._append(_encoded(channel))
        self._summary[Opcode.CHANNEL].append(channel)
        self._counts[channel.id] = 0

    def add_metadata(self, metadata: Metadata) -> None:
        """File names and values; of records of one name readers take the last."""
        data = _encoded(metadata)
        self._summary[Opcode.METADATA_INDEX].append(
            MetadataIndex(self._size, len(data), metadata.name)
        )
        self._append(data)

    def add_chunk(self, records: bytes, index: Index) -> None:
        """File message records, and for every channel in them when and where its messages are."""
        start = min(int(entries[:, 0].min()) for entries in index.values())
        end = max(int(entries[:, 0].max()) for entries in index.values())
        packed = self._compressor.compress(records)
        chunk = _encoded(Chunk(COMPRESSION, packed, end, start, crc32(records), len(records)))
        position = self._size + len(chunk)
        parts, offsets = [chunk], {}
        for channel, entries in index.items():
            body = entries.astype("<u8").tobytes()
            head = _MESSAGE_INDEX.pack(Opcode.MESSAGE_INDEX, 6 + len(body), channel, len(body))
            offsets[channel] = position
            position += len(head) + len(body)
            parts += [head, body]
            self._counts[channel] += len(entries)
        self._summary[Opcode.CHUNK_INDEX].append(
            ChunkIndex(
                chunk_length=len(chunk),
                chunk_start_offset=self._size,
                compression=COMPRESSION,
                compressed_size=len(packed),
                message_end_time=end,
                message_index_length=position - self._size - len(chunk),
                message_index_offsets=offsets,
                message_start_time=start,
                uncompressed_size=len(records),
            )
        )
        self._append(b"".join(parts))
        self._start, self._end = min(self._start, start), max(self._end, end)

    @property
    def contents(self) -> Contents:
        """What is filed so far."""
        return Contents(min(self._start, self._end), self._end, dict(self._counts))

    def finish(self) -> None:
        """Write index, checksums and end: after this the file is complete and closed."""
        self._append(_encoded(DataEnd(self._crc)))
        start, counts = self._size, self.contents.counts
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._summary[Opcode.CHANNEL]),
            channel_message_counts=counts,
            chunk_count=len(self._summary[Opcode.CHUNK_INDEX]),
            message_count=sum(counts.values()),
            message_end_time=self.contents.end,
            message_start_time=self.contents.start,
            metadata_count=len(self._summary[Opcode.METADATA_INDEX]),
            schema_count=len(self._summary[Opcode.SCHEMA]),
        )
        summary, offsets = b"", b""
        for opcode, records in (self._summary | {Opcode.STATISTICS: [statistics]}).items():
            group = b"".join(_encoded(record) for record in records)
            if group:
                position = start + len(summary)
                offsets += _encoded(SummaryOffset(opcode, position, len(group)))
            summary += group
        split = start + len(summary)
        checked = summary + offsets + _FOOTER.pack(Opcode.FOOTER, 20, start, split)
        self._append(summary + offsets + _encoded(Footer(start, split, crc32(checked))) + MAGIC)
        self.close()

    def close(self) -> None:
        """Close the file as it is, without an index; to be recovered."""
        self._file.close()

    def _append(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]  # a disk that fills up takes a part
        self._size += len(data)
        self._crc = crc32(data, self._crc)


def _encoded(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()
    return data
