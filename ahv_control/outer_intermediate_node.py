# Copyright 2026 ahv developers, Apache-2.0
"""Node `outer_intermediate`: altitude to attitude command to body-rate command."""

import rclpy

from ahv_control.held_inputs import held_reference
from ahv_control.intermediate_loop import rate_command
from ahv_control.limits_met import limits_met
from ahv_control.outer_loop import Integral, attitude_command, first_integral, next_integral
from ahv_control.parameters import (
    OUTER_INTERMEDIATE_PARAMETERS,
    intermediate_loop,
    outer_loop,
)
from ahv_control.reference import Reference, held
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import ATTITUDE_COMMAND, RATE_COMMAND, REFERENCE
from ahv_plant.model.constants import DEGREES
from ahv_plant.model.vectors import State


class OuterIntermediateNode(BaseNode):
    """Answers every state, and its reference if guided, with attitude and body-rate command.

    With integral action it remembers that; started again in flight, it begins at none.
    """

    laws = (attitude_command, rate_command, first_integral, next_integral)

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("outer_intermediate", OUTER_INTERMEDIATE_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make both loops."""
        self._outer = outer_loop(settings)
        self._own = held(self._outer.altitude, 0.0)
        self._intermediate = intermediate_loop(settings)

    def start(self) -> None:
        """Open the topics; nothing is integrated yet."""
        self.new_flight()
        self._send_attitude = self.sender(ATTITUDE_COMMAND)
        self._send_rates = self.sender(RATE_COMMAND)
        guided = {REFERENCE: held_reference} if self.settings["guided"] else {}
        self.receive_together(self._answer, guided)

    def new_flight(self) -> None:
        """Forget the integral of the flight before."""
        self._started = False
        self._integral: Integral | None = None

    def _answer(self, stamp: int, values: Values, reference: Values | None = None) -> None:
        state = State(*values)
        wanted = Reference(*reference) if reference else self._own
        if self._started:
            self._integral = next_integral(
                self._integral, state, wanted, self._outer, self._outer.integral
            )
        else:
            self._integral = first_integral(state, self._outer.integral)
            self._started = True
        attitude = attitude_command(state, wanted, self._integral, self._outer)
        self._send_rates(stamp, rate_command(state, attitude, wanted.psi_rate, self._intermediate))
        self._send_attitude(stamp, attitude)
        outer = self._outer
        met = limits_met(state, attitude.theta, outer.climb_limit, outer.alpha_limit)
        for limit, fault in zip(met, (Fault.CLIMB_LIMITED, Fault.ALPHA_LIMITED), strict=True):
            if limit:
                self.fault(stamp, fault, f"theta* is {attitude.theta * DEGREES:.3g} deg")


def main() -> None:
    """Run the node."""
    run(OuterIntermediateNode)
