# Copyright 2026 ahv developers, Apache-2.0
"""What a law says of its answers on /diagnostics: written for a library flight, and found.

Only the inner loop itself knows whether its surfaces could turn the vehicle. One with another law
may say nothing of it, and nobody solves its steps again to judge it. Of a law of one's own, which
flies as one node, it is this node's word; and that the law gave no answer.
"""

from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ahv_analysis.bag.messages import STORE, deserialized
from ahv_analysis.bag.series import obeyed
from ahv_msgs_py.graph import sender
from ahv_msgs_py.layout import NANOSECONDS, MessageError
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.health import ERROR
from ahv_msgs_py.topics import DIAGNOSTICS, NAMESPACE, SURFACE_COMMAND, relative

INNER_LOOP = sender(relative(SURFACE_COMMAND.name))
OWN_LAW = "flight_control"
LOST, FAILED = (
    fault.name.lower().replace("_", " ") for fault in (Fault.NEWTON_SINGULAR, Fault.LAW_FAILED)
)


class Losses(NamedTuple):
    """When a flight was lost by its law, as the law tells it; None if it was not."""

    surfaces: int | None  # [ns] when the surfaces first could not turn the vehicle
    law: int | None  # [ns] when the law first had no answer


def lost_status(stamp: int, own_law: bool = False) -> bytes:
    """The word at `stamp` [ns] that the surfaces cannot turn the vehicle, as CDR."""
    return _status(stamp, OWN_LAW if own_law else INNER_LOOP, f"{LOST}: Newton-Raphson")


def failed_status(stamp: int, why: str) -> bytes:
    """The word at `stamp` [ns] that a law of one's own had no answer, and why, as CDR."""
    return _status(stamp, OWN_LAW, f"{FAILED}: {why}")


def _status(stamp: int, node: str, text: str) -> bytes:
    types = STORE.types
    status = types["diagnostic_msgs/msg/DiagnosticStatus"](
        level=ERROR[0],
        name=f"{NAMESPACE}/{node}",
        message=text,
        hardware_id="ahv",
        values=[],
    )
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp, NANOSECONDS))
    header = types["std_msgs/msg/Header"](time, "")
    message = types[DIAGNOSTICS.type_name](header, [status])
    return bytes(STORE.serialize_cdr(message, DIAGNOSTICS.type_name))


def says_a_law(data: bytes) -> bool:
    """Whether CDR bytes of /diagnostics can be of the law of any vehicle."""
    return any(f"/{node}\0".encode() in data for node in (INNER_LOOP, OWN_LAW))


def losses_in(messages: Sequence[tuple[int, bytes]], namespace: str) -> Losses:
    """First losses that the law of a namespace tells of.

    `messages` of /diagnostics come with the numbers of their publishers. They are believed as
    commands are: of the publisher that spoke first under this name, until its last message.
    """
    lost = [_first(messages, f"{namespace}/{node}", LOST) for node in (INNER_LOOP, OWN_LAW)]
    told = [stamp for stamp in lost if stamp is not None]
    failed = _first(messages, f"{namespace}/{OWN_LAW}", FAILED)
    return Losses(min(told, default=None), failed)


def _first(messages: Sequence[tuple[int, bytes]], name: str, word: str) -> int | None:
    publishers, losses = [], []
    for publisher, data in messages:
        with suppress(MessageError):
            message = deserialized(data, DIAGNOSTICS.type_name)
            texts = [status.message for status in message.status if status.name == name]
            if texts:
                stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
                publishers.append(publisher)
                losses.append(stamp if any(text.startswith(word) for text in texts) else None)
    believed = obeyed(np.array(publishers, np.uint32))
    told = [loss for loss, good in zip(losses, believed, strict=True) if good and loss is not None]
    return min(told, default=None)
