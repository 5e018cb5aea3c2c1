# Copyright 2026 ahv developers, Apache-2.0
"""Files of a bag, read in pieces; and unpacking, bounded by what comes out of it.

A file that rosbag2 compressed as a whole is unpacked to a temporary file first.
"""

import os
import stat
from errno import EIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import lz4.frame
import zstandard

from ahv_analysis.errors import BagError
from ahv_msgs_py.layout import excerpt

ALLOWANCE = 2**24  # [bytes] that one chunk may have beyond the size of its file
RATIO = 200  # times its size to which a file may unpack, and the allowance; ours unpack to 5
ZSTD_MAGIC = zstandard.FRAME_HEADER  # no CDR message and no MCAP file begins so
_PIECE = 2**20  # [bytes]


class UnpackError(ValueError):
    """Compressed bytes that cannot be unpacked, or come to more than they may."""


class Room:
    """What may still be unpacked from one file."""

    def __init__(self, size: int):
        """`size` is that of the file as it lies on the disk [bytes]."""
        self.largest = ALLOWANCE + size  # [bytes] at a time
        self._left = ALLOWANCE + RATIO * size  # [bytes] in all

    def take(self, size: int) -> None:
        """Use room; UnpackError if there is not so much."""
        self._left -= size
        if self._left < 0:
            raise UnpackError(f"the file unpacks to more than {RATIO} times its size")

    def unpack(self, name: str, packed: bytes, most: int | None = None) -> bytes:
        """What `packed` comes to, as far as it goes; `name` is that of its compression in MCAP.

        UnpackError if that is more than `most` bytes, or than there is room for.
        """
        limit = self.largest if most is None else min(most, self.largest)
        try:
            if name == "zstd":
                with zstandard.ZstdDecompressor().stream_reader(packed) as reader:
                    plain = reader.read(limit + 1)
            elif name == "lz4":
                plain = lz4.frame.LZ4FrameDecompressor().decompress(packed, limit + 1)
            elif name == "":
                plain = packed
            else:
                raise UnpackError(
                    f"a chunk is compressed by {excerpt(name)}; known are zstd and lz4"
                )
        except (zstandard.ZstdError, RuntimeError) as error:
            raise UnpackError("a chunk cannot be decompressed") from error
        if len(plain) > limit:
            raise UnpackError(f"a chunk unpacks to more than {limit} bytes")
        self.take(len(plain))
        return plain


class PlainFile:
    """A file of a bag at any place of it, unpacked; a context manager."""

    def __init__(self, path: Path):
        """Open `path`; BagError if it cannot be opened, or is no file but a pipe or a device."""
        self._path = path
        try:
            self._file: IO[bytes] = _opened(path)
            self.size = self._file.seek(0, os.SEEK_END)
            self.room = Room(self.size)
            if self.read(0, len(ZSTD_MAGIC)) == ZSTD_MAGIC:
                self._unpack()
        except OSError as error:
            raise BagError(f"{path} cannot be read: {error.strerror}") from error
        except (UnpackError, zstandard.ZstdError) as error:
            raise BagError(f"{path} cannot be read: {error}") from error

    def _unpack(self) -> None:
        packed = self._file
        self._file = TemporaryFile()  # noqa: SIM115  closed with this object
        with packed, zstandard.ZstdDecompressor().stream_reader(packed) as reader:
            packed.seek(0)
            while piece := reader.read(_PIECE):
                self.room.take(len(piece))
                self._file.write(piece)
        self._file.flush()
        self.size = self._file.tell()

    def read(self, start: int, size: int) -> bytes:
        """Read `size` bytes from `start` on, fewer only at the end; BagError if the disk fails."""
        size = max(0, min(size, self.size - start))
        try:
            data = os.pread(self._file.fileno(), size, start)
            while len(data) < size:
                more = os.pread(self._file.fileno(), size - len(data), start + len(data))
                if not more:
                    raise OSError(EIO, "it became shorter meanwhile")
                data += more
        except OSError as error:
            raise BagError(f"{self._path} cannot be read: {error.strerror}") from error
        return data

    def __enter__(self) -> "PlainFile":
        """Give the file."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self._file.close()


def read_text(path: Path, most: int) -> str:
    """Text of a file of at most `most` bytes; BagError if it is none."""
    try:
        with _opened(path) as file:
            data = file.read(most + 1)
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from error
    if len(data) > most:
        raise BagError(f"{path} cannot be read: it is larger than {most} bytes")
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        raise BagError(f"{path} cannot be read: it is not text in UTF-8") from error


def _opened(path: Path) -> IO[bytes]:
    """Open a file, if it is one: nothing that waits for a writer or never ends."""
    number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(number).st_mode):
        os.close(number)
        raise OSError(EIO, "it is not a file")
    return os.fdopen(number, "rb")
