# Copyright 2026 ahv developers, Apache-2.0
"""For how long a flight was held by the limits of its guidance and of its outer loop."""

import numpy as np

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Array
from ahv_control.flight_control import FlightControl
from ahv_control.limits_met import CLOSE, limits_met
from ahv_control.own_law import Control
from ahv_control.reach import why_not_followed
from ahv_control.reference import Reference
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import State

LOOK = 100  # steps between looks whether the vehicle can follow, as the node has it
MASS = State._fields.index("mass")


def limited(record: FlightRecord, control: Control) -> dict[str, float]:
    """Time [s] that a flight stood at each limit, by its name; none for those never met.

    By the settings that the flight began with: the limits of the outer loop, and with guidance
    that of the bank, and the reach of the nominal vehicle with the mass that was measured.
    """
    met: dict[str, float] = {}
    for part in record.parts():
        for name, seconds in _limited(part, control).items():
            met[name] = met.get(name, 0.0) + seconds
    return {name: seconds for name, seconds in met.items() if seconds > 0.0}


def _limited(record: FlightRecord, control: Control) -> dict[str, float]:
    told: Array = np.asarray(record.states if record.measured is None else record.measured)
    pitch = np.asarray(record.attitude_commands)[:, 1]
    found: dict[str, float] = {}
    if isinstance(control, FlightControl):  # of a law of one's own nobody knows them
        outer = control.outer
        met = limits_met(State(*told.T), pitch, outer.climb_limit, outer.alpha_limit)
        found["climb_limit"] = STEP * float(np.count_nonzero(met.climb))
        found["alpha_limit"] = STEP * float(np.count_nonzero(met.alpha))
    guidance = control.guidance
    if guidance is None or record.references is None:
        return found
    references: Array = np.asarray(record.references)
    banked = np.abs(references[:, Reference._fields.index("phi")])
    if guidance.coordinated and guidance.bank_limit > 0.0:
        at_limit = np.count_nonzero(banked >= guidance.bank_limit - CLOSE)
        found["bank_limit"] = STEP * float(at_limit)
    beyond = [
        why_not_followed(Reference(*row), mass, record.geometric) != ""
        for row, mass in zip(references[::LOOK].tolist(), told[::LOOK, MASS].tolist(), strict=True)
    ]
    return found | {"reach": LOOK * STEP * float(sum(beyond))}
