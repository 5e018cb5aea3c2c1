# Copyright 2026 ahv developers, Apache-2.0
"""Bags that tests damage, and such as stock rosbag2 records them."""

import shutil
from pathlib import Path

import yaml
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from ahv_analysis.bag.reader import load_bag
from ahv_analysis.bag.writer import BagWriter
from ahv_msgs_py.topics import CLOCK, STATE

QOS = """\
- history: keep_last
  depth: 10
  reliability: best_effort
  durability: volatile
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: automatic
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
EPOCH = 1_800_000_000_000_000_000  # [ns] stock bags are filed under the time of the wall


def mcap_of(bag: Path) -> Path:
    (file,) = bag.glob("*.mcap")
    return file


def without_metadata(path, whole):
    shutil.copytree(whole, path)
    (path / "metadata.yaml").unlink()


def cut_short(path, whole):
    shutil.copytree(whole, path)
    file = mcap_of(path)
    file.write_bytes(file.read_bytes()[:-100])


def cut_in_flight(path, whole):
    """As kill -9 leaves it: no metadata, the last chunk cut off."""
    without_metadata(path, whole)
    file = mcap_of(path)
    data = file.read_bytes()
    file.write_bytes(data[: 2 * len(data) // 3])


def cut_to_nothing(path, whole):
    shutil.copytree(whole, path)
    mcap_of(path).write_bytes(b"")


def one_bit_flipped(path, whole):
    """In the middle of the first chunk."""
    shutil.copytree(whole, path)
    file = mcap_of(path)
    data = bytearray(file.read_bytes())
    data[data.index(b"zstd") + 500] ^= 0x10
    file.write_bytes(data)


def without_the_data(path, whole):
    shutil.copytree(whole, path)
    mcap_of(path).unlink()


def nonsense_metadata(path, whole):
    shutil.copytree(whole, path)
    (path / "metadata.yaml").write_text("hello: [")


def metadata_of_something_else(path, whole):
    shutil.copytree(whole, path)
    (path / "metadata.yaml").write_text("hello: there")


def a_file(path, whole):
    path.write_text("hello")


def an_empty_folder(path, whole):
    path.mkdir()


def an_empty_bag(path, whole):
    BagWriter(path).close()


def one_topic_only(path, whole):
    bag = BagWriter(path)
    bag.write(CLOCK.name, bytes([0, 1, 0, 0]) + bytes(8))
    bag.close()


def without_a_topic(path, whole):
    bag = BagWriter(path)
    for name, topic in load_bag(whole).items():
        if name != STATE.name:
            bag.write(name, *topic.messages)
    bag.close()


DAMAGES = [
    without_metadata,
    cut_short,
    cut_in_flight,
    cut_to_nothing,
    one_bit_flipped,
    without_the_data,
    nonsense_metadata,
    metadata_of_something_else,
    a_file,
    an_empty_folder,
    an_empty_bag,
    one_topic_only,
    without_a_topic,
]


def stock(path, whole, compression=CompressionType.NONE, use_chunking=True, files=2):
    """The flight of a bag as `ros2 bag record -s mcap` would have it.

    In several files, filed under times of arrival, topic by topic as discovered, with the senders'
    quality of service and without the notes of ahv.
    """
    path.mkdir()
    store = get_typestore(Stores.ROS2_JAZZY)
    topics = [(name, topic) for name, topic in load_bag(whole).items() if topic.messages]
    names = [f"{path.name}_{number}.mcap" for number in range(files)]
    for number, name in enumerate(names):
        with open(path / name, "wb") as sink:
            writer = Writer(
                sink, chunk_size=5000, compression=compression, use_chunking=use_chunking
            )
            writer.start("ros2")
            for topic_name, topic in topics:
                definition, _ = store.generate_msgdef(topic.type_name, ros_version=2)
                schema = writer.register_schema(topic.type_name, "ros2msg", definition.encode())
                metadata = {"offered_qos_profiles": QOS}
                channel = writer.register_channel(topic_name, "cdr", schema, metadata)
                share = -(-len(topic.messages) // files)
                begin = number * share
                for place, data in enumerate(topic.messages[begin : begin + share], begin):
                    time = EPOCH + place * 10_000_000 + 123_456
                    writer.add_message(channel, time, data, time)
            writer.finish()
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        "relative_file_paths": names,
        "message_count": sum(len(topic.messages) for _, topic in topics),
        "compression_format": "",
        "compression_mode": "",
        "custom_data": None,
        "ros_distro": "jazzy",
    }
    (path / "metadata.yaml").write_text(
        yaml.safe_dump({"rosbag2_bagfile_information": information})
    )
