# Copyright 2026 ahv developers, Apache-2.0
"""Node `velocity`: forward-speed error to throttle."""

import rclpy

from ahv_control.held_inputs import held_reference, held_surfaces
from ahv_control.parameters import VELOCITY_PARAMETERS, velocity_loop
from ahv_control.reference import Reference, held
from ahv_control.velocity_loop import throttle_command
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import REFERENCE, SURFACE_COMMAND, THROTTLE_COMMAND
from ahv_plant.model.constants import THROTTLE_MAXIMUM, THROTTLE_MINIMUM
from ahv_plant.model.vectors import State, Surfaces


class VelocityNode(BaseNode):
    """Answers every state and its surface command with a throttle command."""

    laws = (throttle_command,)

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("velocity", VELOCITY_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the loop."""
        self._loop = velocity_loop(settings)
        self._own = held(0.0, self._loop.speed)

    def start(self) -> None:
        """Open the topics."""
        self._send = self.sender(THROTTLE_COMMAND)
        guided = {REFERENCE: held_reference} if self.settings["guided"] else {}
        self.receive_together(self._answer, {SURFACE_COMMAND: held_surfaces} | guided)

    def _answer(
        self, stamp: int, state: Values, surfaces: Values, reference: Values | None = None
    ) -> None:
        wanted = Reference(*reference) if reference else self._own
        throttle = throttle_command(State(*state), Surfaces(*surfaces), wanted, self._loop)
        self._send(stamp, (throttle,))
        if not THROTTLE_MINIMUM < throttle < THROTTLE_MAXIMUM:
            self.fault(stamp, Fault.THROTTLE_SATURATED, f"throttle is {throttle:g}")


def main() -> None:
    """Run the node."""
    run(VelocityNode)
