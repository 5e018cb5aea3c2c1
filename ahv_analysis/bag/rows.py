# Copyright 2026 ahv developers, Apache-2.0
"""Rows of numbers of any count: an array where there are few, else on the disk.

An hour of flight has more numbers than a reader should hold. They lie in a temporary file, of
which `StoredRows` reads what is asked for: columns of a block stand together there.
"""

import os
import tempfile
from array import array
from collections.abc import Iterable, Iterator
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ahv_analysis.errors import BagError

Array = NDArray[np.float64]
Places = NDArray[np.intp]
BLOCK = 2**13  # rows that are read and written at a time: 82 s of flight
_ITEM = 8  # [bytes] of a number


class StoredRows:
    """Rows (n, width) on the disk, read as an array is: `rows[a:b]`, `rows[:, column]`."""

    def __init__(self, blocks: "_Blocks", places: Places | range, columns: Places):
        """What stands at `places` and in `columns` of the blocks."""
        self._blocks, self._places, self._columns = blocks, places, columns

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self._places), len(self._columns)

    def __len__(self) -> int:
        """Count the rows."""
        return len(self._places)

    def __getitem__(self, key: Any) -> Array:
        """Read rows, or rows and columns; either is anything that an axis of an array takes."""
        rows, columns = key if isinstance(key, tuple) else (key, slice(None))
        places, fields = _array(_some(self._places, rows)), self._columns[columns]
        found = self._blocks.read(np.atleast_1d(places), np.atleast_1d(fields))
        shape = np.shape(places) + np.shape(fields)
        return found.T.reshape(shape) if np.ndim(fields) else found[0].reshape(shape)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Read all of them."""
        return self[:]

    def part(self, places: Places | slice, columns: slice = slice(None)) -> "StoredRows":
        """Some of the rows and columns, read when they are asked for."""
        return StoredRows(self._blocks, _some(self._places, places), self._columns[columns])


def _some(places: Places | range, key: Any) -> Any:
    """What an array of `places` has at `key`; of a range, which takes no memory, a range."""
    if isinstance(places, range):
        if isinstance(key, slice):
            return places[key]
        places = _array(places)
    return places[key]


def _array(places: Any) -> Places:
    if isinstance(places, range):
        return np.arange(places.start, places.stop, places.step)
    return np.asarray(places)


Rows = Array | StoredRows


def part_of(rows: Rows, places: Places | slice, columns: slice = slice(None)) -> Rows:
    """Some of the rows and columns, not read yet if they lie on the disk."""
    if isinstance(rows, StoredRows):
        return rows.part(places, columns)
    return rows[places, columns]


def bits_differ(one: Array, other: Array) -> NDArray[np.bool_]:
    """Where numbers (n, k) are not alike to the last bit."""
    bits = [np.ascontiguousarray(numbers).view(np.uint64) for numbers in (one, other)]
    differ: NDArray[np.bool_] = bits[0] != bits[1]
    return differ


def one_by_one(rows: Rows) -> Iterator[list[float]]:
    """Row by row."""
    for start in range(0, len(rows), BLOCK):
        for row in rows[start : start + BLOCK]:
            yield row.tolist()


class GrowingRows:
    """Takes rows as they come."""

    def __init__(self, width: int):
        """Begin with no row; `width` is the number of columns."""
        self._width = width
        self._rest = array("d")  # what fills no block yet
        self._blocks = _Blocks(width)

    def append(self, row: Iterable[float]) -> None:
        """Take one row."""
        self._rest.extend(row)
        self._flush()

    def extend(self, rows: Array) -> None:
        """Take rows (n, width)."""
        self._rest.frombytes(np.asarray(rows, np.float64).tobytes())
        self._flush()

    def _flush(self) -> None:
        size = BLOCK * self._width
        while len(self._rest) > size:
            self._blocks.append(np.frombuffer(self._rest[:size]).reshape(BLOCK, self._width))
            del self._rest[:size]

    def rows(self) -> Rows:
        """All rows; nothing can be taken any more."""
        last = np.frombuffer(self._rest).reshape(-1, self._width)
        if not self._blocks.count:
            return last
        rows = self._blocks.count * BLOCK + len(last)
        self._blocks.append(last)
        return StoredRows(self._blocks, range(rows), np.arange(self._width))


class _Blocks:
    """Blocks of rows in a temporary file that nobody else sees, each stored column by column."""

    def __init__(self, width: int):
        self.count = 0
        self._width = width
        self._file: IO[bytes] | None = None

    def append(self, rows: Array) -> None:
        """Write a block; only the last may have fewer rows than `BLOCK`. BagError without room."""
        whole = np.zeros((self._width, BLOCK))
        whole[:, : len(rows)] = rows.T
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  lives on
            rest = memoryview(whole).cast("B")
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            raise BagError(
                f"{tempfile.gettempdir()} cannot hold the numbers of a long flight: "
                f"{error.strerror}; TMPDIR names another folder"
            ) from error
        self.count += 1

    def read(self, places: Places, columns: Places) -> Array:
        """What stands in `columns` (k,) at `places` (n,), as (k, n)."""
        found = np.empty((len(columns), len(places)))
        numbers = places // BLOCK
        if not found.size or self._file is None:
            return found
        first, last = int(columns.min()), int(columns.max()) + 1
        for number in np.unique(numbers):
            here = np.flatnonzero(numbers == number)
            data = os.pread(
                self._file.fileno(),
                (last - first) * BLOCK * _ITEM,
                (int(number) * self._width + first) * BLOCK * _ITEM,
            )
            block = np.frombuffer(data).reshape(-1, BLOCK)
            found[:, here] = block[np.ix_(columns - first, places[here] % BLOCK)]
        return found
