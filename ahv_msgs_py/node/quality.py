# Copyright 2026 ahv developers, Apache-2.0
"""Quality of service: what the middleware keeps, and for whom."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from ahv_msgs_py.topics import QUEUE_DEPTH

REALTIME_DEPTH = 10  # messages kept by a receiver in real time: older ones would not be obeyed
SENDER_DEPTH = 1000  # and by a sender there, for a receiver that is slow, as a recorder


def quality(durable: bool, depth: int = QUEUE_DEPTH) -> QoSProfile:
    """Reliable quality of service; `durable` gives a node that joins late what it missed."""
    local = DurabilityPolicy.TRANSIENT_LOCAL if durable else DurabilityPolicy.VOLATILE
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=local,
    )


def newest() -> QoSProfile:
    """Quality of service of a receiver in real time: what was lost is not waited for.

    A reliable receiver that was held up, and has lost messages by that, gets none of the newer
    ones before it has been sent the lost ones again, which are too old to be obeyed by then.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=REALTIME_DEPTH,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )
