# Copyright 2026 ahv developers, Apache-2.0
"""What rosbag2 wants to know of a bag: metadata.yaml, and the same text in its MCAP file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from mcap.records import Channel, Metadata, Schema
from rosbags.rosbag2.errors import ReaderError
from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos

from ahv_analysis.bag.mcap_file import Contents
from ahv_analysis.bag.plain_file import read_text
from ahv_analysis.errors import BagError
from ahv_msgs_py.layout import excerpt

METADATA_FILE = "metadata.yaml"
VERSION = 9  # of the metadata, as Jazzy writes it
DISTRO = "jazzy"
RECORD = "rosbag2"  # name of the metadata record of an MCAP file, and its key
_YamlLoader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_YamlDumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
LARGEST = 2**22  # [bytes] of metadata as text
LONGEST_NAME = 255  # [bytes] of a file
MOST_NODES, DEEPEST = 200_000, 30  # of YAML: more than a thousand topics and files have
_TEXT = "serialized_metadata"
QOS_KEY, HASH_KEY = "offered_qos_profiles", "topic_type_hash"  # of a channel's metadata


class BagMetadata(NamedTuple):
    """What of the metadata of a bag is read."""

    files: list[str]  # as they lie in the folder
    messages: int | None  # None if that is not said
    custom: dict[str, str]  # texts by their keys


class Topic(NamedTuple):
    """A topic of a bag."""

    name: str
    type_name: str
    qos: str  # profiles offered, as YAML
    type_hash: str
    encoding: str = "cdr"

    @classmethod
    def of(cls, channel: Channel, schema: Schema | None) -> "Topic":
        """Topic of an MCAP channel, whose messages may have no schema."""
        qos, type_hash = (channel.metadata.get(key, "") for key in (QOS_KEY, HASH_KEY))
        type_name = "" if schema is None else schema.name
        return cls(channel.topic, type_name, qos, type_hash, channel.message_encoding)

    def channel(self, number: int, schema: int) -> Channel:
        """The topic as channel `number` of an MCAP file."""
        return Channel(
            id=number,
            topic=self.name,
            message_encoding=self.encoding,
            metadata={QOS_KEY: self.qos, HASH_KEY: self.type_hash},
            schema_id=schema,
        )


class BagFile(NamedTuple):
    """One file of a bag."""

    name: str
    contents: Contents
    topics: dict[int, Topic]  # by channel


def bag_metadata(files: Sequence[BagFile], custom: Mapping[str, str]) -> dict[str, Any]:
    """Metadata of a bag of these files, at least one; `custom` are texts of ours by their keys."""
    filled = [file.contents for file in files if any(file.contents.counts.values())]
    start = min((contents.start for contents in filled), default=0)
    end = max((contents.end for contents in filled), default=0)
    counts: dict[Topic, int] = {}
    for file in files:
        for channel, topic in file.topics.items():
            counts[topic] = counts.get(topic, 0) + file.contents.counts[channel]
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": end - start},
        "starting_time": {"nanoseconds_since_epoch": start},
        "message_count": sum(counts.values()),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": topic.encoding,
                    "offered_qos_profiles": _profiles(topic.qos),
                    "type_description_hash": topic.type_hash,
                },
                "message_count": count,
            }
            for topic, count in counts.items()
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.name for file in files],
        "files": [
            {
                "path": file.name,
                "starting_time": {"nanoseconds_since_epoch": file.contents.start},
                "duration": {"nanoseconds": file.contents.end - file.contents.start},
                "message_count": sum(file.contents.counts.values()),
            }
            for file in files
        ],
        "custom_data": dict(custom) or None,
        "ros_distro": DISTRO,
    }


def _profiles(qos: str) -> list[Any]:
    """Quality of service of a channel as metadata.yaml has it; nothing of what nobody can read."""
    try:
        profiles = load_yaml(qos)
        return list(dump_qos_v9(parse_qos(profiles))) if isinstance(profiles, list) else []
    except (ReaderError, KeyError, TypeError, ValueError, AttributeError):
        return []


def load_yaml(text: str) -> Any:
    """Content of YAML from outside; ValueError if it is none, or more than metadata can be.

    An alias counts as what it stands for, by which a few lines come to gigabytes.
    """
    nodes = 0
    sizes: dict[str, int] = {}  # nodes by anchor
    opened: list[tuple[str | None, int]] = []  # anchors of the collections around, nodes before
    try:
        for event in yaml.parse(text, _YamlLoader):
            if isinstance(event, yaml.AliasEvent):
                if event.anchor not in sizes:
                    raise ValueError("it has a YAML alias of what is around it, or of nothing")
                nodes += sizes[event.anchor]
            elif isinstance(event, yaml.CollectionStartEvent):
                opened.append((event.anchor, nodes))
            elif isinstance(event, yaml.CollectionEndEvent):
                anchor, before = opened.pop()
                sizes |= {anchor: nodes - before} if anchor else {}
            elif isinstance(event, yaml.ScalarEvent) and event.anchor:
                sizes[event.anchor] = 1
            nodes += 1
            if nodes > MOST_NODES or len(opened) > DEEPEST:
                raise ValueError("it is too large or too deep")
        return yaml.load(text, _YamlLoader)
    except (yaml.YAMLError, OverflowError) as error:
        raise ValueError(" ".join(str(error).split())) from error


def metadata_record(metadata: Mapping[str, Any]) -> Metadata:
    """Metadata of a bag as a record of its MCAP file: what a bag without metadata.yaml has."""
    return Metadata(RECORD, {_TEXT: _text(metadata)})


def custom_of_record(record: Metadata) -> dict[str, str]:
    """Texts of ours in such a record; none where another program wrote it, or nothing."""
    try:
        content = load_yaml(record.metadata[_TEXT])
    except (KeyError, ValueError):
        return {}
    return _custom(content) if isinstance(content, dict) else {}


def _custom(metadata: dict[Any, Any]) -> dict[str, str]:
    """Whatever stands in `custom_data` as a text under a text; the rest is of no known use."""
    custom = metadata.get("custom_data")
    pairs = custom.items() if isinstance(custom, dict) else ()
    return {key: text for key, text in pairs if isinstance(key, str) and isinstance(text, str)}


def read_metadata(folder: Path) -> BagMetadata:
    """Read metadata.yaml of a bag folder; BagError if there is none, or it does not fit."""
    file = folder / METADATA_FILE
    try:
        content = load_yaml(read_text(file, LARGEST))
    except ValueError as error:
        raise BagError(f"{file} is not the metadata of a bag: {error}") from error
    metadata = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    if not isinstance(metadata, dict):
        raise BagError(f"{file} is not the metadata of a bag: it has no section of rosbag2")
    names = metadata.get("relative_file_paths")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise BagError(f"{file}: relative_file_paths must be a list of names")
    files = [Path(name).name for name in names]
    for name in files:
        if not name.isprintable() or len(name.encode()) > LONGEST_NAME:
            raise BagError(f"{file}: {excerpt(name)} is no name of a file")
    if len(set(files)) < len(files):
        raise BagError(f"{file}: relative_file_paths names a file twice")
    storage = metadata.get("storage_identifier")
    # rosbag2 leaves it empty where it was told nothing, and then goes by the files
    mcap = not storage and all(".mcap" in Path(name).suffixes for name in files)
    if not (storage == "mcap" or mcap):
        raise BagError(f"{folder} is stored as {excerpt(str(storage))}, but must be 'mcap'")
    count = metadata.get("message_count")
    messages = count if isinstance(count, int) and count >= 0 else None
    return BagMetadata(files, messages, _custom(metadata))


def write_metadata(folder: Path, metadata: Mapping[str, Any]) -> None:
    """Write metadata.yaml in one go: a bag that has it is complete."""
    part = folder / f"{METADATA_FILE}.part"
    part.write_text(_text({"rosbag2_bagfile_information": dict(metadata)}), encoding="utf-8")
    part.replace(folder / METADATA_FILE)


def qos_text(profiles: Sequence[Any]) -> str:
    """Profiles of rosbags as the YAML text of a channel."""
    return _text(dump_qos_v9(list(profiles))).strip()


def _text(content: object) -> str:
    text: str = yaml.dump(content, Dumper=_YamlDumper, sort_keys=False, allow_unicode=True)
    return text
