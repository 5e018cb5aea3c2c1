# Copyright 2026 ahv developers, Apache-2.0
"""Node `guidance`: the reference that the loops follow, by time or by waypoints."""

import rclpy

from ahv_control.guidance import guidance_step, start_guidance, warm_up_guidance
from ahv_control.guidance_parameters import GUIDANCE_PARAMETERS, guidance
from ahv_control.route import RouteState
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import REFERENCE
from ahv_plant.model.constants import STEP_NS
from ahv_plant.model.vectors import State


class GuidanceNode(BaseNode):
    """Answers every state with a reference."""

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("guidance", GUIDANCE_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the guidance; ParameterError if it cannot be flown."""
        self._guidance = guidance(settings)
        warm_up_guidance(self._guidance)

    def start(self) -> None:
        """Open the topics; no leg is flown yet."""
        self.new_flight()
        self._send = self.sender(REFERENCE)
        self.receive_together(self._answer, {})

    def new_flight(self) -> None:
        """Begin with the first waypoint."""
        self._started = False
        self._route: RouteState | None = None

    def _answer(self, stamp: int, values: Values) -> None:
        state, number = State(*values), stamp // STEP_NS
        if self._started:
            self._route, reference = guidance_step(self._route, state, number, self._guidance)
        else:
            self._route, reference = start_guidance(state, number, self._guidance)
            self._started = True
        self._send(stamp, reference)


def main() -> None:
    """Run the node."""
    run(GuidanceNode)
