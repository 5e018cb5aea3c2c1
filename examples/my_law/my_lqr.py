# Copyright 2026 ahv developers, Apache-2.0
"""A linear-quadratic regulator about the trim in cruise: a law in one file."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_continuous_are

from ahv_control.law import direct
from ahv_plant.dispersion import NOMINAL
from ahv_plant.model.vectors import Surfaces
from ahv_plant.numerics.elementwise import elementwise
from ahv_plant.trim import trim
from ahv_plant.vehicle import state_rate

STATES = ("u", "v", "w", "P", "Q", "R", "phi", "theta", "psi", "h")
# errors that cost as much as a deflection of `surface`, in the units of the states
LARGE = (20.0, 10.0, 20.0, 0.1, 0.1, 0.1, 0.1, 0.05, 0.1)


class Settings(NamedTuple):
    """What a case can set."""

    altitude_error: float = 100.0  # [m] that costs as much as a deflection of `surface`
    surface: float = 0.1  # [rad]


class Design(NamedTuple):
    """What is flown with."""

    gain: np.ndarray  # (4, 10) of controls by states
    trim: np.ndarray  # (14,) states and controls


def design(settings):
    """Gains for the nominal vehicle in cruise."""
    cruise = trim()
    controls = *cruise.surfaces, cruise.throttle
    at = np.array([*(getattr(cruise.state, name) for name in STATES), *controls])

    def rates(x):
        state = cruise.state._replace(**dict(zip(STATES, x, strict=False)))
        rate = state_rate(state, Surfaces(*x[10:13]), x[13], 0.0, NOMINAL)
        return np.array([getattr(rate, name) for name in STATES])

    J = np.column_stack([(rates(at + d) - rates(at - d)) / 2e-4 for d in 1e-4 * np.eye(14)])
    A, B = J[:, :10], J[:, 10:]
    Q = np.diag(np.array([*LARGE, settings.altitude_error]) ** -2.0)
    R = np.diag(np.array([settings.surface] * 3 + [0.2]) ** -2.0)
    return Design(np.linalg.solve(R, B.T @ solve_continuous_are(A, B, Q, R)), at)


@elementwise
def start(measured, reference, settings):
    """Commands at the first measurement; there is nothing to remember."""
    return None, answer(measured.state, reference, settings)


@elementwise
def step(memory, before, commands, measured, reference, settings):
    """Commands at a measurement."""
    return None, answer(measured.state, reference, settings)


@elementwise
def answer(x, wanted, settings):
    """Controls of the trim, less the gain by what the states are off."""
    K, at = settings.gain, settings.trim
    along = (x.u - wanted.speed, x.v, x.w - at[2], x.P, x.Q, x.R)
    angles = (x.phi - wanted.phi, x.theta - at[7], x.psi - wanted.psi)
    error = (*along, *angles, x.h - wanted.altitude)
    right, left = at[10] - K[0, 0] * error[0], at[11] - K[1, 0] * error[0]
    rudder, throttle = at[12] - K[2, 0] * error[0], at[13] - K[3, 0] * error[0]
    for i in range(1, 10):
        right, left = right - K[0, i] * error[i], left - K[1, i] * error[i]
        rudder, throttle = rudder - K[2, i] * error[i], throttle - K[3, i] * error[i]
    return direct(Surfaces(right, left, rudder), throttle)
