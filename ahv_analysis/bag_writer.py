"""Writing a bag: MCAP through rosbags, message bytes as they come."""

from pathlib import Path
from struct import Struct

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.errors import WriterError
from rosbags.typesys import Stores, get_typestore

from ahv_analysis.errors import BagError
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.topics import LOOP_TOPICS, QUEUE_DEPTH, VIEWER_TOPICS

_FOREVER = QosTime(2147483647, 4294967295)
_QOS = Qos(
    QosHistory.KEEP_LAST,
    QUEUE_DEPTH,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    _FOREVER,
    _FOREVER,
    QosLiveliness.AUTOMATIC,
    _FOREVER,
    False,
)
_STAMP = Struct("<iI")
NOTES = "ahv"  # key of the notes in the bag's custom data


class BagWriter:
    """A new bag with a connection for every topic of the graph.

    Messages are filed under simulated time: their own stamp, or the last one seen where a type has
    none, so that two bags of one flight are alike and play back at the vehicle's pace.
    """

    def __init__(self, path: Path, notes: str = ""):
        """Create the bag folder `path`; BagError if it exists or cannot be made.

        `notes` are filed with the bag; `ahv fly` writes the parameters of the flight there as
        JSON.
        """
        self.path = path
        self.counts: dict[str, int] = {}
        self._now = 0  # [ns]
        self._topics: dict[str, tuple[Connection, int | None]] = {}
        store = get_typestore(Stores.ROS2_JAZZY)
        try:
            self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_custom_data(NOTES, notes)
            self._writer.open()
            topics = [(topic.name, topic.layout.type_name, 4) for topic in LOOP_TOPICS]
            topics += [
                (topic.name, topic.type_name, topic.stamp_offset) for topic in VIEWER_TOPICS
            ]
            for name, type_name, stamp_offset in topics:
                connection = self._writer.add_connection(
                    name, type_name, typestore=store, offered_qos_profiles=[_QOS]
                )
                self._topics[name] = (connection, stamp_offset)
                self.counts[name] = 0
        except (WriterError, OSError) as error:
            raise BagError(f"cannot write a bag to {path}: {error}") from error

    def write(self, topic: str, data: bytes) -> None:
        """File one message of CDR bytes."""
        connection, offset = self._topics[topic]
        if offset is not None:
            seconds, nanoseconds = _STAMP.unpack_from(data, offset)
            self._now = seconds * NANOSECONDS + nanoseconds
        self._writer.write(connection, self._now, data)
        self.counts[topic] += 1

    def close(self) -> None:
        """Write index and metadata; after this the bag is complete."""
        self._writer.close()
