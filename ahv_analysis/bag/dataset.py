# Copyright 2026 ahv developers, Apache-2.0
"""A flight as an xarray Dataset, time x signal, and as the files that other tools read."""

import io
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import pyarrow
import pyarrow.csv
import pyarrow.parquet
import xarray

from ahv_analysis.bag.notes import Notes
from ahv_analysis.bag.reader import flight_of, read
from ahv_analysis.bag.record import Array, FlightRecord
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    BASIS_NAMES,
    BODY_FRAME,
    DISTURBANCE_ESTIMATE,
    EARTH_FRAME,
    LEARNER,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
)

DERIVED = "derived"  # source of a signal that is not recorded


class Signal(NamedTuple):
    """What a signal is."""

    name: str
    units: str
    frame: str  # in which it is given; empty for one that has none
    long_name: str
    source: str  # topic that recorded it, or DERIVED


def _signals(source: str, units: str, frame: str, names: Mapping[str, str]) -> list[Signal]:
    return [Signal(name, units, frame, words, source) for name, words in names.items()]


STATE_SIGNALS = (
    *_signals(
        STATE.name,
        "m/s",
        BODY_FRAME,
        {"u": "velocity forward", "v": "velocity right", "w": "velocity down"},
    ),
    *_signals(
        STATE.name, "rad/s", BODY_FRAME, {"P": "roll rate", "Q": "pitch rate", "R": "yaw rate"}
    ),
    *_signals(
        STATE.name,
        "rad",
        EARTH_FRAME,
        {"phi": "roll angle", "theta": "pitch angle", "psi": "yaw angle"},
    ),
    *_signals(
        STATE.name,
        "m",
        EARTH_FRAME,
        {"x": "distance north", "y": "distance east", "h": "altitude"},
    ),
    Signal("mass", "kg", "", "mass", STATE.name),
)
ATTITUDE_SIGNALS = _signals(
    ATTITUDE_COMMAND.name,
    "rad",
    EARTH_FRAME,
    {
        "phi_command": "commanded roll angle",
        "theta_command": "commanded pitch angle",
        "psi_command": "commanded yaw angle",
    },
)
RATE_SIGNALS = _signals(
    RATE_COMMAND.name,
    "rad/s",
    BODY_FRAME,
    {
        "P_command": "commanded roll rate",
        "Q_command": "commanded pitch rate",
        "R_command": "commanded yaw rate",
    },
)
SURFACE_SIGNALS = _signals(
    SURFACE_COMMAND.name,
    "rad",
    "",
    {
        "right_elevon": "commanded right elevon, trailing edge down",
        "left_elevon": "commanded left elevon, trailing edge down",
        "rudder": "commanded rudder, trailing edge left",
    },
)
THROTTLE_SIGNALS = _signals(THROTTLE_COMMAND.name, "1", "", {"throttle": "commanded throttle"})
ESTIMATE_SIGNALS = _signals(
    DISTURBANCE_ESTIMATE.name,
    "rad/s^2",
    BODY_FRAME,
    {f"d_{rate}": f"learned disturbance of the rate of {rate}" for rate in "PQR"},
)
LEARNER_SIGNALS = (
    *_signals(LEARNER.name, "rad/s", BODY_FRAME, {f"X_a_{r}": f"approximate {r}" for r in "PQR"}),
    *_signals(LEARNER.name, "rad/s", BODY_FRAME, {f"X_d_{r}": f"desired {r}" for r in "PQR"}),
    *(
        Signal(f"W_{rate}_{term}", units, "", f"weight of {term} in d_{rate}", LEARNER.name)
        for rate in "PQR"
        for term, units in zip(
            BASIS_NAMES,
            (
                "deg/s^2",
                *(f"deg/s^2/(deg/s)^{power}" for power in (1, 2, 1, 2, 4, 1, 2, 4, 4, 6)),
            ),
            strict=True,
        )
    ),
)
AIR_SIGNALS = (
    *_signals(
        DERIVED, "rad", BODY_FRAME, {"alpha": "angle of attack", "beta": "angle of sideslip"}
    ),
    Signal("gamma", "rad", EARTH_FRAME, "flight path angle above the horizon", DERIVED),
    Signal("mach", "1", "", "Mach number", DERIVED),
    Signal("dynamic_pressure", "Pa", "", "dynamic pressure", DERIVED),
    Signal("speed", "m/s", "", "airspeed", DERIVED),
)


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
    air = record.air
    derived = (
        air.alpha,
        air.beta,
        record.climb_angle,
        air.mach,
        air.dynamic_pressure,
        air.speed,
    )
    variables = {
        **_columns(STATE_SIGNALS, record.states.T),
        **_columns(ATTITUDE_SIGNALS, record.attitude_commands.T),
        **_columns(RATE_SIGNALS, record.rate_commands.T),
        **_columns(SURFACE_SIGNALS, record.surfaces.T),
        **_columns(THROTTLE_SIGNALS, [record.throttle]),
        **_columns(AIR_SIGNALS, derived),
    }
    if record.learner is not None and record.estimates is not None:
        variables |= _columns(LEARNER_SIGNALS, record.learner.T)
        variables |= _columns(ESTIMATE_SIGNALS, record.estimates.T)
    altitude = "geometric" if record.geometric else "geopotential"
    variables["h"][2]["long_name"] = f"{altitude} altitude"
    time = ("time", record.time, {"units": "s", "long_name": "simulated time"})
    attributes = {"title": "flight of ahv", "altitude": altitude}
    if notes is not None:
        attributes |= {"case": notes.case, "notes": json.dumps(notes.content)}
    return xarray.Dataset(variables, {"time": time}, attributes)


def _columns(signals: Sequence[Signal], columns: Sequence[Array]) -> dict[str, tuple]:
    return {
        signal.name: ("time", column, {k: v for k, v in signal._asdict().items() if k != "name"})
        for signal, column in zip(signals, columns, strict=True)
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
