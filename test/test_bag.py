# Copyright 2026 ahv developers, Apache-2.0
"""What is no bag, or a damaged one, is named in one sentence; others' messages are read."""

import sys

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap.writer import CompressionType
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from ahv_analysis.bag.reader import flight_of, load_bag, read, read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly, fly_library
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.topics import CLOCK, LOOP_TOPICS, NOMINAL_TOPICS, STATE
from test.bags import DAMAGES, mcap_of, stock
from test.test_messages import message_of


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Bag of a short flight."""
    path = tmp_path_factory.mktemp("whole") / "bag"
    fly_library(load_case("nominal_di", {"duration": 1.0}), path)
    return path


def test_a_library_bag_gives_the_flight_back(whole):
    case = load_case("nominal_di", {"duration": 1.0})
    flown, computed = read_bag(whole), record_of(fly(case), False)
    for name in ("stamps", "states", "attitude_commands", "rate_commands", "surfaces", "throttle"):
        assert np.array_equal(getattr(flown, name), getattr(computed, name)), name


def test_the_bag_knows_which_altitude_was_flown(tmp_path):
    case = load_case("nominal_di", {"duration": 0.1})
    case.parameters["plant"]["geometric_altitude"] = True
    fly_library(case, tmp_path / "bag")
    assert read_bag(tmp_path / "bag").geometric


def test_messages_of_another_sender_are_read(tmp_path):
    bag = BagWriter(tmp_path / "bag")
    for topic in LOOP_TOPICS:
        values = SAFE[topic]
        message = message_of(topic, 70_000_000, values)
        message.header.frame_id = ""
        bag.write(topic.name, serialize_message(message))
    bag.close()
    flown = read_bag(tmp_path / "bag")
    assert flown.stamps.tolist() == [70_000_000]
    assert flown.states.tolist() == [SAFE[STATE]]


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_no_whole_bag_is_named(tmp_path, whole, damage):
    path = tmp_path / "bag"
    damage(path, whole)
    with pytest.raises(BagError) as error:
        read_bag(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize("compression", CompressionType)
@pytest.mark.parametrize("use_chunking", [True, False])
def test_a_bag_of_stock_rosbag2_is_read(tmp_path, whole, compression, use_chunking):
    stock(tmp_path / "stock", whole, compression, use_chunking)
    flown, ours = read_bag(tmp_path / "stock"), read_bag(whole)
    assert flown.stamps.tolist() == ours.stamps.tolist()
    assert flown.states.tobytes() == ours.states.tobytes()
    assert flown.throttle.tobytes() == ours.throttle.tobytes()
    assert read(tmp_path / "stock").notes is None


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_a_bag_that_rosbag2_compressed_is_read(tmp_path, whole, mode):
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for name, topic in load_bag(whole).items():
            link = writer.add_connection(
                name, topic.type_name, typestore=get_typestore(Stores.ROS2_JAZZY)
            )
            for time, data in zip(topic.log_times, topic.messages, strict=True):
                writer.write(link, time, data)
    assert read_bag(tmp_path / "bag").states.tobytes() == read_bag(whole).states.tobytes()


def test_a_bag_stored_otherwise_is_named(tmp_path):
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3):
        pass
    with pytest.raises(BagError, match="stored as 'sqlite3', but must be 'mcap'"):
        read_bag(tmp_path / "bag")


SAFE = {topic: [max(low, min(1.0, high)) for low, high in topic.bounds] for topic in LOOP_TOPICS}


def two_states(path, differ):
    """A bag with one step and its state twice, without the number of a publisher."""
    bag = BagWriter(path)
    for topic in NOMINAL_TOPICS:
        bag.write(topic.name, topic.layout.encode(0, SAFE[topic]), publishers=[0])
    bag.write(STATE.name, STATE.layout.encode(0, [1.0 + differ] * 13), publishers=[0])
    bag.close()
    return path


def test_a_message_that_came_twice_counts_once(tmp_path):
    assert read_bag(two_states(tmp_path / "bag", 0.0)).states.tolist() == [[1.0] * 13]


def test_a_bag_of_two_flights_is_named(tmp_path):
    with pytest.raises(BagError, match="more than one flight"):
        read_bag(two_states(tmp_path / "bag", 1e-15))


@pytest.mark.parametrize("data", [b"", b"abc", bytes(200), b"\x00\x01\x00\x00" + bytes(range(90))])
def test_a_message_that_is_none_is_left_out_as_receivers_do_and_counted(tmp_path, data):
    bag = BagWriter(tmp_path / "bag")
    for topic in NOMINAL_TOPICS:
        bag.write(topic.name, topic.layout.encode(0, SAFE[topic]))
    bag.write(STATE.name, data)
    bag.close()
    held = read(tmp_path / "bag")
    assert flight_of(held).states.tolist() == [SAFE[STATE]]
    (refused,) = held.refused
    assert (refused.topic, refused.fault, refused.messages) == (STATE.name, Fault.MALFORMED, 1)


def test_a_message_of_another_sender_is_read_without_ros(tmp_path, monkeypatch):
    path = two_states(tmp_path / "bag", 0.0)
    monkeypatch.setattr("ahv_analysis.bag.reader.STATE.layout.decode", lambda data: None)
    monkeypatch.setattr("ahv_analysis.bag.reader.STATE.layout.decode_rows", no_message_fits)
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert read_bag(path).states.tolist() == [SAFE[STATE]]


def no_message_fits(rows):
    count = len(rows)
    return np.zeros(count, np.int64), np.zeros((count, 13)), np.zeros(count, bool)


def test_a_topic_of_another_type_is_named(tmp_path, whole):
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP)
    with writer:
        store = get_typestore(Stores.ROS2_JAZZY)
        link = writer.add_connection(STATE.name, "std_msgs/msg/Float64", typestore=store)
        writer.write(link, 0, bytes([0, 1, 0, 0]) + bytes(8))
    with pytest.raises(BagError, match="is of type std_msgs/msg/Float64, but must be sensor_msgs"):
        read_bag(tmp_path / "bag")


def test_bags_open_in_rosbags_and_mcap_with_what_rosbag2_wants(whole):
    with Reader(whole) as bag:
        assert bag.ros_distro == "jazzy"
        for link in bag.connections:
            (qos,) = link.ext.offered_qos_profiles
            assert qos.reliability.name == "RELIABLE" and qos.durability.name == "TRANSIENT_LOCAL"
            assert link.digest.startswith("RIHS01_")
        counts = {link.topic: link.msgcount for link in bag.connections}
        assert counts[STATE.name] == counts[CLOCK.name] == 101
        assert bag.message_count == sum(1 for _ in bag.messages()) == sum(counts.values())
    with mcap_of(whole).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert {schema.encoding for schema in summary.schemas.values()} == {"ros2msg"}
        assert summary.statistics.message_count == sum(counts.values())
        times = [message.log_time for _, _, message in reader.iter_messages()]
        assert times == sorted(times) and times[0] == 0 and times[-1] == 10**9
        (*_, last) = [record for record in reader.iter_metadata() if record.name == "rosbag2"]
    inside = yaml.safe_load(last.metadata["serialized_metadata"])
    outside = yaml.safe_load((whole / "metadata.yaml").read_text())
    assert outside == {"rosbag2_bagfile_information": inside}
    assert inside["version"] == 9 and inside["storage_identifier"] == "mcap"


def test_no_bag_at_all_is_named(tmp_path):
    with pytest.raises(BagError, match="not a bag"):
        read_bag(tmp_path / "nothing")


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(BagError, match="cannot write a bag"):
        BagWriter(tmp_path / "file" / "bag")
