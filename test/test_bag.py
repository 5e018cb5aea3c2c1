"""What is no bag, or a damaged one, is named in one sentence; others' messages are read."""

import shutil

import numpy as np
import pytest
from rclpy.serialization import serialize_message

from ahv_analysis.bag_reader import read_bag
from ahv_analysis.bag_writer import BagWriter
from ahv_analysis.case import load_case
from ahv_analysis.errors import BagError
from ahv_analysis.flight import fly, fly_library
from ahv_analysis.record import record
from ahv_msgs_py.topics import CLOCK, LOOP_TOPICS
from test.test_messages import message_of


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Bag of a short flight."""
    path = tmp_path_factory.mktemp("whole") / "bag"
    fly_library(load_case("nominal_di", {"duration": 1.0}), path)
    return path


def test_a_library_bag_gives_the_flight_back(whole):
    case = load_case("nominal_di", {"duration": 1.0})
    flown, computed = read_bag(whole), record(fly(case), False)
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
        values = tuple(float(number) for number in range(len(topic.layout.fields)))
        message = message_of(topic, 70_000_000, values)
        message.header.frame_id = ""
        bag.write(topic.name, serialize_message(message))
    bag.close()
    flown = read_bag(tmp_path / "bag")
    assert flown.stamps.tolist() == [70_000_000]
    assert flown.states.tolist() == [[float(number) for number in range(13)]]


def without_metadata(path, whole):
    shutil.copytree(whole, path)
    (path / "metadata.yaml").unlink()


def cut_short(path, whole):
    shutil.copytree(whole, path)
    file = next(path.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-100])


def cut_to_nothing(path, whole):
    shutil.copytree(whole, path)
    next(path.glob("*.mcap")).write_bytes(b"")


def without_the_data(path, whole):
    shutil.copytree(whole, path)
    next(path.glob("*.mcap")).unlink()


def nonsense_metadata(path, whole):
    shutil.copytree(whole, path)
    (path / "metadata.yaml").write_text("hello: [")


def a_file(path, whole):
    path.write_text("hello")


def one_topic_only(path, whole):
    bag = BagWriter(path)
    bag.write(CLOCK.name, bytes([0, 1, 0, 0]) + bytes(8))
    bag.close()


@pytest.mark.parametrize(
    "damage",
    [
        without_metadata,
        cut_short,
        cut_to_nothing,
        without_the_data,
        nonsense_metadata,
        a_file,
        one_topic_only,
    ],
)
def test_what_is_no_whole_bag_is_named(tmp_path, whole, damage):
    path = tmp_path / "bag"
    damage(path, whole)
    with pytest.raises(BagError) as error:
        read_bag(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_no_bag_at_all_is_named(tmp_path):
    with pytest.raises(BagError, match="not a bag"):
        read_bag(tmp_path / "nothing")


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(BagError, match="cannot write a bag"):
        BagWriter(tmp_path / "file" / "bag")
