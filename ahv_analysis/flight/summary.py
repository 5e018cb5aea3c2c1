# Copyright 2026 ahv developers, Apache-2.0
"""What a flight came to, in a few numbers."""

from typing import Any

import numpy as np

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.flight.outcome import Cause, cause_now
from ahv_analysis.report.metrics import fuel, margins
from ahv_control.flight_control import NEUTRAL, FlightControl
from ahv_control.inner_loop import Learned, adaptive_surfaces, nominal_surfaces
from ahv_plant.model.constants import DEGREES
from ahv_plant.model.vectors import Rates, State, Surfaces
from ahv_plant.termination import Termination


def summarize(record: FlightRecord, ended_early: str, control: FlightControl) -> dict[str, Any]:
    """Verdict, extremes and end of a flight under the settings `control`.

    `ended_early` says why it ended too soon, if so. Success is that of a campaign, and of Table
    5.1: flown to the end with |alpha| <= 5 deg throughout and surfaces that turn the vehicle.
    """
    surfaces = record.surfaces * DEGREES
    angles = margins(record)
    cause = failure(record, ended_early, control)
    return {
        "steps": record.steps,
        "success": cause == Cause.SUCCESS,
        "cause": cause.name.lower(),
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
    for step, row in enumerate(record.states.tolist()):
        state = State(*row)
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
