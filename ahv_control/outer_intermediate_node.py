# Copyright 2026 ahv developers, Apache-2.0
"""Node `outer_intermediate`: altitude to attitude command to body-rate command."""

import rclpy

from ahv_control.intermediate_loop import rate_command
from ahv_control.outer_loop import attitude_command
from ahv_control.parameters import (
    OUTER_INTERMEDIATE_PARAMETERS,
    intermediate_loop,
    outer_loop,
)
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import ATTITUDE_COMMAND, RATE_COMMAND
from ahv_plant.model.vectors import State


class OuterIntermediateNode(BaseNode):
    """Answers every state with an attitude and a body-rate command."""

    laws = (attitude_command, rate_command)

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("outer_intermediate", OUTER_INTERMEDIATE_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make both loops."""
        self._outer = outer_loop(settings)
        self._intermediate = intermediate_loop(settings)

    def start(self) -> None:
        """Open the topics."""
        self._send_attitude = self.sender(ATTITUDE_COMMAND)
        self._send_rates = self.sender(RATE_COMMAND)
        self.receive_together(self._answer, {})

    def _answer(self, stamp: int, values: Values) -> None:
        state = State(*values)
        attitude = attitude_command(state, self._outer)
        self._send_rates(stamp, rate_command(state, attitude, self._intermediate))
        self._send_attitude(stamp, attitude)


def main() -> None:
    """Run the node."""
    run(OuterIntermediateNode)
