# Copyright 2026 ahv developers, Apache-2.0
"""Messages of a topic, each with the name that the middleware gives its publisher.

Every message comes with the GID of its publisher, by which publishers can be told apart. rclpy
reads it and leaves it out of what it hands on; so messages are taken here, by the same function of
rcl. An executor gives a `Listener` its turn as it does any waitable of rclpy.
"""

import ctypes
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.type_support import check_is_valid_msg_type
from rclpy.waitable import NumberOfEntities, Waitable

from ahv_msgs_py.node.rclpy_internals import SubscriptionHandle

GID_SIZE = 16  # [bytes] RMW_GID_STORAGE_SIZE
Taken = tuple[bytes, bytes, int]  # a message as CDR, GID of its publisher, its number there


class _Allocator(ctypes.Structure):
    """rcutils_allocator_t."""

    _fields_ = [
        (name, ctypes.c_void_p)
        for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    ]


class _Message(ctypes.Structure):
    """rmw_serialized_message_t."""

    _fields_ = [
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    ]


class _Info(ctypes.Structure):
    """rmw_message_info_t."""

    _fields_ = [
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_sequence_number", ctypes.c_uint64),
        ("reception_sequence_number", ctypes.c_uint64),
        ("implementation", ctypes.c_char_p),
        ("gid", ctypes.c_uint8 * GID_SIZE),
        ("from_intra_process", ctypes.c_bool),
    ]


# The libraries that rclpy has loaded; a call holds the interpreter, as one of rclpy's does.
_rcl, _rcutils = ctypes.PyDLL("librcl.so"), ctypes.PyDLL("librcutils.so")
_take = _rcl.rcl_take_serialized_message
_take.argtypes = [ctypes.c_void_p] * 4
_rcutils.rcutils_get_default_allocator.restype = _Allocator
_NOTHING_TO_TAKE = 401  # RCL_RET_SUBSCRIPTION_TAKE_FAILED


class Subscription:
    """A subscription that is asked for what has come."""

    def __init__(self, node: Node, message_type: type, name: str, qos: QoSProfile):
        """Subscribe to a topic; until `close`."""
        check_is_valid_msg_type(message_type)  # type: ignore[no-untyped-call]  # and loads it
        with node.handle:
            self.handle: Any = SubscriptionHandle(
                node.handle,
                message_type,
                name,
                qos.get_c_qos_profile(),  # type: ignore[no-untyped-call]
            )
        self._name = name
        self._message = _Message(allocator=_rcutils.rcutils_get_default_allocator())
        self._info = _Info()
        self._arguments = (
            self.handle.pointer,
            ctypes.byref(self._message),
            ctypes.byref(self._info),
            None,
        )
        self._gid = memoryview(self._info.gid)

    def take(self) -> Taken | None:
        """Return the next message that has come, or None."""
        code = _take(*self._arguments)
        if code:
            if code != _NOTHING_TO_TAKE:
                raise RuntimeError(f"{self._name}: messages cannot be taken: code {code} of rcl")
            return None
        message = self._message
        data = ctypes.string_at(message.buffer, message.length)
        return data, self._gid.tobytes(), self._info.publication_sequence_number

    def __iter__(self) -> Iterator[Taken]:
        """All messages that have come, in their order."""
        with self.handle:
            return iter([*iter(self.take, None)])

    def close(self) -> None:
        """End the subscription; what has not been taken is lost."""
        self.handle.destroy_when_not_in_use()
        _rcutils.rcutils_uint8_array_fini(ctypes.byref(self._message))


def gids(node: Node, topic: str) -> list[bytes]:
    """Every publisher of a topic that the middleware knows, by its GID."""
    return [bytes(info.endpoint_gid) for info in node.get_publishers_info_by_topic(topic)]


class Listener(Waitable):
    """A subscription whose messages are handed on by the node's executor as they come."""

    def __init__(
        self,
        node: Node,
        message_type: type,
        name: str,
        qos: QoSProfile,
        heard: Callable[[bytes, bytes], None],
    ):
        """`heard(data, gid)` gets every message."""
        super().__init__(node.default_callback_group)  # type: ignore[no-untyped-call]
        self._node = node
        self._heard = heard
        self._subscription = Subscription(node, message_type, name, qos)
        node.add_waitable(self)

    def close(self) -> None:
        """End the subscription."""
        self._node.remove_waitable(self)
        self._subscription.close()

    def __enter__(self) -> None:
        """Keep the subscription while an executor uses it."""
        self._subscription.handle.__enter__()

    def __exit__(self, *error: Any) -> None:
        """Let go of it."""
        self._subscription.handle.__exit__(*error)

    def get_num_entities(self) -> NumberOfEntities:
        """One subscription."""
        return NumberOfEntities(num_subs=1)  # type: ignore[no-untyped-call]

    def add_to_wait_set(self, wait_set: Any) -> None:
        """Have the executor wait for it."""
        self._index = wait_set.add_subscription(self._subscription.handle)

    def is_ready(self, wait_set: Any) -> bool:
        """Whether a message has come."""
        return bool(wait_set.is_ready("subscription", self._index))

    def take_data(self) -> None:
        """Take a message and hand it on at once: a step later, the topic may have been closed."""
        taken = self._subscription.take()
        if taken is not None:
            data, publisher, _ = taken
            self._heard(data, publisher)

    async def execute(self, data: None) -> None:
        """Nothing is left to do."""
