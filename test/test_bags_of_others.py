# Copyright 2026 ahv developers, Apache-2.0
"""Bags as others write, compress, name and spoil them; and whom their readers obey."""

import math
import shutil

import pytest
import yaml
from mcap.opcode import Opcode
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as RosWriter
from rosbags.typesys import Stores, get_typestore
from typer.testing import CliRunner

from ahv_analysis.bag.info import bag_info
from ahv_analysis.bag.mcap_file import MAGIC
from ahv_analysis.bag.reader import flight_of, load_bag, read, read_bag
from ahv_analysis.bag.recovery import recover
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.command.app import app
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import load_case, notes
from ahv_analysis.flight.library import fly, fly_library, write_step
from ahv_msgs_py.node.faults import PERIOD, Fault
from ahv_msgs_py.topics import STATE, SURFACE_COMMAND, THROTTLE_COMMAND
from test.bags import mcap_of, stock
from test.test_hostile_bags import joined, records_of

STEPS = 100


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "bag"
    fly_library(load_case("nominal_di", {"duration": STEPS / 100}), path)
    return path


def ahv(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)], env={"COLUMNS": "300"})


def with_others(path, others):
    """A flight with messages of others: topic, publisher, stamp, values."""
    case = load_case("nominal_di", {"duration": STEPS / 100})
    bag = BagWriter(path, notes(case))
    for step in fly(case):
        write_step(bag, step)
        if step.stamp == 50 * PERIOD:
            for topic, publisher, stamp, values in others:
                bag.write(topic.name, topic.layout.encode(stamp, values), publishers=[publisher])
    bag.close()
    return path


def refused(path):
    return {(entry.topic, entry.fault): entry.messages for entry in read(path).refused}


@pytest.mark.parametrize("stamp", [49, 50, 51, 70, 5000])
def test_a_wrong_command_of_a_second_publisher_is_left_out_whenever_it_comes(
    tmp_path, whole, stamp
):
    wrong = (SURFACE_COMMAND, 2, stamp * PERIOD, (0.3, 0.3, 0.3))
    path = with_others(tmp_path / "bag", [wrong])
    assert read_bag(path).surfaces.tobytes() == read_bag(whole).surfaces.tobytes()
    assert refused(path) == {(SURFACE_COMMAND.name, Fault.SECOND_PUBLISHER): 1}
    assert bag_info(path)["complete"]


def test_a_stray_nan_is_left_out_and_named(tmp_path, whole):
    stray = (STATE, 2, 50 * PERIOD, (math.nan,) * 13)
    path = with_others(tmp_path / "bag", [stray])
    assert read_bag(path).states.tobytes() == read_bag(whole).states.tobytes()
    table = ahv("bag", "info", path)
    assert "1 on /ahv/state: not finite, first u is nan at 0.5 s" in table.stdout
    for command in ("report", "figures"):
        result = ahv(command, path, "--out", tmp_path / command)
        assert result.exit_code == 0, result.stderr


def test_a_publisher_that_takes_over_is_obeyed_from_then_on(tmp_path, whole):
    """A throttle command of another one after the last of the first: as after a restart."""
    case = load_case("nominal_di", {"duration": STEPS / 100})
    bag = BagWriter(tmp_path / "bag")
    for step in fly(case):
        number = 1 + (step.stamp > 50 * PERIOD)
        throttle = THROTTLE_COMMAND.layout.encode(step.stamp, (0.1 + 0.1 * number,))
        write_step(bag, step)
        bag._inboxes[THROTTLE_COMMAND.name].messages.pop()
        bag._inboxes[THROTTLE_COMMAND.name].publishers.pop()
        bag.write(THROTTLE_COMMAND.name, throttle, publishers=[number])
    bag.close()
    assert read_bag(tmp_path / "bag").throttle.tolist() == [0.2] * 51 + [0.1 + 0.1 * 2] * 50
    assert not refused(tmp_path / "bag")


def test_a_second_flight_in_a_bag_is_named(tmp_path):
    bag = BagWriter(tmp_path / "bag")
    for publisher in (1, 2):
        for step in range(3):
            state = STATE.layout.encode(step * PERIOD, (1.0 * publisher,) * 13)
            bag.write(STATE.name, state, publishers=[publisher])
    bag.close()
    with pytest.raises(BagError, match=r"more than one flight.*starts again at 0 s"):
        read_bag(tmp_path / "bag")


def test_an_absurd_state_is_drawn_as_a_gap(tmp_path):
    """Finite, so that receivers obey it, and beyond what anything can draw."""
    path = tmp_path / "bag"
    bag = BagWriter(path)
    for step in fly(load_case("nominal_di", {"duration": STEPS / 100})):
        absurd = step.state._replace(y=1e308 * (-1) ** (step.stamp // PERIOD), v=1e200)
        write_step(bag, step._replace(state=absurd) if step.stamp > 20 * PERIOD else step)
    bag.close()
    for command in ("report", "figures"):
        result = ahv(command, path, "--out", tmp_path / command)
        assert result.exit_code == 0, (result.stderr, result.exception)


def compressed(path, whole, mode):
    writer = RosWriter(path, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for name, topic in load_bag(whole).items():
            link = writer.add_connection(
                name, topic.type_name, typestore=get_typestore(Stores.ROS2_JAZZY)
            )
            for time, data in zip(topic.log_times, topic.messages, strict=True):
                writer.write(link, time, data)


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_a_compressed_bag_without_its_metadata_is_recovered(tmp_path, whole, mode):
    compressed(tmp_path / "bag", whole, mode)
    (tmp_path / "bag" / "metadata.yaml").unlink()
    recovery = recover(tmp_path / "bag", tmp_path / "new")
    assert recovery.lost_messages == 0
    assert read_bag(tmp_path / "new").states.tobytes() == read_bag(whole).states.tobytes()


def rewritten(path, whole, change):
    """A bag whose records are changed; its checksums stay where they are."""
    stock(path, whole, CompressionType.NONE, files=1)
    file = mcap_of(path)
    file.write_bytes(MAGIC + joined(change(records_of(file.read_bytes()[:-8], 8))) + MAGIC)
    return path


def private_records(records):
    """Between all others, and within chunks."""
    private = joined([(0x80, b"private"), (0x40, b"")])
    for opcode, body in records:
        if opcode == Opcode.CHUNK:  # not compressed: size, checksum left out, no name
            plain = body[40:] + private
            size = len(plain).to_bytes(8, "little")
            body = body[:16] + size + bytes(8) + size + plain
        yield from ((0x80, b"private"), (opcode, body))


def test_records_of_unknown_opcodes_are_passed_over(tmp_path, whole):
    def change(records):
        return [
            (opcode, bytes(len(body)) if opcode in (Opcode.DATA_END, Opcode.FOOTER) else body)
            for opcode, body in private_records(records)
        ]

    path = rewritten(tmp_path / "bag", whole, change)
    assert read_bag(path).states.tobytes() == read_bag(whole).states.tobytes()
    assert recover(path, tmp_path / "new") is None


@pytest.mark.parametrize("use_chunking", [True, False])
def test_a_file_without_a_summary_but_with_checksums_is_whole(tmp_path, whole, use_chunking):
    bag = tmp_path / "bag.mcap"
    with bag.open("wb") as sink:
        writer = Writer(
            sink,
            use_chunking=use_chunking,
            enable_crcs=True,
            enable_data_crcs=use_chunking,  # the writer forgets the last records in no chunk
            use_statistics=False,
            use_summary_offsets=False,
            repeat_schemas=False,
            repeat_channels=False,
            index_types=IndexType.NONE,
        )
        writer.start("ros2")
        for name, topic in load_bag(whole).items():
            schema = writer.register_schema(topic.type_name, "ros2msg", b"")
            channel = writer.register_channel(name, "cdr", schema)
            for time, data in zip(topic.log_times, topic.messages, strict=True):
                writer.add_message(channel, time, data, time)
        writer.finish()
    assert read_bag(bag).states.tobytes() == read_bag(whole).states.tobytes()
    assert recover(bag, tmp_path / "new") is None


def test_channels_without_a_schema_are_recovered(tmp_path, whole):
    bag = tmp_path / "bag.mcap"
    with bag.open("wb") as sink:
        writer = Writer(sink)
        writer.start("ros2")
        channel = writer.register_channel("/json", "json", 0)
        for time in range(100):
            writer.add_message(channel, time, b'{"a": 1}', time)
        writer.finish()
    bag.write_bytes(bag.read_bytes()[:-20])
    recovery = recover(bag, tmp_path / "new")
    assert (recovery.messages, recovery.lost_messages) == (100, 0)
    assert len(load_bag(tmp_path / "new")["/json"].messages) == 100


def test_a_file_and_the_folder_of_a_flight_are_taken_as_bags(tmp_path, whole):
    shutil.copytree(whole, tmp_path / "flight" / "bag")
    for path in (mcap_of(whole), tmp_path / "flight"):
        facts = bag_info(path)
        assert facts["steps"] == STEPS and facts["case"] == "nominal_di"
    assert ahv("figures", tmp_path / "flight", "--out", tmp_path / "out").exit_code == 0


def test_a_file_that_is_not_closed_is_recovered_by_its_name(tmp_path, whole):
    file = tmp_path / "cut.mcap"
    file.write_bytes(mcap_of(whole).read_bytes()[:-100])
    result = ahv("bag", "info", file)
    assert result.exit_code == 2 and f"`ahv bag recover {file}`" in result.stderr
    assert ahv("bag", "recover", file).exit_code == 0
    assert bag_info(tmp_path / "cut-recovered")["steps"] == STEPS


def test_an_empty_storage_identifier_is_that_of_the_files(tmp_path, whole):
    shutil.copytree(whole, tmp_path / "bag")
    file = tmp_path / "bag" / "metadata.yaml"
    content = yaml.safe_load(file.read_text())
    content["rosbag2_bagfile_information"]["storage_identifier"] = ""
    file.write_text(yaml.safe_dump(content))
    assert bag_info(tmp_path / "bag")["complete"]


def test_another_channel_of_a_topic_does_not_hide_the_flight(tmp_path, whole):
    bag = tmp_path / "bag.mcap"
    with bag.open("wb") as sink:
        writer = Writer(sink)
        writer.start("ros2")
        text = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        writer.register_channel(STATE.name, "cdr", text)
        for name, topic in load_bag(whole).items():
            schema = writer.register_schema(topic.type_name, "ros2msg", b"")
            channel = writer.register_channel(name, "cdr", schema)
            for time, data in zip(topic.log_times, topic.messages, strict=True):
                writer.add_message(channel, time, data, time)
        writer.finish()
    assert flight_of(read(bag)).steps == STEPS
