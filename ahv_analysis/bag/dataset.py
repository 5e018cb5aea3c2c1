# Copyright 2026 ahv developers, Apache-2.0
"""A flight as an xarray Dataset, time x signal, and as the files that other tools read."""

import io
import json
from collections.abc import Callable
from pathlib import Path

import pyarrow
import pyarrow.csv
import pyarrow.parquet
import xarray

from ahv_analysis.bag.notes import Notes
from ahv_analysis.bag.reader import flight_of, read
from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.quantities import QUANTITIES, Quantity

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
        one.name: ("time", values, _attributes(one))
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


def _attributes(one: Quantity) -> dict[str, str]:
    return {
        "units": one.unit,
        "frame": one.frame,
        "long_name": f"{one.words}, {one.note}" if one.note else one.words,
        "source": DERIVED if one.topic is None else one.topic.name,
    }


def _table(flight: xarray.Dataset, named: Callable[[str, str], str]) -> pyarrow.Table:
    """A column per signal, time first; `named(name, units)` is its heading."""
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
    return pyarrow.table([column.values for column in columns], schema)


def csv_bytes(flight: xarray.Dataset) -> bytes:
    """CSV with headings like "u [m/s]"; every number keeps all its bits."""
    sink = io.BytesIO()
    pyarrow.csv.write_csv(_table(flight, lambda name, units: f"{name} [{units}]"), sink)
    return sink.getvalue()


def parquet_bytes(flight: xarray.Dataset) -> bytes:
    """Parquet; units, frames and notes are metadata of the schema."""
    sink = io.BytesIO()
    pyarrow.parquet.write_table(_table(flight, lambda name, units: name), sink)
    return sink.getvalue()


def netcdf_bytes(flight: xarray.Dataset) -> bytes:
    """The netCDF 3 file that scipy writes: doubles and texts are all that a flight has."""
    content: bytes = bytes(flight.to_netcdf(engine="scipy"))
    return content


EXPORTS = {"csv": csv_bytes, "parquet": parquet_bytes, "netcdf": netcdf_bytes}
