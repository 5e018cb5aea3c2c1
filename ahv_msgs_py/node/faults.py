# Copyright 2026 ahv developers, Apache-2.0
"""What can go wrong in flight, how it is noticed, and what happens then: the one list of it.

`ahv faults` prints this table. Every entry is counted by the node that notices it, named in its
diagnostics, and thereby in the bag.
"""

from enum import Enum
from typing import NamedTuple

PERIOD = 10_000_000  # [ns] of the control loop: stamps are multiples of it
HOLD = 20 * PERIOD  # [ns] for which a command that stays away is held as it was
STALE = 10 * PERIOD  # [ns] age from which a command is not obeyed any more
SILENCE = 10 * PERIOD  # [ns] of silence after which another publisher may take a topic over


class Response(NamedTuple):
    """One fault: who notices it and how, what is done, and how long that takes."""

    noticed_by: str
    detection: str
    response: str
    latency: str
    error: bool = False  # an error for the operator; otherwise a warning


class Fault(Enum):
    """The faults, by the names that diagnostics and bags use (in lower case)."""

    MALFORMED = Response(
        "every receiver",
        "names, lengths, frame or bytes are not those of the topic",
        "the message is refused, as if it had not come",
        "at once",
    )
    NOT_FINITE = Response(
        "every receiver",
        "a NaN or an infinity in a field",
        "the message is refused, as if it had not come",
        "at once",
    )
    OUT_OF_RANGE = Response(
        "every receiver",
        "a field is outside the range that its topic states",
        "the message is refused, as if it had not come",
        "at once",
    )
    WRONG_STAMP = Response(
        "every receiver",
        "a stamp that is no multiple of 10 ms, or answers a state that was not sent yet",
        "the message is refused, as if it had not come",
        "at once",
    )
    STALE = Response(
        "every receiver, in real time",
        "a stamp more than 100 ms behind the newest state",
        "the message is refused, as if it had not come",
        "at once",
    )
    DUPLICATE = Response(
        "every receiver",
        "the stamp of the message before",
        "the message is refused; the first one stands",
        "at once",
    )
    OUT_OF_ORDER = Response(
        "every receiver",
        "a stamp before that of the message before",
        "the message is refused; the newer one stands",
        "at once",
    )
    SECOND_PUBLISHER = Response(
        "every receiver",
        "the GID of its publisher is not that of the one that is obeyed, the first that was heard",
        "the message is refused; the other publisher is obeyed only after the first has been "
        "silent for 100 ms (in lockstep: has gone)",
        "at once",
        error=True,
    )
    LATE = Response(
        "plant, in real time",
        "no surface or throttle command of the step when its 10 ms are over",
        "the last valid command is held",
        "10 ms",
    )
    COMMAND_LOST = Response(
        "plant, in real time",
        "no valid surface or throttle command for 200 ms",
        "safe command: both elevons from the mean of the two held to keep the angle of attack, "
        "by what is measured of it and of the pitch rate; rudder neutral; throttle held; "
        "obeyed again from the first valid command on",
        "200 ms",
        error=True,
    )
    INPUT_MISSING = Response(
        "every controller, in real time",
        "an input of a step has not come when the next state does",
        "rate command: held for 200 ms, then zero rates; learner: last estimate, observer at the "
        "state; surfaces: what the plant holds; a state: the learner starts its observer anew at "
        "the next one and keeps its weights",
        "10 ms",
    )
    INPUT_NOT_SENT = Response(
        "plant and controllers, in lockstep",
        "an input of a step is waited for, and no node sends its topic",
        "it is waited for; the message names the topic",
        "3 to 4 s",
        error=True,
    )
    STATE_LOST = Response(
        "every controller, in real time",
        "no valid state for 500 ms",
        "no commands are sent; a new flight is taken up from its first state on",
        "up to 1 s",
        error=True,
    )
    TICK_MISSED = Response(
        "plant, in real time",
        "the 10 ms timer came a period or more too late",
        "simulated time falls behind the wall clock; no step is left out",
        "at once",
    )
    OUTPUT_NOT_FINITE = Response(
        "every sender",
        "a value to be sent is a NaN, an infinity or outside the range of its topic",
        "nothing is sent; receivers hold as for a missing message",
        "at once",
        error=True,
    )
    SURFACES_SATURATED = Response(
        "inner_loop, flight_control",
        "the solution of the Newton steps, or what a law asks for, lies beyond a stop",
        "the surface is held at its stop",
        "at once",
    )
    NEWTON_LIMIT = Response(
        "inner_loop",
        "the last Newton correction is not small",
        "the last iterate is commanded, within the stops",
        "at once",
    )
    NEWTON_SINGULAR = Response(
        "inner_loop, flight_control",
        "the Jacobian of a Newton step is singular",
        "the surfaces stay as they were",
        "at once",
        error=True,
    )
    LAW_FAILED = Response(
        "flight_control",
        "a law of one's own raises, or answers a NaN or an infinity",
        "the commands before are held while it lasts; a campaign counts the run as failed",
        "at once",
        error=True,
    )
    THROTTLE_SATURATED = Response(
        "velocity, flight_control",
        "the throttle lies at a stop",
        "it is held there",
        "at once",
    )
    OUT_OF_REACH = Response(
        "guidance",
        "the nominal vehicle, with the mass that is measured, has no level flight at the "
        "reference, looked for once a second: angle of attack, elevons, throttle, or range of the "
        "model",
        "it is followed as far as the vehicle can; a change in flight that leads there is refused",
        "up to 1 s",
    )
    BANK_LIMITED = Response(
        "guidance",
        "a turn takes the bank_limit or more",
        "the bank is held there, and the rest is turned by sideslip",
        "at once",
    )
    CLIMB_LIMITED = Response(
        "outer_intermediate",
        "the climb angle asked for is climb_limit or more, or the climb faster than the vehicle, "
        "which is an argument of 1 or more of the arcsine of eq 3.1",
        "the climb angle asked for is held at the limit",
        "at once",
    )
    ALPHA_LIMITED = Response(
        "outer_intermediate",
        "the pitch that is asked for takes the alpha_limit or more",
        "the pitch asked for is held where the angle of attack stays within the limit",
        "at once",
    )
    CHANGE_REFUSED = Response(
        "every node",
        "a change of parameters in flight that is not valid, or cannot be flown",
        "nothing is changed; whoever asked is told why, but for selections on a topic",
        "at once",
    )
    BARRIER_BREACH = Response(
        "disturbance_learner",
        "an observer error of k_b or more: only after steps that were lost",
        "the observer starts anew at the state; the weights are kept",
        "at once",
        error=True,
    )
    LISTENER_LOST = Response(
        "plant",
        "a node that listened to the state does so no more: it ended, or was deactivated",
        "the flight goes on; the bag of a killed recorder can be recovered",
        "at once if it ended, up to 20 s if it was killed",
    )


def fault_rows() -> list[tuple[str, str, str, str, str]]:
    """Name, who notices, detection, response and latency of every fault."""
    return [
        (fault.name.lower(), entry.noticed_by, entry.detection, entry.response, entry.latency)
        for fault in Fault
        for entry in [fault.value]
    ]
