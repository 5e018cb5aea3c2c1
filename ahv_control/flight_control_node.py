# Copyright 2026 ahv developers, Apache-2.0
"""Node `flight_control`: a law of one's own, in the place of all loops."""

from typing import Any

import rclpy

from ahv_control.flight_control import NEUTRAL
from ahv_control.held_inputs import held_positions, held_reference
from ahv_control.law import Commands
from ahv_control.law_file import Law, compiling, load_law
from ahv_control.newton_raphson import SolverStatus
from ahv_control.own_law import TROUBLES, is_compiled, start, step
from ahv_control.parameters import FLIGHT_CONTROL_PARAMETERS
from ahv_control.reference import Reference
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Parameter, ParameterError, Value
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    RATE_COMMAND,
    REFERENCE,
    SURFACE_COMMAND,
    SURFACES,
    THROTTLE_COMMAND,
)
from ahv_plant.model.constants import THROTTLE_MAXIMUM, THROTTLE_MINIMUM
from ahv_plant.model.vectors import Measurement, State, Surfaces

FAULTS = {
    SolverStatus.SATURATED: (Fault.SURFACES_SATURATED, "the law asked for more"),
    SolverStatus.SINGULAR: (Fault.NEWTON_SINGULAR, "Newton-Raphson"),
    SolverStatus.NO_ANSWER: (Fault.LAW_FAILED, "its answer is no number"),
}


class FlightControlNode(BaseNode):
    """Answers every state with all commands, by the law that its parameter `law` names.

    Where the plant measures its surfaces it waits for these too, and for the reference if guided.
    The law's settings are parameters of the node.
    """

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        self._law: Law | None = None
        super().__init__("flight_control", FLIGHT_CONTROL_PARAMETERS, values, context)

    def further_parameters(self) -> tuple[Parameter, ...]:
        """Settings of the law that is named; ParameterError if it cannot be loaded."""
        named = self.get_parameter_or("law").value or ""
        self._law = load_law(str(named)) if named else None
        return () if self._law is None else self._law.parameters

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the law, and call it, so that no step of a flight waits for the compiler."""
        if self._law is None:
            raise ParameterError(
                "flight_control: law is not given: it names the law that flies, or its file"
            )
        altitude, speed = float(settings["altitude"]), float(settings["speed"])
        self._control = self._law.control(settings, altitude, speed)
        measured = Measurement(State(*[1.0] * len(State._fields)), NEUTRAL)
        followed = Reference(altitude, speed, 0.0, 0.0, 0.0, 0.0, 0.0)
        reference = followed if settings["guided"] else None
        if is_compiled(self._control):
            with compiling(self._law):
                memory, commands = start(measured, reference, self._control)
                step(memory, measured, commands, measured, reference, self._control)

    def start(self) -> None:
        """Open the topics; nothing is known yet."""
        self.new_flight()
        self._send_attitude, self._send_rates, self._send_surfaces, self._send_throttle = map(
            self.sender, (ATTITUDE_COMMAND, RATE_COMMAND, SURFACE_COMMAND, THROTTLE_COMMAND)
        )
        others: dict[Any, Any] = {}
        if self.settings["surfaces_measured"]:
            others[SURFACES] = held_positions
        if self.settings["guided"]:
            others[REFERENCE] = held_reference
        self.receive_together(self._answer, others)

    def new_flight(self) -> None:
        """Forget the flight before."""
        self._before: Measurement | None = None
        self._memory: Any = None
        self._commands: Commands | None = None

    def _answer(self, stamp: int, state: Values, *others: Values | None) -> None:
        heard = list(others)
        held = NEUTRAL if self._commands is None else self._commands.surfaces
        positions = heard.pop(0) if self.settings["surfaces_measured"] else None
        measured = Measurement(State(*state), Surfaces(*positions) if positions else held)
        reference = Reference(*heard[0]) if heard and heard[0] is not None else None
        known = sum(TROUBLES.values())
        if self._before is None or self._commands is None:
            self._memory, commands = start(measured, reference, self._control)
        else:
            self._memory, commands = step(
                self._memory, self._before, self._commands, measured, reference, self._control
            )
        self._before, self._commands = measured, commands
        self._send_rates(stamp, commands.rates)
        self._send_attitude(stamp, commands.attitude)
        self._send_surfaces(stamp, commands.surfaces)
        self._send_throttle(stamp, (commands.throttle,))
        raised = sum(TROUBLES.values()) > known
        self._tell(stamp, commands, next(reversed(TROUBLES)) if raised else "")

    def _tell(self, stamp: int, commands: Commands, raised: str) -> None:
        """Count what is odd of an answer, and say it."""
        if commands.status in FAULTS:
            fault, words = FAULTS[SolverStatus(commands.status)]
            self.fault(stamp, fault, raised or words)
        if not THROTTLE_MINIMUM < commands.throttle < THROTTLE_MAXIMUM:
            self.fault(stamp, Fault.THROTTLE_SATURATED, f"throttle is {commands.throttle:g}")


def main() -> None:
    """Run the node."""
    run(FlightControlNode)
