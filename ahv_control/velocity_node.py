"""Node `velocity`: forward-speed error to throttle."""

import rclpy

from ahv_control.parameters import VELOCITY_PARAMETERS, velocity_loop
from ahv_control.velocity_loop import throttle_command
from ahv_msgs_py.base_node import OK, WARN, BaseNode, run
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.stepwise import Values
from ahv_msgs_py.topics import STATE, SURFACE_COMMAND, THROTTLE_COMMAND
from ahv_plant.constants import THROTTLE_MAXIMUM, THROTTLE_MINIMUM
from ahv_plant.state import State, Surfaces


class VelocityNode(BaseNode):
    """Answers every state and its surface command with a throttle command."""

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("velocity", VELOCITY_PARAMETERS, values, context)
        self._loop = velocity_loop(self.settings)
        self._send = self.sender(THROTTLE_COMMAND)
        self.receive_together((STATE, SURFACE_COMMAND), self._answer)

    def _answer(self, stamp: int, state: Values, surfaces: Values) -> None:
        throttle = throttle_command(State(*state), Surfaces(*surfaces), self._loop)
        self._send(stamp, (throttle,))
        free = THROTTLE_MINIMUM < throttle < THROTTLE_MAXIMUM
        self.report(stamp, OK if free else WARN, "tracking" if free else "throttle at its stop")


def main() -> None:
    """Run the node."""
    run(VelocityNode)
