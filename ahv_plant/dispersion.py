# Copyright 2026 ahv developers, Apache-2.0
"""What the real vehicle has and its flight control does not know (sections 4.1 and 4.3).

Only the plant may import this module; a test sees to it.
"""

from typing import NamedTuple

import numpy as np

from ahv_msgs_py.parameters import ParameterError
from ahv_plant.model.aerodynamics import Coefficients
from ahv_plant.model.mass import Inertia
from ahv_plant.numerics.elementary import sin_cos
from ahv_plant.numerics.elementwise import elementwise, select


class Dispersion(NamedTuple):
    """Multipliers [-] of the true coefficients and inertias; 1 is nominal."""

    CL: float = 1.0
    CD: float = 1.0
    CY: float = 1.0
    Cl: float = 1.0
    Cm: float = 1.0
    Cn: float = 1.0
    Ixx: float = 1.0
    Iyy: float = 1.0
    Izz: float = 1.0


class AxisDisturbance(NamedTuple):
    """Disturbance of one angular acceleration; the sum of all its parts."""

    constant: float = 0.0  # [rad/s^2]
    step: float = 0.0  # [rad/s^2] from step_time on
    step_time: float = 0.0  # [s]
    amplitude: float = 0.0  # [rad/s^2] of a sine
    frequency: float = 0.0  # [rad/s] of the sine
    P: float = 0.0  # [1/s] times P
    Q: float = 0.0  # [1/s] times Q
    R: float = 0.0  # [1/s] times R
    P2: float = 0.0  # [1/rad] times P^2
    Q2: float = 0.0  # [1/rad] times Q^2
    R2: float = 0.0  # [1/rad] times R^2


class Disturbance(NamedTuple):
    """Disturbances d(t, X) of the rates of P, Q and R, eq 4.2."""

    P: AxisDisturbance = AxisDisturbance()
    Q: AxisDisturbance = AxisDisturbance()
    R: AxisDisturbance = AxisDisturbance()


class Truth(NamedTuple):
    """The true vehicle, as far as it is not the nominal one."""

    geometric: bool = False  # h is a geometric altitude
    dispersion: Dispersion = Dispersion()
    disturbance: Disturbance | None = None


NOMINAL = Truth()
HIGHEST_LEVEL = 0.9  # [-] of a drawn dispersion


def draw_dispersion(level: float, seed: int, run: int) -> Dispersion:
    """Multipliers 1 + U(-level, level) [-], one each, of the run `run` of the campaign `seed`.

    Any run can be drawn again alone, with the same bits. Raises ParameterError for a level at
    which a vehicle would have next to nothing left of something.
    """
    if not 0.0 <= level <= HIGHEST_LEVEL:
        raise ParameterError(f"level is {level:g}, but must be 0 to {HIGHEST_LEVEL:g}")
    draws = np.random.default_rng((seed, run)).uniform(-level, level, len(Dispersion._fields))
    return Dispersion(*(1.0 + draws).tolist())


@elementwise
def disperse_coefficients(nominal: Coefficients, by: Dispersion) -> Coefficients:
    """True aerodynamic coefficients."""
    return Coefficients(
        nominal.CL * by.CL,
        nominal.CD * by.CD,
        nominal.CY * by.CY,
        nominal.Cl * by.Cl,
        nominal.Cm * by.Cm,
        nominal.Cn * by.Cn,
    )


@elementwise
def disperse_inertia(nominal: Inertia, by: Dispersion) -> Inertia:
    """True moments of inertia [kg m^2]."""
    return Inertia(nominal.Ixx * by.Ixx, nominal.Iyy * by.Iyy, nominal.Izz * by.Izz)


@elementwise
def axis_disturbance(axis: AxisDisturbance, time: float, P: float, Q: float, R: float) -> float:
    """d_i(t, X) [rad/s^2] of one axis at `time` [s] and the body rates [rad/s]."""
    sine, _ = sin_cos(axis.frequency * time)
    stepped = select(time >= axis.step_time, axis.step, 0.0)
    with_rates = P * (axis.P + axis.P2 * P) + Q * (axis.Q + axis.Q2 * Q)
    with_rates = with_rates + R * (axis.R + axis.R2 * R)
    return axis.constant + stepped + axis.amplitude * sine + with_rates


@elementwise
def disturbance_acceleration(
    disturbance: Disturbance | None, time: float, P: float, Q: float, R: float
) -> tuple[float, float, float]:
    """d(t, X) [rad/s^2] on the rates of P, Q, R; zero for None, at no cost in compiled code."""
    if disturbance is None:
        zero = select(P == P, 0.0, 0.0)  # as wide as P, so that both branches are of one type
        return zero, zero, zero
    return (
        axis_disturbance(disturbance.P, time, P, Q, R),
        axis_disturbance(disturbance.Q, time, P, Q, R),
        axis_disturbance(disturbance.R, time, P, Q, R),
    )
