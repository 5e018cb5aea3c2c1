# Copyright 2026 ahv developers, Apache-2.0
"""What is used of rclpy that it does not promise to keep: all of it, and here alone.

A test says what is missing in an rclpy that has changed; setup.py bounds the versions by those
that were tried.
"""

from typing import Any

from rclpy.experimental import EventsExecutor  # type: ignore[attr-defined]
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode
from rclpy.service import Service

__all__ = [
    "EventsExecutor",
    "RCLError",
    "RMWError",
    "SubscriptionHandle",
    "change_state_service",
    "destroy_state_machine",
]

RCLError = rclpy_implementation.RCLError  # of an impossible lifecycle transition
RMWError = rclpy_implementation.RMWError  # of bytes that are no message of their type
SubscriptionHandle: Any = rclpy_implementation.Subscription  # which gives access to rcl's own


def change_state_service(node: LifecycleNode) -> Service:
    """Service by which the lifecycle of a node is driven from outside."""
    return node._service_change_state


def destroy_state_machine(node: LifecycleNode) -> None:
    """End what `destroy_node` forgets: it would keep the node's participant on its domain."""
    node._state_machine.destroy_when_not_in_use()
