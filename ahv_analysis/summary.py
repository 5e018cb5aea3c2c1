"""What a flight came to, in a few numbers."""

from typing import Any

import numpy as np

from ahv_analysis.record import FlightRecord
from ahv_plant.constants import DEGREES
from ahv_plant.state import State


def summarize(record: FlightRecord, ended_early: str) -> dict[str, Any]:
    """Verdict, extremes and end of a flight; `ended_early` says why it ended too soon, if so.

    Success is Table 5.1's: flown to the end with |alpha| <= 5 deg throughout (inlet unstart).
    """
    surfaces = record.surfaces * DEGREES
    states = record.states.tolist()
    return {
        "steps": record.steps,
        "success": not ended_early and record.inlet_started,
        "ended_early": ended_early,
        "max_abs_alpha_deg": float(np.max(np.abs(record.air.alpha))) * DEGREES,
        "max_abs_beta_deg": float(np.max(np.abs(record.air.beta))) * DEGREES,
        "surface_range_deg": [float(np.min(surfaces)), float(np.max(surfaces))],
        "throttle_range": [float(np.min(record.throttle)), float(np.max(record.throttle))],
        "fuel_kg": states[0][-1] - states[-1][-1],
        "final_state": dict(zip(State._fields, states[-1], strict=True)),
    }
