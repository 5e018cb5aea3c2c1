# Copyright 2026 ahv developers, Apache-2.0
"""What the real world has and the flight control does not know (sections 4.1 and 4.3).

Only the plant may import this module; a test sees to it.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from ahv_msgs_py.parameters import ParameterError
from ahv_plant.hardware.wind import Wind
from ahv_plant.model.aerodynamics import AirData, Coefficients, Loads
from ahv_plant.model.mass import Inertia
from ahv_plant.model.vectors import Surfaces
from ahv_plant.numerics.elementary import sin_cos
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.optional import changed_by


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


class FurtherDispersion(NamedTuple):
    """Dispersions beyond the report's nine, after Marrison and Stengel (1998).

    Multipliers [-] but for X_cg; as there, each changes what it names and nothing else. So `mass`
    is that of the vehicle against the one that is known: forces accelerate so many times the
    state's mass. Inertia and centre of gravity have dispersions of their own, and stay those of
    the state's mass, within the range of their fits. A vehicle that starts lighter and knows it is
    another `initial.mass`.
    """

    mass: float = 1.0
    X_cg: float = 0.0  # [m] shift aft
    density: float = 1.0
    temperature: float = 1.0  # of the speed of sound
    thrust: float = 1.0  # and with it, by eq 2.6, the fuel flow
    right_elevon: float = (
        1.0  # effectiveness: deflects the air like a surface so many times as far
    )
    left_elevon: float = 1.0
    rudder: float = 1.0


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
    """The true vehicle and its air, as far as they are not the nominal ones."""

    geometric: bool = False  # h is a geometric altitude
    dispersion: Dispersion = Dispersion()
    disturbance: Disturbance | None = None
    further: FurtherDispersion | None = None
    wind: Wind | None = None


NOMINAL = Truth()
HIGHEST_LEVEL = 0.9  # [-] of a drawn dispersion


def in_calm(truth: Truth) -> Truth:
    """Without what comes and goes: disturbances and wind, in which no trim is sought."""
    return truth._replace(disturbance=None, wind=None)


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


@changed_by
def disperse_air(nominal: AirData, by: FurtherDispersion) -> AirData:
    """True air data: density counts in the pressure [Pa], temperature in the Mach number [-]."""
    return AirData(
        nominal.speed,
        nominal.alpha,
        nominal.beta,
        nominal.mach / sqrt(by.temperature),
        nominal.dynamic_pressure * by.density,
        nominal.sin_alpha,
        nominal.cos_alpha,
    )


@changed_by
def disperse_surfaces(surfaces: Surfaces, by: FurtherDispersion) -> Surfaces:
    """Deflections [rad] of nominal surfaces that do what these do."""
    return Surfaces(
        surfaces.right_elevon * by.right_elevon,
        surfaces.left_elevon * by.left_elevon,
        surfaces.rudder * by.rudder,
    )


@changed_by
def disperse_centre(nominal: float, by: FurtherDispersion) -> float:
    """True X_cg [m]."""
    return nominal + by.X_cg


@changed_by
def disperse_thrust(nominal: float, by: FurtherDispersion) -> float:
    """True thrust [N]."""
    return nominal * by.thrust


@changed_by
def disperse_weight(total: Loads, by: FurtherDispersion) -> Loads:
    """Loads [N, N m] that move the state's mass as `total` moves the true one, under gravity."""
    per_mass = 1.0 / by.mass
    return Loads(
        total.Fx * per_mass, total.Fy * per_mass, total.Fz * per_mass, total.L, total.M, total.N
    )


@changed_by
def disperse_throttle(nominal: float, by: FurtherDispersion) -> float:
    """Throttle [-] that gives the true vehicle what `nominal` would give the nominal one."""
    return nominal * by.mass / by.thrust


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
