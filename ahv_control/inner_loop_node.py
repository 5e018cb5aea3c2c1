"""Node `inner_loop`: body-rate command to control surfaces."""

import rclpy

from ahv_control.flight_control import NEUTRAL
from ahv_control.inner_loop import surface_command
from ahv_control.intermediate_loop import Rates
from ahv_control.newton_raphson import SolverStatus
from ahv_control.parameters import INNER_LOOP_PARAMETERS, inner_loop
from ahv_msgs_py.base_node import OK, WARN, BaseNode, run
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.stepwise import Stepwise, Values
from ahv_msgs_py.topics import RATE_COMMAND, STATE, SURFACE_COMMAND
from ahv_plant.state import State


class InnerLoopNode(BaseNode):
    """Answers every state and its rate command with a surface command."""

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("inner_loop", INNER_LOOP_PARAMETERS, values, context)
        self._loop = inner_loop(self.settings)
        self._previous = NEUTRAL
        self._send = self.sender(SURFACE_COMMAND)
        inputs = Stepwise((STATE.name, RATE_COMMAND.name), self._answer)
        for topic in (STATE, RATE_COMMAND):
            self.receive(
                topic, lambda stamp, values, name=topic.name: inputs.put(name, stamp, values)
            )

    def _answer(self, stamp: int, state: Values, command: Values) -> None:
        solution = surface_command(State(*state), Rates(*command), self._previous, self._loop)
        self._previous = solution.surfaces
        self._send(stamp, solution.surfaces)
        level = OK if solution.status == SolverStatus.CONVERGED else WARN
        self.report(stamp, level, SolverStatus(solution.status).name.lower().replace("_", " "))


def main() -> None:
    """Run the node."""
    run(InnerLoopNode)
