# Copyright 2026 ahv developers, Apache-2.0
"""Node `inner_loop`: body-rate command to control surfaces, nominal or adaptive."""

import rclpy

from ahv_control.flight_control import NEUTRAL
from ahv_control.held_inputs import held_estimate, held_rates, nothing
from ahv_control.inner_loop import adaptive_surfaces, nominal_surfaces
from ahv_control.learner_message import learned_of, unlearned
from ahv_control.newton_raphson import Solution, SolverStatus
from ahv_control.parameters import INNER_LOOP_PARAMETERS, inner_loop
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import (
    DISTURBANCE_ESTIMATE,
    LEARNER,
    RATE_COMMAND,
    SURFACE_COMMAND,
)
from ahv_plant.model.vectors import Rates, State

FAULTS = {
    SolverStatus.SATURATED: Fault.SURFACES_SATURATED,
    SolverStatus.ITERATION_LIMIT: Fault.NEWTON_LIMIT,
    SolverStatus.SINGULAR: Fault.NEWTON_SINGULAR,
}


class InnerLoopNode(BaseNode):
    """Answers every state and its rate command with a surface command.

    With the parameter `adaptive` it waits for the disturbance learner's messages as well.
    """

    laws = (nominal_surfaces, adaptive_surfaces)

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("inner_loop", INNER_LOOP_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the loop."""
        self._loop = inner_loop(settings)

    def start(self) -> None:
        """Open the topics; the first search starts at neutral surfaces."""
        self.new_flight()
        self._send = self.sender(SURFACE_COMMAND)
        if self.settings["adaptive"]:
            self.receive_together(
                self._answer_adaptive,
                {
                    RATE_COMMAND: held_rates,
                    LEARNER: nothing,
                    DISTURBANCE_ESTIMATE: held_estimate,
                },
            )
        else:
            self.receive_together(self._answer_nominal, {RATE_COMMAND: held_rates})

    def new_flight(self) -> None:
        """Forget the surfaces of the flight before."""
        self._previous = NEUTRAL

    def _answer_nominal(self, stamp: int, state: Values, command: Values) -> None:
        self._answer(
            stamp,
            nominal_surfaces(State(*state), Rates(*command), self._previous, self._loop),
        )

    def _answer_adaptive(
        self, stamp: int, state: Values, command: Values, learner: Values | None, estimate: Values
    ) -> None:
        now = State(*state)
        learned = unlearned(now, estimate) if learner is None else learned_of(learner, estimate)
        self._answer(
            stamp, adaptive_surfaces(now, Rates(*command), learned, self._previous, self._loop)
        )

    def _answer(self, stamp: int, solution: Solution) -> None:
        self._previous = solution.surfaces
        self._send(stamp, solution.surfaces)
        if solution.status != SolverStatus.CONVERGED:
            self.fault(stamp, FAULTS[SolverStatus(solution.status)], "Newton-Raphson")


def main() -> None:
    """Run the node."""
    run(InnerLoopNode)
