# Copyright 2026 ahv developers, Apache-2.0
"""A flight as a Dataset has every signal with its unit and frame, and leaves it without a loss."""

import io
import json
import re
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
import xarray

from ahv_analysis.bag.dataset import EXPORTS, bag_dataset, bag_parts
from ahv_analysis.bag.reader import read, read_bag
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly_library
from ahv_analysis.quantities import QUANTITIES
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    BASIS_NAMES,
    DISTURBANCE_ESTIMATE,
    LEARNER,
    LEARNER_NAMES,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
)
from ahv_plant.model.aerodynamics import air_data
from ahv_plant.model.vectors import State


@pytest.fixture(scope="module", params=["nominal_di", "neuro_adaptive_di"])
def bag(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "bag"
    fly_library(load_case(request.param, {"duration": 0.5}), path)
    return path


def test_every_recorded_value_is_there(bag):
    flight, record = bag_dataset(bag), read_bag(bag)
    assert flight["time"].values.tolist() == record.time.tolist()
    arrays = {
        STATE: record.states,
        ATTITUDE_COMMAND: record.attitude_commands,
        RATE_COMMAND: record.rate_commands,
        SURFACE_COMMAND: record.surfaces,
        THROTTLE_COMMAND: record.throttle[:, None],
    }
    if record.learner is not None:
        arrays |= {LEARNER: record.learner, DISTURBANCE_ESTIMATE: record.estimates}
    for topic, array in arrays.items():
        recorded = [one.name for one in QUANTITIES if one.topic is topic and one.name in flight]
        assert len(recorded) == array.shape[1]
        for name, column in zip(recorded, array.T, strict=True):
            assert flight[name].values.tobytes() == column.tobytes(), name
    assert set(flight) == {one.name for one in QUANTITIES if one.values(record) is not None}


def test_derived_signals_are_those_of_the_laws(bag):
    flight, record = bag_dataset(bag), read_bag(bag)
    for place, row in enumerate(record.states.tolist()):
        air = air_data(State(*row), record.geometric)
        for name in ("alpha", "beta", "mach", "dynamic_pressure", "speed"):
            assert flight[name].values[place] == getattr(air, name), name
    climb = np.gradient(flight["h"].values, flight["time"].values)
    assert np.allclose(np.sin(flight["gamma"]) * flight["speed"], climb, atol=0.5)


def test_every_signal_says_what_it_is(bag):
    for name, signal in bag_dataset(bag).data_vars.items():
        assert set(signal.attrs) == {"units", "frame", "long_name", "source"}, name
        assert signal.attrs["units"] and signal.attrs["long_name"] and signal.attrs["source"]


def test_units_and_fields_are_those_of_the_topics():
    for topic in (STATE, ATTITUDE_COMMAND, RATE_COMMAND, SURFACE_COMMAND, THROTTLE_COMMAND):
        recorded = [one for one in QUANTITIES if one.topic is topic]
        units = topic.units.split(", ")
        assert [one.unit for one in recorded] == units * (len(recorded) // len(units))
        fields = list(range(len(topic.layout.fields)))
        # states are there twice: as they are and as they are measured
        assert [one.index for one in recorded] == fields * (2 if topic is STATE else 1)
    names = [one.name for one in QUANTITIES if one.topic is LEARNER]
    assert names == [name.replace(".", "_") for name in LEARNER_NAMES]


def test_units_of_the_learner_follow_from_those_of_its_basis():
    units = {one.name: one.unit for one in QUANTITIES}
    assert {units[f"{plant}_{rate}"] for plant in ("X_a", "X_d") for rate in "PQR"} == {"rad/s"}
    assert {units[f"d_{rate}"] for rate in "PQR"} == {"rad/s^2"}
    for term in BASIS_NAMES:
        power = sum(int(part or 1) for part in re.findall(r"[PQR](\d?)", term))
        expected = f"deg/s^2/(deg/s)^{power}" if power else "deg/s^2"
        assert {units[f"W_{rate}_{term}"] for rate in "PQR"} == {expected}, term


def test_attributes_say_what_flew(bag):
    flight = bag_dataset(bag)
    assert flight.attrs["case"] in ("nominal_di", "neuro_adaptive_di")
    assert flight.attrs["altitude"] == "geopotential"
    assert json.loads(flight.attrs["notes"])["parameters"]["plant"]["duration"] == 0.5


def exported(kind, bag):
    with TemporaryDirectory() as folder:
        file = Path(folder) / kind
        with file.open("xb") as sink:
            EXPORTS[kind](bag_parts(read(bag)), sink)
        return io.BytesIO(file.read_bytes())


def test_csv_keeps_every_bit(bag):
    flight = bag_dataset(bag)
    table = pyarrow.csv.read_csv(exported("csv", bag))
    assert table.column_names[:2] == ["time [s]", "u [m/s]"]
    for column, signal in zip(table.columns[1:], flight.data_vars.values(), strict=True):
        assert np.array_equal(column.to_numpy(), signal.values), signal.name


def test_parquet_keeps_every_bit_and_the_units(bag):
    flight = bag_dataset(bag)
    table = pyarrow.parquet.read_table(exported("parquet", bag))
    assert json.loads(table.schema.metadata[b"notes"])["case"] == flight.attrs["case"]
    for name, signal in flight.data_vars.items():
        assert np.array_equal(table[name].to_numpy(), signal.values), name
        assert table.schema.field(name).metadata[b"units"].decode() == signal.attrs["units"]


def test_netcdf_keeps_everything(bag):
    with xarray.open_dataset(exported("netcdf", bag), engine="scipy") as found:
        assert found.identical(bag_dataset(bag))
