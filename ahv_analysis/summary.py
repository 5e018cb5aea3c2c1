"""What a flight came to, in a few numbers."""

from typing import Any

import numpy as np

from ahv_analysis.metrics import fuel, margins
from ahv_analysis.record import FlightRecord
from ahv_plant.constants import DEGREES
from ahv_plant.state import State


def summarize(record: FlightRecord, ended_early: str) -> dict[str, Any]:
    """Verdict, extremes and end of a flight; `ended_early` says why it ended too soon, if so.

    Success is Table 5.1's: flown to the end with |alpha| <= 5 deg throughout (inlet unstart).
    """
    surfaces = record.surfaces * DEGREES
    angles = margins(record)
    return {
        "steps": record.steps,
        "success": not ended_early and record.inlet_started,
        "ended_early": ended_early,
        "max_abs_alpha_deg": angles["alpha"].largest_deg,
        "max_abs_beta_deg": angles["beta"].largest_deg,
        "surface_range_deg": [float(np.min(surfaces)), float(np.max(surfaces))],
        "throttle_range": [float(np.min(record.throttle)), float(np.max(record.throttle))],
        "fuel_kg": fuel(record),
        "final_state": dict(zip(State._fields, record.states[-1].tolist(), strict=True)),
    }
