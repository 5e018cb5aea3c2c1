# Copyright 2026 ahv developers, Apache-2.0
"""A vehicle in a namespace, as one of several in a ROS domain, by ROS's own remapping."""

from ahv_msgs_py.topics import CLOCK, NAMESPACE, STATIC_TRANSFORM, TRANSFORM

# Absolute, for tools look there; of several vehicles each has its own.
OWN = (CLOCK.name, TRANSFORM.name, STATIC_TRANSFORM.name)


def remappings(namespace: str) -> list[tuple[str, str]]:
    """Pairs of names of topics that a vehicle in `namespace` has for itself."""
    return [] if namespace == NAMESPACE else [(name, name.removeprefix("/")) for name in OWN]


def ros_arguments(namespace: str) -> list[str]:
    """Arguments of ROS for the nodes of a vehicle in `namespace`."""
    rules = [("__ns", namespace), *remappings(namespace)]
    return [
        "--ros-args",
        *(word for old, new in rules for word in ("-r", f"{old}:={new}")),
    ]
