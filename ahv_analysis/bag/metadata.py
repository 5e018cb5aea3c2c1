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
from ahv_analysis.errors import BagError

METADATA_FILE = "metadata.yaml"
VERSION = 9  # of the metadata, as Jazzy writes it
DISTRO = "jazzy"
RECORD = "rosbag2"  # name of the metadata record of an MCAP file, and its key
_YamlLoader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TEXT = "serialized_metadata"
NOTES = "ahv"  # key of the notes of a flight in the custom data
QOS_KEY, HASH_KEY = "offered_qos_profiles", "topic_type_hash"  # of a channel's metadata


class Topic(NamedTuple):
    """A topic of a bag."""

    name: str
    type_name: str
    qos: str  # profiles offered, as YAML
    type_hash: str

    @classmethod
    def of(cls, channel: Channel, schema: Schema) -> "Topic":
        """Topic of an MCAP channel."""
        qos, type_hash = (channel.metadata.get(key, "") for key in (QOS_KEY, HASH_KEY))
        return cls(channel.topic, schema.name, qos, type_hash)

    def channel(self, number: int, schema: int) -> Channel:
        """The topic as channel `number` of an MCAP file."""
        return Channel(
            id=number,
            topic=self.name,
            message_encoding="cdr",
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
                    "serialization_format": "cdr",
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
        return list(dump_qos_v9(parse_qos(qos)))
    except (ReaderError, KeyError, TypeError, ValueError, AttributeError):
        return []


def metadata_record(metadata: Mapping[str, Any]) -> Metadata:
    """Metadata of a bag as a record of its MCAP file: what a bag without metadata.yaml has."""
    return Metadata(RECORD, {_TEXT: _text(metadata)})


def custom_of_record(record: Metadata) -> dict[str, str]:
    """Texts of ours in such a record; none where another program wrote it, or nothing."""
    try:
        return dict(yaml.load(record.metadata[_TEXT], _YamlLoader)["custom_data"] or {})
    except (yaml.YAMLError, KeyError, TypeError, ValueError):
        return {}


def read_metadata(path: Path) -> dict[str, Any]:
    """Contents of metadata.yaml of the bag folder `path`; BagError if they do not fit.

    The files of the bag are named as they lie in the folder.
    """
    file = path / METADATA_FILE
    if not file.is_file():
        if any(path.glob("*.mcap")):
            raise BagError(
                f"{path} has no {METADATA_FILE}, so its recorder was stopped before the end; "
                f"`ahv bag recover {path}` gives what it has"
            )
        raise BagError(f"{path} is not a bag: a bag is a folder with a {METADATA_FILE}")
    try:
        content = yaml.load(file.read_text(encoding="utf-8"), _YamlLoader)
        metadata: dict[str, Any] = content["rosbag2_bagfile_information"]
        storage = metadata["storage_identifier"]
        metadata["relative_file_paths"] = [
            Path(name).name for name in metadata["relative_file_paths"]
        ]
    except (yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise BagError(f"{file} is not the metadata of a bag: {reason}") from error
    if storage != "mcap":
        raise BagError(f"{path} is stored as {storage!r}, but must be 'mcap'")
    return metadata


def missing_files(path: Path, metadata: Mapping[str, Any]) -> list[str]:
    """Files of the bag folder `path` that its metadata names and that are not there."""
    return [name for name in metadata["relative_file_paths"] if not (path / name).is_file()]


def write_metadata(folder: Path, metadata: Mapping[str, Any]) -> None:
    """Write metadata.yaml in one go: a bag that has it is complete."""
    part = folder / f"{METADATA_FILE}.part"
    part.write_text(_text({"rosbag2_bagfile_information": dict(metadata)}), encoding="utf-8")
    part.replace(folder / METADATA_FILE)


def qos_text(profiles: Sequence[Any]) -> str:
    """Profiles of rosbags as the YAML text of a channel."""
    return _text(dump_qos_v9(list(profiles))).strip()


def _text(content: object) -> str:
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
