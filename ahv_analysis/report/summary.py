# Copyright 2026 ahv developers, Apache-2.0
"""What a flight came to, in a few numbers."""

from typing import Any

import numpy as np

from ahv_analysis.bag.reader import Bag
from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import BLOCK
from ahv_analysis.flight.outcome import Cause, first_cause
from ahv_analysis.report.limited import limited
from ahv_analysis.report.metrics import fuel, margins
from ahv_control.own_law import Control
from ahv_msgs_py.topics import STATE
from ahv_plant.model.aerodynamics import MACH_MINIMUM
from ahv_plant.model.constants import DEGREES, STEP_NS
from ahv_plant.model.flight_condition import MACH_MAXIMUM
from ahv_plant.model.vectors import State
from ahv_plant.termination import Termination

OUTSIDE_THE_MODEL = "outside_the_model"  # what would be one, if the vehicle's data held for it
STEEPEST = 89.0  # [deg] pitch beyond which the Euler angles do not describe the attitude
NOT_ALL_RECORDED = "not_all_recorded"  # what would be a success, if the record showed all of it


def missing_states(bag: Bag, steps: int) -> int:
    """How many of the states 0 to `steps` a bag lacks: what was flown, and is not in the record.

    In real time a step may lack a command, which came too late or never; a state is never missing.
    """
    return steps + 1 - int(np.count_nonzero(bag.series[STATE].stamps <= steps * STEP_NS))


def summarize(
    record: FlightRecord,
    ended_early: str,
    missing: int = 0,
    control: Control | None = None,
) -> dict[str, Any]:
    """Verdict, extremes and end of a flight; with the settings `control` also its limits.

    `ended_early` says why it ended too soon, if so; `missing` how many states are not recorded.
    Success is that of a campaign, and of Table 5.1: flown to the end with |alpha| <= 5 deg
    throughout and surfaces that turn the vehicle; and the record has to show all of that.
    """
    surfaces = record.surfaces[:] * DEGREES
    angles = margins(record)
    cause = failure(record, ended_early).name.lower()
    if cause == Cause.SUCCESS.name.lower() and missing:
        cause = NOT_ALL_RECORDED
    outside = outside_the_model(record)
    if cause == Cause.SUCCESS.name.lower() and outside:
        cause = OUTSIDE_THE_MODEL
    return {
        "steps": record.steps,
        "missing_steps": missing,
        "success": cause == Cause.SUCCESS.name.lower(),
        "cause": cause,
        "ended_early": ended_early,
        "outside_the_model": outside,
        "limited_s": None if control is None else limited(record, control),
        "max_abs_alpha_deg": angles["alpha"].largest_deg,
        "max_abs_beta_deg": angles["beta"].largest_deg,
        "surface_range_deg": [float(np.min(surfaces)), float(np.max(surfaces))],
        "throttle_range": [float(np.min(record.throttle)), float(np.max(record.throttle))],
        "fuel_kg": fuel(record),
        "final_state": dict(zip(State._fields, record.states[-1].tolist(), strict=True)),
    }


def outside_the_model(record: FlightRecord) -> dict[str, float]:
    """When [s] a flight first was where the model of the vehicle does not hold, by what it left.

    Atmosphere and mass end a flight; here are the ranges in which it can go on all the same.
    """
    mach, pitch = record.air.mach, np.abs(record.column("theta")) * DEGREES
    left = {
        f"below Mach {MACH_MINIMUM:g}": mach < MACH_MINIMUM,
        f"above Mach {MACH_MAXIMUM:g}": mach > MACH_MAXIMUM,
        f"pitch beyond {STEEPEST:g} deg": pitch > STEEPEST,
    }
    return {
        what: float(record.time[np.argmax(where)]) for what, where in left.items() if where.any()
    }


def failure(record: FlightRecord, ended_early: str) -> Cause:
    """Return the first cause of failure of a flight, by the rule of the campaigns' outcome."""
    lost, failed = (
        len(record.stamps) if stamp is None else int(np.searchsorted(record.stamps, stamp))
        for stamp in (record.surfaces_lost_at, record.law_failed_at)
    )
    for start in range(0, len(record.stamps), BLOCK):
        states = np.ascontiguousarray(record.states[start : start + BLOCK])
        cause = Cause(int(first_cause(states, lost - start, failed - start, record.geometric)))
        if cause != Cause.SUCCESS:
            return cause
    # the state that ended a flight is not in its record
    words = {
        left.name.lower().replace("_", " "): Cause[left.name] for left in list(Termination)[1:]
    }
    return next((words[key] for key in words if ended_early.startswith(key)), Cause.SUCCESS)
