# Copyright 2026 ahv developers, Apache-2.0
"""When a flight is over because the model no longer describes the vehicle."""

from enum import IntEnum

from ahv_plant.model.atmosphere import ALTITUDE_MAXIMUM, ALTITUDE_MINIMUM, geopotential_altitude
from ahv_plant.model.mass import MASS_MAXIMUM, MASS_MINIMUM
from ahv_plant.model.vectors import State
from ahv_plant.numerics.elementwise import elementwise, select


class Termination(IntEnum):
    """Why the flight cannot go on."""

    NONE = 0
    STATE_IS_NOT_FINITE = 1
    LEFT_THE_ATMOSPHERE_MODEL = 2  # above 47 km or below 0
    LEFT_THE_MASS_MODEL = 3  # below 60 t: there is no fuel left to burn


@elementwise
def termination(state: State, geometric: bool) -> int:
    """Why a flight ends at a state, a `Termination` as a plain number."""
    H = geopotential_altitude(state.h, geometric)
    total = state.u + state.v + state.w + state.P + state.Q + state.R
    total = total + state.phi + state.theta + state.psi + state.x + state.y + H + state.mass
    finite = total - total == 0.0
    inside = (H >= ALTITUDE_MINIMUM) & (H <= ALTITUDE_MAXIMUM)
    weighs = (state.mass >= MASS_MINIMUM) & (state.mass <= MASS_MAXIMUM)
    return select(finite, select(inside, select(weighs, 0, 3), 2), 1)


def termination_reason(state: State, geometric: bool, time: float) -> str:
    """Why the flight ends with `state` at `time` [s], in words; empty if it does not."""
    found = Termination(termination(state, geometric))
    if found == Termination.NONE:
        return ""
    return f"{found.name.lower().replace('_', ' ')} at {time:g} s"
