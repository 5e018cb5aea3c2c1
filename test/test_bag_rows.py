# Copyright 2026 ahv developers, Apache-2.0
"""Rows of a long flight lie on the disk, and are read as an array is."""

import json

import numpy as np
import pytest

from ahv_analysis.bag.dataset import EXPORTS, bag_dataset, bag_parts
from ahv_analysis.bag.info import bag_info
from ahv_analysis.bag.reader import flight_of, read
from ahv_analysis.bag.rows import GrowingRows, StoredRows, bits_differ, one_by_one, part_of
from ahv_analysis.bag.series import Series
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly_library
from ahv_analysis.replay.result import compare
from ahv_analysis.report.page_flight import read_flights
from ahv_msgs_py.topics import ATTITUDE_COMMAND


@pytest.fixture
def small_blocks(monkeypatch):
    """Blocks of so few rows that a short flight has many."""
    for module in ("rows", "series", "record"):
        monkeypatch.setattr(f"ahv_analysis.bag.{module}.BLOCK", 7)
    monkeypatch.setattr("ahv_analysis.replay.result.BLOCK", 7)


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "bag"
    fly_library(load_case("neuro_adaptive_di", {"duration": 0.4}), path)
    return path


def grown(numbers):
    growing = GrowingRows(numbers.shape[1])
    growing.extend(numbers[:3])
    for row in numbers[3:5]:
        growing.append(row)
    growing.extend(numbers[5:])
    return growing.rows()


@pytest.mark.parametrize("count", [0, 1, 7, 8, 14, 40])
def test_rows_on_the_disk_are_read_as_an_array_is(small_blocks, count):
    numbers = np.random.default_rng(count).normal(size=(count, 5))
    rows = grown(numbers)
    assert isinstance(rows, StoredRows) == (count > 7)
    assert len(rows) == count and rows.shape == (count, 5)
    keys = [slice(None), slice(3, 20), slice(None, None, 2), np.arange(count)[::-1]]
    for key in keys:
        assert np.array_equal(rows[key], numbers[key])
        assert np.array_equal(rows[key, 2], numbers[key, 2])
        assert np.array_equal(rows[key, 1:4], numbers[key, 1:4])
        part = part_of(rows, key, slice(1, None))
        assert np.array_equal(part, numbers[key, 1:])
        assert np.array_equal(part[2:], numbers[key, 1:][2:])
    assert list(one_by_one(rows)) == numbers.tolist()
    if count:
        assert np.array_equal(rows[-1], numbers[-1]) and rows[-1, 3] == numbers[-1, 3]


def test_a_full_disk_is_named(small_blocks, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", "/proc")
    with pytest.raises(BagError, match="/proc cannot hold the numbers of a long flight: "):
        grown(np.zeros((8, 5)))


def test_numbers_are_compared_to_the_last_bit():
    one, other = np.array([[0.0, 1.0]]), np.array([[-0.0, 1.0]])
    assert bits_differ(one, other).tolist() == [[True, False]]


def test_a_replay_is_compared_the_same_on_the_disk(request):
    draws = np.random.default_rng(1)
    stamps = np.arange(0, 40) * 10_000_000
    before = draws.normal(size=(40, 3))
    after = before + (draws.random((40, 3)) < 0.1) * draws.normal(size=(40, 3))

    def found():
        series = [Series(stamps, grown(numbers)) for numbers in (before, after)]
        return compare(
            "outer_intermediate", ATTITUDE_COMMAND, "/ahv/attitude_command", *series, stamps
        )

    compared = found()
    unlike = np.flatnonzero((before != after).any(axis=1))
    assert compared.differences == len(unlike) > 5
    assert compared.first.stamp == stamps[unlike[0]]
    assert abs(compared.largest.size) == np.max(np.abs(after - before))
    request.getfixturevalue("small_blocks")
    assert found() == compared


def test_readers_say_the_same_of_what_lies_on_the_disk(bag, tmp_path, request):
    def said(folder):
        folder.mkdir()
        held = read(bag)
        for kind, write in EXPORTS.items():
            with (folder / kind).open("xb") as sink:
                write(bag_parts(held), sink)
        metrics = read_flights([bag])[0].metrics
        parquet = json.dumps([json.loads(json.dumps(bag_info(bag))), metrics])
        texts = [(folder / kind).read_bytes() for kind in ("csv", "netcdf")]
        return parquet, texts, bag_dataset(bag)

    facts, files, dataset = said(tmp_path / "memory")
    request.getfixturevalue("small_blocks")
    assert isinstance(flight_of(read(bag)).learner, StoredRows)
    facts_then, files_then, dataset_then = said(tmp_path / "disk")
    assert facts_then == facts and files_then == files and dataset_then.identical(dataset)
