"""Node `disturbance_learner`: learns what the nominal model lacks."""

import rclpy

from ahv_control.disturbance_learner import LearnerState, disturbance_estimate
from ahv_control.flight_control import first_learner, next_learner
from ahv_control.intermediate_loop import Rates
from ahv_control.learner_message import estimate_values, learner_values
from ahv_control.parameters import LEARNER_PARAMETERS, learner_settings
from ahv_msgs_py.base_node import OK, BaseNode, run
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.stepwise import Stepwise, Values
from ahv_msgs_py.topics import (
    DISTURBANCE_ESTIMATE,
    LEARNER,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
)
from ahv_plant.constants import STEP_NS
from ahv_plant.state import State, Surfaces


class DisturbanceLearnerNode(BaseNode):
    """Answers every state with the disturbance estimate and the state of the learner.

    To learn from state k it needs state k - 1 and the commands that answered that one.
    """

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("disturbance_learner", LEARNER_PARAMETERS, values, context)
        self._law = learner_settings(self.settings)
        self._learner: LearnerState | None = None
        self._send_learner = self.sender(LEARNER)
        self._send_estimate = self.sender(DISTURBANCE_ESTIMATE)
        steps = Stepwise(("before", "command", "surfaces", "now"), self._learn)
        self._put = steps.put
        self.receive(STATE, self._state_arrived)
        self.receive(RATE_COMMAND, lambda stamp, values: self._put("command", stamp, values))
        self.receive(SURFACE_COMMAND, lambda stamp, values: self._put("surfaces", stamp, values))

    def _state_arrived(self, stamp: int, values: Values) -> None:
        """File a state twice: as the start of its own step and as the end of the one before."""
        if self._learner is None:
            state = State(*values)
            self._publish(stamp, state, first_learner(state, self._law))
        self._put("before", stamp, values)
        self._put("now", stamp - STEP_NS, values)

    def _learn(
        self, stamp: int, before: Values, command: Values, surfaces: Values, now: Values
    ) -> None:
        state = State(*now)
        learner = next_learner(
            self._learner,
            State(*before),
            Surfaces(*surfaces),
            Rates(*command),
            state,
            self._law,
        )
        self._publish(stamp + STEP_NS, state, learner)

    def _publish(self, stamp: int, state: State, learner: LearnerState) -> None:
        self._learner = learner
        estimate = disturbance_estimate(learner, Rates(state.P, state.Q, state.R))
        self._send_learner(stamp, learner_values(learner))
        self._send_estimate(stamp, estimate_values(estimate))
        self.report(stamp, OK, "learning")


def main() -> None:
    """Run the node."""
    run(DisturbanceLearnerNode)
