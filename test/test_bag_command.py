# Copyright 2026 ahv developers, Apache-2.0
"""`ahv bag`: facts, recovery, tables; damage is one sentence, exit code 2, and left as it is."""

import json
import signal

import pytest
from typer.testing import CliRunner

from ahv_analysis.bag.dataset import bag_parts
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.command.app import app
from ahv_analysis.command.bag import export
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly_library
from test.bags import DAMAGES, cut_in_flight, one_bit_flipped, without_a_topic, without_metadata


def ahv(*arguments):
    """Run the command in this process, as wide as a terminal needs for long paths."""
    return CliRunner().invoke(app, [*map(str, arguments)], env={"COLUMNS": "300"})


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "bag"
    plant = {"duration": 1.0, "dispersion.CL": 1.1}
    fly_library(load_case("nominal_di", plant), path)
    return path


def tree(folder):
    """Everything in a folder, with its contents and times."""
    return {
        path: (path.stat().st_mtime_ns, path.is_file() and path.read_bytes())
        for path in (folder, *folder.rglob("*"))
    }


def test_info_as_json(whole):
    result = ahv("bag", "info", whole, "--json")
    assert result.exit_code == 0
    facts = json.loads(result.stdout)
    assert facts["complete"] is True and facts["recovered"] is None
    assert facts["case"] == "nominal_di"
    assert (facts["duration_s"], facts["planned_s"]) == (1.0, 1.0)
    assert (facts["steps"], facts["missing_steps"], facts["messages"]) == (100, 0, 606)
    assert facts["notes"]["parameters"]["plant"]["dispersion.CL"] == 1.1
    topics = {topic["name"]: topic for topic in facts["topics"]}
    assert topics["/ahv/state"] == {
        "name": "/ahv/state",
        "type": "sensor_msgs/msg/JointState",
        "messages": 101,
    }


def test_info_as_a_table(whole):
    result = ahv("bag", "info", whole)
    assert result.exit_code == 0
    for words in ("nominal_di", "1 s of 1 s, 100 steps", "yes", "CL 1.1", "101 x sensor_msgs/msg"):
        assert words in result.stdout


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize(
    "command",
    [
        ("bag", "info", "BAG"),
        ("bag", "info", "BAG", "--json"),
        ("bag", "export", "BAG", "--csv", "OUT"),
        ("figures", "BAG", "--out", "OUT"),
    ],
)
def test_damage_is_named_and_nothing_is_changed(tmp_path, whole, damage, command):
    bag, out = tmp_path / "bag", tmp_path / "out"
    damage(bag, whole)
    before = tree(tmp_path)
    result = ahv(*({"BAG": bag, "OUT": out}.get(word, word) for word in command))
    assert result.exit_code == 2
    if "--json" in command:
        assert str(bag) in json.loads(result.stdout)["error"] and result.stderr == ""
    else:
        assert result.stdout == ""
        assert result.stderr.startswith("ahv: ") and str(bag) in result.stderr
        assert result.stderr.count("\n") == 1
    assert tree(tmp_path) == before


@pytest.mark.parametrize(
    "damage, words",
    [
        (one_bit_flipped, ("bag.mcap", "checksum of a chunk", "ahv bag recover")),
        (cut_in_flight, ("no metadata.yaml", "recorder was stopped", "ahv bag recover")),
        (without_metadata, ("no metadata.yaml", "ahv bag recover")),
        (without_a_topic, ("no messages on /ahv/state", "but on /ahv/attitude_command")),
    ],
)
def test_damage_is_named_by_what_it_is(tmp_path, whole, damage, words):
    damage(tmp_path / "bag", whole)
    result = ahv("bag", "info", tmp_path / "bag")
    assert all(word in result.stderr for word in words), result.stderr


def test_recover_says_what_was_lost(tmp_path, whole):
    one_bit_flipped(tmp_path / "bag", whole)
    before = tree(tmp_path / "bag")
    result = ahv("bag", "recover", tmp_path / "bag", "--out", tmp_path / "new")
    assert result.exit_code == 2  # all of this short flight was in the damaged chunk
    assert "no message that can be read" in result.stderr
    assert tree(tmp_path / "bag") == before and not (tmp_path / "new").exists()


def test_recover_writes_beside_the_bag(tmp_path, whole):
    without_metadata(tmp_path / "bag", whole)
    before = tree(tmp_path / "bag")
    result = ahv("bag", "recover", tmp_path / "bag", "--json")
    assert result.exit_code == 0
    facts = json.loads(result.stdout)
    assert facts["source"] == str(tmp_path / "bag")
    assert facts["recovered"] == str(tmp_path / "bag-recovered")
    assert (facts["lost_messages"], facts["messages"], facts["steps"]) == (0, 606, 100)
    (loss,) = facts["losses"]
    assert loss["file"] == "metadata.yaml" and loss["what"] == "it is missing"
    assert tree(tmp_path / "bag") == before
    table = ahv("bag", "recover", tmp_path / "bag", "--out", tmp_path / "again")
    assert table.exit_code == 0 and "606 messages, 1 s of 1 s, 100 steps" in table.stdout
    assert "yes: recovered, 0 messages lost" in ahv("bag", "info", tmp_path / "again").stdout
    again = ahv("bag", "recover", tmp_path / "bag")
    assert again.exit_code == 2 and "bag-recovered exists already" in again.stderr


def test_recover_of_a_whole_bag_does_nothing(tmp_path, whole):
    result = ahv("bag", "recover", whole, "--out", tmp_path / "new")
    assert result.exit_code == 0 and "nothing to recover" in result.stdout
    result = ahv("bag", "recover", whole, "--out", tmp_path / "new", "--json")
    assert json.loads(result.stdout) == {"source": str(whole), "recovered": None}
    assert list(tmp_path.iterdir()) == []


def test_recover_of_a_bag_that_lost_a_topic_altogether(tmp_path):
    bag = BagWriter(tmp_path / "bag")
    bag.write("/clock", bytes([0, 1, 0, 0]) + bytes(8))
    bag.close()
    (tmp_path / "bag" / "metadata.yaml").unlink()
    result = ahv("bag", "recover", tmp_path / "bag", "--json")
    assert json.loads(result.stdout)["steps"] is None
    table = ahv("bag", "recover", tmp_path / "bag", "--out", tmp_path / "again")
    assert "1 messages, no step of a flight" in table.stdout


def test_export_writes_what_is_asked_for(tmp_path, whole):
    files = {kind: tmp_path / f"flight.{kind}" for kind in ("csv", "parquet", "netcdf")}
    options = [word for kind, file in files.items() for word in (f"--{kind}", file)]
    result = ahv("bag", "export", whole, *options, "--json")
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert facts["files"] == {kind: str(file) for kind, file in files.items()}
    assert (facts["samples"], facts["signals"]) == (101, 29)
    assert all(file.stat().st_size > 10_000 for file in files.values())


def test_an_export_ends_on_a_signal_and_leaves_nothing(tmp_path, whole, monkeypatch):
    def parts(bag):
        part = next(bag_parts(bag))
        yield part
        signal.raise_signal(signal.SIGINT)
        yield part

    monkeypatch.setattr("ahv_analysis.bag.dataset.bag_parts", parts)
    for kind in ("csv", "parquet", "netcdf"):
        with pytest.raises(KeyboardInterrupt):
            export(whole, **{kind: tmp_path / kind})
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "options, words",
    [
        ((), "name a file with --csv, --parquet or --netcdf"),
        (("--csv", "there.csv"), "there.csv exists already"),
        (("--csv", "new.csv", "--parquet", "there.csv"), "there.csv exists already"),
        (("--csv", "no/folder.csv"), "cannot write no/folder.csv: No such file or directory"),
    ],
)
def test_export_overwrites_nothing(tmp_path, monkeypatch, whole, options, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.csv").write_text("mine")
    result = ahv("bag", "export", whole, *options)
    assert result.exit_code == 2 and words in result.stderr
    assert result.stderr.count("\n") == 1
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [
        ("there.csv", "mine")
    ]
