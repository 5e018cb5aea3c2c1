"""Node `inner_loop`: body-rate command to control surfaces, nominal or adaptive."""

import rclpy

from ahv_control.flight_control import NEUTRAL
from ahv_control.inner_loop import adaptive_surfaces, nominal_surfaces
from ahv_control.intermediate_loop import Rates
from ahv_control.learner_message import learned_of
from ahv_control.newton_raphson import Solution, SolverStatus
from ahv_control.parameters import INNER_LOOP_PARAMETERS, inner_loop
from ahv_msgs_py.base_node import OK, WARN, BaseNode, run
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.stepwise import Values
from ahv_msgs_py.topics import (
    DISTURBANCE_ESTIMATE,
    LEARNER,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
)
from ahv_plant.state import State


class InnerLoopNode(BaseNode):
    """Answers every state and its rate command with a surface command.

    With the parameter `adaptive` it waits for the disturbance learner's messages as well.
    """

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("inner_loop", INNER_LOOP_PARAMETERS, values, context)
        self._loop = inner_loop(self.settings)
        self._previous = NEUTRAL
        self._send = self.sender(SURFACE_COMMAND)
        if self.settings["adaptive"]:
            topics = (STATE, RATE_COMMAND, LEARNER, DISTURBANCE_ESTIMATE)
            self.receive_together(topics, self._answer_adaptive)
        else:
            self.receive_together((STATE, RATE_COMMAND), self._answer_nominal)

    def _answer_nominal(self, stamp: int, state: Values, command: Values) -> None:
        self._answer(
            stamp,
            nominal_surfaces(State(*state), Rates(*command), self._previous, self._loop),
        )

    def _answer_adaptive(
        self, stamp: int, state: Values, command: Values, learner: Values, estimate: Values
    ) -> None:
        learned = learned_of(learner, estimate)
        self._answer(
            stamp,
            adaptive_surfaces(State(*state), Rates(*command), learned, self._previous, self._loop),
        )

    def _answer(self, stamp: int, solution: Solution) -> None:
        self._previous = solution.surfaces
        self._send(stamp, solution.surfaces)
        level = OK if solution.status == SolverStatus.CONVERGED else WARN
        self.report(stamp, level, SolverStatus(solution.status).name.lower().replace("_", " "))


def main() -> None:
    """Run the node."""
    run(InnerLoopNode)
