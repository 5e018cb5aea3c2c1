# Copyright 2026 ahv developers, Apache-2.0
"""Where the outer loop was held by one of its limits: seen from what it commands (section 3.1)."""

from typing import Any, NamedTuple

import numpy as np

from ahv_plant.model.vectors import State

CLOSE = 1e-9  # [rad] to a limit that is met


class LimitsMet(NamedTuple):
    """Which limits of the outer loop hold a pitch command; numbers or arrays (n,)."""

    climb: Any  # the climb angle asked for, or the argument of the arcsine of eq 3.1
    alpha: Any  # the angle of attack


def limits_met(state: State, pitch: Any, climb_limit: float, alpha_limit: float) -> LimitsMet:
    """Limits [rad] that the `pitch` commanded [rad] stands at; of arrays (n,) an array of each.

    Eq 3.1 commands the angle of attack and a climb angle; beyond an argument of 1 its arcsine
    stays at 90 deg, which is a limit as any other.
    """
    down = state.v * np.sin(state.phi) + state.w * np.cos(state.phi)
    alpha = np.arctan2(down, state.u)  # in the vertical plane
    met_climb = np.abs(pitch - alpha) >= climb_limit - CLOSE
    met_alpha = np.abs(pitch - (state.theta - alpha)) >= alpha_limit - CLOSE
    return LimitsMet(met_climb, met_alpha)
