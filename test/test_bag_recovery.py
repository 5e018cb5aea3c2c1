# Copyright 2026 ahv developers, Apache-2.0
"""What is readable of a damaged bag becomes a whole one; what is lost is said, nothing changes."""

import json

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType
from rosbags.rosbag2 import Reader

from ahv_analysis.bag.info import bag_info
from ahv_analysis.bag.reader import load_bag, read, read_bag
from ahv_analysis.bag.recovery import recover
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import load_case, notes
from ahv_analysis.flight.library import fly, write_step
from test.bags import (
    cut_in_flight,
    cut_short,
    cut_to_nothing,
    mcap_of,
    nonsense_metadata,
    one_bit_flipped,
    stock,
    without_a_topic,
    without_metadata,
    without_the_data,
)

STEPS = 400


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Bag of a short flight in chunks of a tenth of it."""
    path = tmp_path_factory.mktemp("whole") / "bag"
    case = load_case("nominal_di", {"duration": STEPS / 100})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("ahv_analysis.bag.writer.LONGEST", STEPS // 10)
        bag = BagWriter(path, notes(case))
        for step in fly(case):
            write_step(bag, step)
        bag.close()
    return path


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def messages(bag):
    return {name: topic.messages for name, topic in load_bag(bag).items()}


@pytest.mark.parametrize("damage", [without_metadata, nonsense_metadata, cut_short])
def test_a_bag_without_its_metadata_or_index_loses_nothing(tmp_path, whole, damage):
    damage(tmp_path / "bag", whole)
    before = contents(tmp_path / "bag")
    recovery = recover(tmp_path / "bag", tmp_path / "new")
    assert contents(tmp_path / "bag") == before
    assert messages(tmp_path / "new") == messages(whole)
    assert recovery.losses and recovery.messages == sum(map(len, messages(whole).values()))
    assert read(tmp_path / "new").notes == read(whole).notes
    if damage is not cut_short:  # the index says how many there were
        assert recovery.lost_messages == 0 and bag_info(tmp_path / "new")["complete"]


@pytest.mark.parametrize("pieces", [0, 5, 60])
def test_a_recovery_ends_on_a_signal_and_leaves_nothing(tmp_path, whole, pieces):
    without_metadata(tmp_path / "bag", whole)
    heard = iter([*[False] * pieces, True])
    with pytest.raises(KeyboardInterrupt):
        recover(tmp_path / "bag", tmp_path / "new", lambda: next(heard))
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_a_bag_that_was_cut_in_flight_keeps_its_beginning(tmp_path, whole):
    cut_in_flight(tmp_path / "bag", whole)
    recovery = recover(tmp_path / "bag", tmp_path / "new")
    kept, flown = read_bag(tmp_path / "new"), read_bag(whole)
    assert recovery.lost_messages is None
    assert STEPS / 2 < kept.steps < STEPS
    assert kept.stamps.tolist() == flown.stamps[: kept.steps + 1].tolist()
    assert kept.states.tobytes() == flown.states[: kept.steps + 1].tobytes()
    assert read(tmp_path / "new").notes.case == "nominal_di"
    assert not bag_info(tmp_path / "new")["complete"]


def test_a_flipped_bit_costs_its_chunk_and_no_more(tmp_path, whole):
    one_bit_flipped(tmp_path / "bag", whole)
    recovery = recover(tmp_path / "bag", tmp_path / "new")
    (loss,) = recovery.losses
    assert "checksum of a chunk" in loss.what and loss.file == "bag.mcap" and loss.size > 500
    facts = bag_info(tmp_path / "new")
    assert facts["missing_steps"] == STEPS // 10 and not facts["complete"]
    assert recovery.lost_messages == 6 * (STEPS // 10)
    assert facts["recovered"] == json.loads(json.dumps(recovery.as_json()))


def test_a_recovered_bag_opens_in_rosbags_and_mcap(tmp_path, whole):
    cut_in_flight(tmp_path / "bag", whole)
    recovery = recover(tmp_path / "bag", tmp_path / "new")
    with Reader(tmp_path / "new") as bag:
        assert sum(1 for _ in bag.messages()) == bag.message_count == recovery.messages
        assert all(link.ext.offered_qos_profiles and link.digest for link in bag.connections)
    with mcap_of(tmp_path / "new").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == recovery.messages
        assert reader.get_summary().statistics.message_count == recovery.messages


@pytest.mark.parametrize("compression", CompressionType)
@pytest.mark.parametrize("use_chunking", [True, False])
def test_a_stock_bag_of_several_files_is_recovered(tmp_path, whole, compression, use_chunking):
    """Its second file as a crash leaves it, its metadata never written."""
    stock(tmp_path / "bag", whole, compression, use_chunking)
    second = tmp_path / "bag" / "bag_1.mcap"
    second.write_bytes(second.read_bytes()[: second.stat().st_size // 2])
    (tmp_path / "bag" / "metadata.yaml").unlink()
    recover(tmp_path / "bag", tmp_path / "new")
    new, old = messages(tmp_path / "new"), messages(whole)
    with Reader(tmp_path / "new") as bag:
        assert bag.message_count == sum(map(len, new.values()))
    for name, found in new.items():
        first = -(-len(old[name]) // 2)
        assert found[:first] == old[name][:first]
        assert set(found) <= set(old[name])
    assert sum(map(len, new.values())) > sum(map(len, old.values())) / 2


def test_a_file_that_is_missing_counts_as_lost(tmp_path, whole):
    stock(tmp_path / "bag", whole)
    (tmp_path / "bag" / "bag_1.mcap").unlink()
    recovery = recover(tmp_path / "bag", tmp_path / "new")
    assert [(loss.file, loss.what) for loss in recovery.losses] == [
        ("bag_1.mcap", "it is missing")
    ]
    assert recovery.lost_messages == sum(map(len, messages(whole).values())) - recovery.messages
    assert not bag_info(tmp_path / "new")["complete"]


def test_a_topic_whose_name_is_lost_is_said_to_be(tmp_path, whole):
    stock(tmp_path / "bag", whole, use_chunking=False, files=1)
    file = tmp_path / "bag" / "bag_0.mcap"
    data = bytearray(file.read_bytes())
    del data[data.rindex(b"\x0f\x04" + bytes(7)) :]  # the index, which names it again
    data[data.index(b"/ahv/state") - 17] = 0x07  # no channel's record any more
    file.write_bytes(data)
    recovery = recover(tmp_path / "bag", tmp_path / "new")
    old, new = messages(whole), messages(tmp_path / "new")
    assert new == {name: old[name] for name in new} and "/ahv/state" not in new
    assert f"{len(old['/ahv/state'])} messages are of topics" in recovery.losses[-1].what


def test_a_whole_bag_is_left_alone(tmp_path, whole):
    assert recover(whole, tmp_path / "new") is None
    assert not (tmp_path / "new").exists()


def test_a_bag_lacking_a_topic_is_whole_as_far_as_it_goes(tmp_path, whole):
    without_a_topic(tmp_path / "bag", whole)
    assert recover(tmp_path / "bag", tmp_path / "new") is None


@pytest.mark.parametrize(
    "damage, words",
    [(cut_to_nothing, "no message that can be read"), (without_the_data, "no MCAP file")],
)
def test_where_nothing_is_left_nothing_is_written(tmp_path, whole, damage, words):
    damage(tmp_path / "bag", whole)
    with pytest.raises(BagError, match=words):
        recover(tmp_path / "bag", tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_nothing_is_overwritten(tmp_path, whole):
    cut_in_flight(tmp_path / "bag", whole)
    (tmp_path / "new").mkdir()
    with pytest.raises(BagError, match="exists already"):
        recover(tmp_path / "bag", tmp_path / "new")
    assert list((tmp_path / "new").iterdir()) == []


def test_a_recovery_can_be_recovered(tmp_path, whole):
    cut_in_flight(tmp_path / "bag", whole)
    recover(tmp_path / "bag", tmp_path / "once")
    once = messages(tmp_path / "once")
    (tmp_path / "once" / "metadata.yaml").unlink()
    recover(tmp_path / "once", tmp_path / "twice")
    assert messages(tmp_path / "twice") == once
    assert read(tmp_path / "twice").notes == read(whole).notes
