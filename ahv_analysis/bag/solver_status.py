# Copyright 2026 ahv developers, Apache-2.0
"""What the inner loop says of its solver on /diagnostics: written for a library flight, and found.

Only the inner loop itself knows whether its surfaces could turn the vehicle. One with another law
may say nothing of it, and nobody solves its steps again to judge it.
"""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from ahv_analysis.bag.messages import STORE, deserialized
from ahv_analysis.bag.series import obeyed
from ahv_msgs_py.graph import sender
from ahv_msgs_py.layout import NANOSECONDS, MessageError
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.health import ERROR
from ahv_msgs_py.topics import DIAGNOSTICS, NAMESPACE, SURFACE_COMMAND, relative

INNER_LOOP = sender(relative(SURFACE_COMMAND.name))
LOST = Fault.NEWTON_SINGULAR.name.lower().replace("_", " ")


def lost_status(stamp: int) -> bytes:
    """The inner loop's word at `stamp` [ns] that its surfaces cannot turn the vehicle, as CDR."""
    types = STORE.types
    status = types["diagnostic_msgs/msg/DiagnosticStatus"](
        level=ERROR[0],
        name=f"{NAMESPACE}/{INNER_LOOP}",
        message=f"{LOST}: Newton-Raphson",
        hardware_id="ahv",
        values=[],
    )
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp, NANOSECONDS))
    header = types["std_msgs/msg/Header"](time, "")
    message = types[DIAGNOSTICS.type_name](header, [status])
    return bytes(STORE.serialize_cdr(message, DIAGNOSTICS.type_name))


def says_inner_loop(data: bytes) -> bool:
    """Whether CDR bytes of /diagnostics can be of the inner loop of any vehicle."""
    return f"/{INNER_LOOP}\0".encode() in data


def surfaces_lost_at(messages: Sequence[tuple[int, bytes]], namespace: str) -> int | None:
    """Stamp [ns] of the first loss that the inner loop of a namespace tells of; None if none.

    `messages` of /diagnostics come with the numbers of their publishers. They are believed as
    commands are: of the publisher that spoke first under this name, until its last message.
    """
    name = f"{namespace}/{INNER_LOOP}"
    publishers, losses = [], []
    for publisher, data in messages:
        with suppress(MessageError):
            message = deserialized(data, DIAGNOSTICS.type_name)
            texts = [status.message for status in message.status if status.name == name]
            if texts:
                stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
                publishers.append(publisher)
                losses.append(stamp if any(text.startswith(LOST) for text in texts) else None)
    believed = obeyed(np.array(publishers, np.uint32))
    told = [loss for loss, good in zip(losses, believed, strict=True) if good and loss is not None]
    return min(told, default=None)
