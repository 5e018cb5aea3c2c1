# Copyright 2026 ahv developers, Apache-2.0
"""A flight as an xarray Dataset, time x signal, and as the files that other tools read."""

import json
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import chain
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow
import pyarrow.csv
import pyarrow.parquet
import xarray
from scipy.io import netcdf_file, netcdf_variable

from ahv_analysis.bag.notes import Notes
from ahv_analysis.bag.reader import Bag, flight_of, read
from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import GrowingRows, Rows
from ahv_analysis.quantities import QUANTITIES, Quantity, source

DERIVED = "derived"  # source of a signal that is not recorded


def bag_dataset(path: Path) -> xarray.Dataset:
    """The flight in the bag `path` as `flight_dataset` gives it; BagError if it is none."""
    bag = read(path)
    flight = flight_dataset(flight_of(bag), bag.notes)
    return flight.assign_attrs(refused=sum(entry.messages for entry in bag.refused))


def flight_dataset(record: FlightRecord, notes: Notes | None) -> xarray.Dataset:
    """Signals of a flight over `time` [s], each with units, frame, long_name and source.

    The states, the commands that answer them and, of an adaptive flight, what the learner knows,
    as recorded; angle of attack, sideslip, flight path angle, Mach number, dynamic pressure and
    airspeed derived from them. `notes` are those of the bag; they become attributes.
    """
    variables = {
        one.name: ("time", values, _attributes(one, record))
        for one in QUANTITIES
        if (values := one.values(record)) is not None
    }
    altitude = "geometric" if record.geometric else "geopotential"
    variables["h"][2]["long_name"] = f"{altitude} altitude"
    time = ("time", record.time, {"units": "s", "long_name": "simulated time"})
    attributes = {"title": "flight of ahv", "altitude": altitude}
    if notes is not None:
        attributes |= {"case": notes.case, "notes": json.dumps(notes.content)}
    return xarray.Dataset(variables, {"time": time}, attributes)


def _attributes(one: Quantity, record: FlightRecord) -> dict[str, str]:
    topic = source(one, record)
    return {
        "units": one.unit,
        "frame": one.frame,
        "long_name": f"{one.words}, {one.note}" if one.note else one.words,
        "source": DERIVED if topic is None else topic.name,
    }


def bag_parts(bag: Bag) -> Iterator[xarray.Dataset]:
    """The flight of `bag_dataset` in pieces, one behind the other, as exports take it."""
    record = flight_of(bag)
    refused = sum(entry.messages for entry in bag.refused)
    return (
        flight_dataset(part, bag.notes).assign_attrs(refused=refused) for part in record.parts()
    )


def _tables(
    parts: Iterable[xarray.Dataset], named: Callable[[str, str], str]
) -> Iterator[pyarrow.Table]:
    """A column per signal, time first; `named(name, units)` is its heading."""
    for flight in parts:
        columns = [flight["time"], *flight.data_vars.values()]
        fields = [
            pyarrow.field(
                named(str(column.name), column.attrs["units"]),
                pyarrow.float64(),
                metadata={key: str(value) for key, value in column.attrs.items()},
            )
            for column in columns
        ]
        schema = pyarrow.schema(
            fields, metadata={key: str(value) for key, value in flight.attrs.items()}
        )
        yield pyarrow.table([column.values for column in columns], schema)


def _write_tables(
    tables: Iterator[pyarrow.Table],
    writer: Callable[[IO[bytes], pyarrow.Schema], Any],
    sink: IO[bytes],
) -> None:
    first = next(tables)
    with writer(sink, first.schema) as writing:
        for table in chain([first], tables):
            writing.write_table(table)


def write_csv(parts: Iterable[xarray.Dataset], sink: IO[bytes]) -> None:
    """CSV with headings like "u [m/s]"; every number keeps all its bits."""
    tables = _tables(parts, lambda name, units: f"{name} [{units}]")
    _write_tables(tables, pyarrow.csv.CSVWriter, sink)


def write_parquet(parts: Iterable[xarray.Dataset], sink: IO[bytes]) -> None:
    """Parquet; units, frames and notes are metadata of the schema."""
    tables = _tables(parts, lambda name, units: name)
    doubles = partial(pyarrow.parquet.ParquetWriter, use_dictionary=False)  # few are alike
    _write_tables(tables, doubles, sink)


class _Column:
    """What scipy asks an array for when it writes one, of numbers that are read only then."""

    dtype = np.dtype(">f8")  # of netCDF
    itemsize = dtype.itemsize

    def __init__(self, rows: Rows, place: int):
        self._rows, self._place = rows, place
        self.size = len(rows)
        self.shape = (self.size,)

    def tobytes(self) -> bytes:
        """Read the numbers."""
        return self._rows[:, self._place].astype(self.dtype).tobytes()


def write_netcdf(parts: Iterable[xarray.Dataset], sink: IO[bytes]) -> None:
    """A netCDF 3 file by scipy: doubles and texts are all that a flight has."""
    signals: list[Any] = []
    for flight in parts:
        if not signals:
            signals = [*flight.data_vars.values(), flight["time"]]
            attributes, growing = flight.attrs, GrowingRows(len(signals))
        growing.extend(np.column_stack([flight[signal.name].values for signal in signals]))
    rows = growing.rows()
    file = netcdf_file(sink, "w", version=2)
    for name, value in attributes.items():
        setattr(file, name, value)
    file.createDimension("time", len(rows))
    for place, signal in enumerate(signals):
        of_signal = signal.attrs | ({} if signal.name == "time" else {"_FillValue": np.nan})
        file.variables[signal.name] = netcdf_variable(
            _Column(rows, place), "d", 8, (len(rows),), ("time",), of_signal
        )
    file.close()


EXPORTS = {"csv": write_csv, "parquet": write_parquet, "netcdf": write_netcdf}
