# Copyright 2026 ahv developers, Apache-2.0
"""Gains of the linear-quadratic law: `python -m studies.lqi_gains` writes them into the package.

Then `ruff format` makes lines of them.

They are computed here and kept as numbers, not computed where they are flown: Riccati solvers
answer in other last bits on other machines, and a flight has the same bits on all of them.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_are

from ahv_control.laws._lqi_schedule import Corner, Corners, Lateral, Longitudinal
from ahv_plant.dispersion import NOMINAL
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import RADIANS, STEP
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.trim import Trim, trim
from ahv_plant.vehicle import state_rate

Array = NDArray[np.float64]
GAINS = "ahv_control/laws/_lqi_gains.py"
ALTITUDE = 24_000.0  # [m]
MASSES = (110_000.0, 140_000.0)  # [kg]
MACH_NUMBERS = (5.0, 7.0)  # [-]


class Weights(NamedTuple):
    """Bryson's rule: what each state and command may come to; its weight is 1 / that^2."""

    states: Longitudinal
    elevons: float  # [rad]
    throttle: float  # [-]
    sideways: Lateral
    difference: float  # [rad]
    rudder: float  # [rad]


WEIGHTS = Weights(
    Longitudinal(10.0, 5.0 * RADIANS, 0.8 * RADIANS, 1.0 * RADIANS, 300.0, 6000.0, 200.0),
    5.0 * RADIANS,
    0.1,
    Lateral(
        1.0 * RADIANS,
        5.0 * RADIANS,
        2.0 * RADIANS,
        5.0 * RADIANS,
        5.0 * RADIANS,
        50.0 * RADIANS,
    ),
    5.0 * RADIANS,
    5.0 * RADIANS,
)


class Linear(NamedTuple):
    """x_dot = A x + B u of one motion at a trim."""

    A: Array
    B: Array


def linearised(at: Trim) -> tuple[Linear, Linear]:
    """Motion in the vertical plane and out of it, in the states of the schedule."""
    states, commands = np.array(at.state), np.array([at.surfaces[0], 0.0, 0.0, at.throttle])

    def rates(x: Array, u: Array) -> Array:
        surfaces = Surfaces(u[0] + u[1], u[0] - u[1], u[2])
        return np.array(state_rate(State(*x), surfaces, u[3], 0.0, NOMINAL))

    width = np.array([1e-2] * 3 + [1e-5] * 6 + [1.0] * 4)
    A = np.stack(
        [(rates(states + d, commands) - rates(states - d, commands)) for d in np.diag(width)], 1
    ) / (2.0 * width)
    push = np.array([1e-5] * 3 + [1e-4])
    B = np.stack(
        [(rates(states, commands + d) - rates(states, commands - d)) for d in np.diag(push)], 1
    ) / (2.0 * push)
    index = {name: place for place, name in enumerate(State._fields)}
    u, w, Q, theta, h = (index[name] for name in ("u", "w", "Q", "theta", "h"))
    speed = np.hypot(at.state.u, at.state.w)
    # alpha and climb angle of the deviations: dalpha = (cos a dw - sin a du) / V
    T = np.zeros((7, 13))  # from the vehicle's states to those of the schedule
    T[0, u] = 1.0
    alpha = np.zeros(13)
    alpha[w], alpha[u] = np.cos(at.alpha) / speed, -np.sin(at.alpha) / speed
    T[1], T[1, theta] = -alpha, 1.0
    T[2], T[3, Q], T[4, h] = alpha, 1.0, 1.0
    back = np.linalg.pinv(T[:5])
    long = Linear(np.zeros((7, 7)), np.zeros((7, 2)))
    long.A[:5, :5], long.B[:5] = T[:5] @ A @ back, T[:5] @ B[:, [0, 3]]
    long.A[5, 4] = long.A[6, 0] = 1.0
    side = [index[name] for name in ("v", "P", "R", "phi", "psi")]
    scale = np.diag([1.0 / speed, 1.0, 1.0, 1.0, 1.0])
    lat = Linear(np.zeros((6, 6)), np.zeros((6, 2)))
    lat.A[:5, :5] = scale @ A[np.ix_(side, side)] @ np.linalg.inv(scale)
    lat.B[:5] = scale @ B[np.ix_(side, [1, 2])]
    lat.A[5, 4] = 1.0
    return long, lat


def sampled(of: Linear) -> Linear:
    """The same from step to step, with commands held."""
    n, m = of.B.shape
    block = expm(STEP * np.block([[of.A, of.B], [np.zeros((m, n + m))]]))
    return Linear(block[:n, :n], block[:n, n:])


def gains(of: Linear, states: Array, commands: Array) -> tuple[Array, Array]:
    """K of u = -K x that minimises the sum of (x / states)^2 + (u / commands)^2; Riccati's S."""
    A, B = sampled(of)
    weight = np.diag(1.0 / commands**2)
    S = solve_discrete_are(A, B, np.diag(1.0 / states**2), weight)
    return np.linalg.solve(weight + B.T @ S @ B, B.T @ S @ A), S


def corner(mass: float, mach: float, by: Weights) -> Corner:
    """Trim and gains at one corner."""
    at = trim(ALTITUDE, mach * atmosphere(ALTITUDE, False).sound_speed, mass)
    if not at.converged or not at.within_limits:
        raise ValueError(f"there is no trim at {mass:g} kg and Mach {mach:g}")
    long, lat = linearised(at)
    K, _ = gains(long, np.array(by.states), np.array([by.elevons, by.throttle]))
    L, _ = gains(lat, np.array(by.sideways), np.array([by.difference, by.rudder]))
    return Corner(
        at.alpha,
        at.surfaces.right_elevon,
        at.throttle,
        Longitudinal(*K[0].tolist()),
        Longitudinal(*K[1].tolist()),
        Lateral(*L[0].tolist()),
        Lateral(*L[1].tolist()),
    )


def corners(by: Weights = WEIGHTS) -> Corners:
    """The whole schedule."""
    (light, heavy), (slow, fast) = MASSES, MACH_NUMBERS
    each = (corner(mass, mach, by) for mass in MASSES for mach in MACH_NUMBERS)
    return Corners(light, heavy, slow, fast, *each)


def written(value: float | tuple[float, ...]) -> str:
    """Python for a number, to nine digits, or for a named tuple of such."""
    if isinstance(value, tuple):
        return f"{type(value).__name__}({', '.join(map(written, value))})"
    return repr(float(f"{value:.9g}"))


def source(found: Corners) -> str:
    """Text of the module that holds the schedule."""
    return f'''# Copyright 2026 ahv developers, Apache-2.0
"""Gains of the linear-quadratic law, which `python -m studies.lqi_gains` wrote."""

from ahv_control.laws._lqi_schedule import Corner, Corners, Lateral, Longitudinal

ALTITUDE = {ALTITUDE}  # [m] of the trims
CORNERS = {written(found)}
'''


def main() -> None:
    """Write the gains into the package."""
    Path(GAINS).write_text(source(corners()), encoding="utf-8")


if __name__ == "__main__":
    main()
