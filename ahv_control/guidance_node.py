# Copyright 2026 ahv developers, Apache-2.0
"""Node `guidance`: the reference that the loops follow, by time or by waypoints, or as selected.

Most of its parameters may be changed in flight. One of them, `selected`, is also set by what
somebody publishes on `/ahv/selection` and by the services `hold` and `resume`. Whoever asks: the
parameters are checked alike, are in force from the next step on, and are announced there.
"""

from collections.abc import Callable
from functools import partial
from math import isfinite
from typing import Any

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter as RosParameter
from rclpy.serialization import deserialize_message
from std_srvs.srv import Trigger

from ahv_control.guidance_parameters import GUIDANCE_PARAMETERS, plan
from ahv_control.guided_flight import Followed, next_followed, start_followed, warm_up
from ahv_control.reach import check_change, why_not_followed
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.rclpy_internals import RMWError
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import REFERENCE, SELECTION, relative
from ahv_plant.model.constants import DEGREES, STEP_NS
from ahv_plant.model.vectors import State

REACH_PERIOD = 100  # steps between looks whether the vehicle can follow
WORDS = {"altitude": ("h", 1.0), "speed": ("u", 1.0), "psi": ("psi", DEGREES)}  # of a selection


class GuidanceNode(BaseNode):
    """Answers every state with a reference."""

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        self._followed: Followed | None = None
        super().__init__("guidance", GUIDANCE_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Make the plan; ParameterError if it cannot be flown, in flight from where that is."""
        new = plan(settings)
        if self._followed is None:
            warm_up(new)
        else:
            check_change(new, self._followed, self._state, self._number)
        self._plan = new

    def start(self) -> None:
        """Open the topics and services; no leg is flown yet."""
        self.new_flight()
        self._send = self.sender(REFERENCE)
        self.receive_together(self._answer, {})
        selections = self.create_subscription(
            message_class(SELECTION.type_name),
            relative(SELECTION.name),
            self._told,
            quality(SELECTION.durable, depth=10),
            raw=True,
        )
        self._opened.append(partial(self.destroy_subscription, selections))
        for name, text in (("hold", self._as_it_is), ("resume", lambda: "")):
            service = self.create_service(Trigger, f"~/{name}", partial(self._serve, text))
            self._opened.append(partial(self.destroy_service, service))

    def new_flight(self) -> None:
        """Begin with the first waypoint."""
        self._followed = None

    def close(self) -> None:
        """Close the topics; nothing is flown any more from which a change would go on."""
        super().close()
        self._followed = None

    def _answer(self, stamp: int, values: Values) -> None:
        state, number = State(*values), stamp // STEP_NS
        self._state, self._number = state, number
        if self._followed is None:
            self._followed = start_followed(state, number, self._plan)
        else:
            self._followed = next_followed(self._followed, state, number, self._plan)
        reference = self._followed.last
        self._send(stamp, reference)
        limit = self._plan.guidance.bank_limit
        if abs(reference.phi) >= limit > 0.0:
            self.fault(stamp, Fault.BANK_LIMITED, f"bank_limit is {limit * DEGREES:g} deg")
        if number % REACH_PERIOD == 0:
            why = why_not_followed(reference, state.mass, self._plan.guidance.schedule.geometric)
            if why:
                self.fault(stamp, Fault.OUT_OF_REACH, why)

    # Selections

    def _select(self, text: str) -> SetParametersResult:
        return self.set_parameters_atomically([RosParameter("selected", value=text)])

    def _as_it_is(self) -> str:
        """Return the selection of what is followed now."""
        if self._followed is None:
            return ""
        last = self._followed.last
        parts = (f"{word} {getattr(last, name) * unit!r}" for name, (word, unit) in WORDS.items())
        return " ".join(parts)

    def _serve(
        self, text: Callable[[], str], request: Trigger.Request, answer: Trigger.Response
    ) -> Trigger.Response:
        result = self._select(text())
        answer.success, answer.message = result.successful, result.reason
        return answer

    def _told(self, data: bytes) -> None:
        """Select what somebody publishes; what is wrong with it is told by diagnostics alone."""
        try:
            message: Any = deserialize_message(data, message_class(SELECTION.type_name))
        except RMWError:
            self.refused(f"{self.full_name(SELECTION)}: the bytes are no message of its type")
            return
        given = dict(zip(message.name, message.position, strict=False))
        once = len(given) == len(message.name) == len(message.position)
        if not once or not given or not given.keys() <= WORDS.keys():
            self.refused(
                f"{self.full_name(SELECTION)}: name must have some of {', '.join(WORDS)}, each "
                "once, and position a number for each"
            )
        elif not all(map(isfinite, given.values())):
            self.refused(f"{self.full_name(SELECTION)}: a position is not finite")
        else:
            self._select(
                " ".join(
                    f"{word} {given[name] * unit!r}"
                    for name, (word, unit) in WORDS.items()
                    if name in given
                )
            )


def main() -> None:
    """Run the node."""
    run(GuidanceNode)
