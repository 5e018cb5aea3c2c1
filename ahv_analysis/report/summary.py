# Copyright 2026 ahv developers, Apache-2.0
"""What a flight came to, in a few numbers."""

from typing import Any

import numpy as np

from ahv_analysis.bag.reader import Bag
from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.flight.outcome import Cause, cause_now
from ahv_analysis.report.metrics import fuel, margins
from ahv_control.flight_control import NEUTRAL, FlightControl
from ahv_control.inner_loop import Learned, adaptive_surfaces, nominal_surfaces
from ahv_msgs_py.topics import STATE
from ahv_plant.model.constants import DEGREES, STEP_NS
from ahv_plant.model.vectors import Rates, State, Surfaces
from ahv_plant.termination import Termination

NOT_ALL_RECORDED = "not_all_recorded"  # what would be a success, if the record showed all of it


def missing_states(bag: Bag, steps: int) -> int:
    """How many of the states 0 to `steps` a bag lacks: what was flown, and is not in the record.

    In real time a step may lack a command, which came too late or never; a state is never missing.
    """
    return steps + 1 - int(np.count_nonzero(bag.series[STATE].stamps <= steps * STEP_NS))


def summarize(
    record: FlightRecord, ended_early: str, control: FlightControl, missing: int = 0
) -> dict[str, Any]:
    """Verdict, extremes and end of a flight under the settings `control`.

    `ended_early` says why it ended too soon, if so; `missing` how many states are not recorded.
    Success is that of a campaign, and of Table 5.1: flown to the end with |alpha| <= 5 deg
    throughout and surfaces that turn the vehicle; and the record has to show all of that.
    """
    surfaces = record.surfaces * DEGREES
    angles = margins(record)
    cause = failure(record, ended_early, control).name.lower()
    if cause == Cause.SUCCESS.name.lower() and missing:
        cause = NOT_ALL_RECORDED
    return {
        "steps": record.steps,
        "missing_steps": missing,
        "success": cause == Cause.SUCCESS.name.lower(),
        "cause": cause,
        "ended_early": ended_early,
        "max_abs_alpha_deg": angles["alpha"].largest_deg,
        "max_abs_beta_deg": angles["beta"].largest_deg,
        "surface_range_deg": [float(np.min(surfaces)), float(np.max(surfaces))],
        "throttle_range": [float(np.min(record.throttle)), float(np.max(record.throttle))],
        "fuel_kg": fuel(record),
        "final_state": dict(zip(State._fields, record.states[-1].tolist(), strict=True)),
    }


def failure(record: FlightRecord, ended_early: str, control: FlightControl) -> Cause:
    """Return the first cause of failure of a flight, by the rule of the campaigns' outcome.

    A record does not say how the surfaces were found: they are found again.
    """
    previous = NEUTRAL
    for step, row in enumerate(record.states):
        state = State(*row.tolist())
        rates = Rates(*record.rate_commands[step].tolist())
        if record.learner is None or record.estimates is None:
            solution = nominal_surfaces(state, rates, previous, control.inner)
        else:
            X_a, X_d = record.learner[step, 0:3].tolist(), record.learner[step, 3:6].tolist()
            estimate = Rates(*record.estimates[step].tolist())
            learned = Learned(Rates(*X_a), Rates(*X_d), estimate)
            solution = adaptive_surfaces(state, rates, learned, previous, control.inner)
        cause = Cause(int(cause_now(state, solution.status, record.geometric)))
        if cause != Cause.SUCCESS:
            return cause
        previous = Surfaces(*record.surfaces[step].tolist())
    # the state that ended a flight is not in its record
    words = {
        left.name.lower().replace("_", " "): Cause[left.name] for left in list(Termination)[1:]
    }
    return next((words[key] for key in words if ended_early.startswith(key)), Cause.SUCCESS)
