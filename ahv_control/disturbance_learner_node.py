# Copyright 2026 ahv developers, Apache-2.0
"""Node `disturbance_learner`: learns what the nominal model lacks."""

from functools import partial
from typing import ClassVar

import rclpy

from ahv_control.disturbance_learner import LearnerState, disturbance_estimate
from ahv_control.flight_control import first_learner, next_learner
from ahv_control.held_inputs import held_positions, held_rates, held_surfaces, nothing
from ahv_control.learner_message import estimate_values, learner_values
from ahv_control.parameters import LEARNER_PARAMETERS, learner_settings
from ahv_control.servo_model import next_model
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import (
    DISTURBANCE_ESTIMATE,
    LEARNER,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    SURFACES,
)
from ahv_plant.model.constants import DEGREES, STEP_NS
from ahv_plant.model.vectors import Measurement, Rates, State, Surfaces

BEFORE = "the state before"  # an input of its steps, beside the topics


class DisturbanceLearnerNode(BaseNode):
    """Answers every state with the disturbance estimate and the state of the learner.

    To learn from state k it needs state k - 1 and the commands that answered that one; where
    surfaces are measured, also their positions at k. In real time it reckons with the commands
    that the others hold, and with commands where positions stay away; where the state is missing,
    the observer starts anew at the new one, and the weights stay.
    """

    laws = (first_learner, next_learner, disturbance_estimate)
    advice: ClassVar = {
        SURFACES: "a plant measures its surfaces if its hardware is not ideal; observer_surfaces "
        "may be commanded or modelled as well"
    }

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("disturbance_learner", LEARNER_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the law."""
        self._law = learner_settings(settings)

    def start(self) -> None:
        """Open the topics; nothing is known yet."""
        self.new_flight()
        self._send_learner = self.sender(LEARNER)
        self._send_estimate = self.sender(DISTURBANCE_ESTIMATE)
        self._now, command, surfaces, positions = map(
            self.full_name, (STATE, RATE_COMMAND, SURFACE_COMMAND, SURFACES)
        )
        fallbacks = {BEFORE: nothing, command: held_rates, surfaces: held_surfaces}
        if self._law.measured_surfaces:
            fallbacks[positions] = held_positions
            self.receive(SURFACES, partial(self._positions_arrived, positions))
        put = self._put = self.join((self._now, *fallbacks), self._learn, fallbacks, wait=False)
        self.receive(STATE, self._state_arrived)
        self.receive(RATE_COMMAND, partial(put, command))
        self.receive(SURFACE_COMMAND, partial(put, surfaces))

    def new_flight(self) -> None:
        """Forget what was learned."""
        self._learner: LearnerState | None = None

    def _state_arrived(self, stamp: int, values: Values) -> None:
        """File a state twice: as the end of the step before, and as the start of its own."""
        if self._learner is None:
            state = State(*values)
            self._publish(stamp, state, first_learner(state, self._law))
        else:
            self._put(self._now, stamp - STEP_NS, values)
        self._put(BEFORE, stamp, values)

    def _positions_arrived(self, name: str, stamp: int, values: Values) -> None:
        """File positions of the surfaces as what moved the vehicle in the step before."""
        self._put(name, stamp - STEP_NS, values)

    def _learn(
        self,
        stamp: int,
        now: Values,
        before: Values | None,
        command: Values,
        surfaces: Values,
        positions: Values | None = None,
    ) -> None:
        assert self._learner is not None
        state = State(*now)
        if before is None:
            learner = self._anew(state, surfaces)
        else:
            learner = next_learner(
                self._learner,
                State(*before),
                Surfaces(*surfaces),
                Rates(*command),
                Measurement(state, Surfaces(*(positions or surfaces))),
                self._law,
            )
            error = max(
                abs(rate - observed)
                for rate, observed in zip((state.P, state.Q, state.R), learner.X_a, strict=True)
            )
            self.health.extreme("barrier_share", error * DEGREES / self._law.k_b)
            if error * DEGREES >= self._law.k_b:
                self.fault(stamp, Fault.BARRIER_BREACH, f"{error * DEGREES:.3g} deg/s")
                learner = self._anew(state, surfaces)
        self._publish(stamp + STEP_NS, state, learner)

    def _anew(self, state: State, surfaces: Values) -> LearnerState:
        """Observer at the state, with the weights so far, and the servos on their way."""
        assert self._learner is not None
        start = first_learner(state, self._law)
        servos = next_model(self._learner.servos, Surfaces(*surfaces), self._law.servo_model)
        return self._learner._replace(X_a=start.X_a, X_d=start.X_d, servos=servos)

    def _publish(self, stamp: int, state: State, learner: LearnerState) -> None:
        self._learner = learner
        estimate = disturbance_estimate(learner, Rates(state.P, state.Q, state.R))
        self._send_learner(stamp, learner_values(learner))
        self._send_estimate(stamp, estimate_values(estimate))


def main() -> None:
    """Run the node."""
    run(DisturbanceLearnerNode)
