# Copyright 2026 ahv developers, Apache-2.0
"""Wind: steady, a gust, and Dryden turbulence (MIL-F-8785C, 1980, section 3.7).

It acts through the velocity against the air alone: wherever the air is asked, it sees the vehicle
move by the state's velocity less the wind's. Steady wind and gust are functions of state and time
and vary within a step; turbulence is a sampled process, held over the step.

The Dryden form is the one above 2000 ft, with one scale of 1750 ft for all three axes. It is a fit
to what subsonic aircraft measured below some 15 km, and was never meant for Mach 6 at 24 km, where
the vehicle crosses a scale in 0.3 s: take it for a broadband disturbance of stated strength and
shape, not for weather. The turning of the air over the span and the length, its angular part, is
left out: it is that of a scale 30 times the span.
"""

from functools import partial
from math import sqrt
from typing import NamedTuple

from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import State, clamp
from ahv_plant.numerics.elementary import PI, exp_small, sin_cos
from ahv_plant.numerics.elementwise import elementwise
from ahv_plant.numerics.optional import changed_by, optional

SCALE = 533.4  # [m] length of turbulence L: 1750 ft above 2000 ft


class Velocity(NamedTuple):
    """Velocity of the air over the ground in body axes [m/s]."""

    u: float  # forward
    v: float  # right
    w: float  # down


class SteadyWind(NamedTuple):
    """Horizontal wind that changes with the altitude alone; where it blows to, not from."""

    north: float  # [m/s] at the altitude of reference
    east: float  # [m/s]
    altitude: float  # [m] of reference
    shear_north: float  # [1/s] change by altitude
    shear_east: float  # [1/s]


class Gust(NamedTuple):
    """A 1-cosine gust in body axes, up to its peak and down again.

    MIL-F-8785C (1980) has the rise alone; what stays after it is a steady wind.

    Its length is a time: what the loops feel, and the speed makes a distance of it. A gust that
    stands in space would need the way flown into it as a state.
    """

    u: float  # [m/s] peak
    v: float  # [m/s]
    w: float  # [m/s]
    start: float  # [s]
    duration: float  # [s]


class Turbulence(NamedTuple):
    """Dryden's shaping filters for the time of a step, gains times the strength."""

    decay: float  # [-] of both poles over a step
    along: float  # [m/s] gain of the noise in u
    across: float  # [m/s] gain of the noise in v and w
    across_before: float  # [m/s] gain of the noise a step earlier


class TurbulentAir(NamedTuple):
    """Velocity of the turbulence in body axes, and what the filters remember."""

    u: float  # [m/s]
    v: float  # [m/s]
    w: float  # [m/s]
    v_lag: float  # [-] first pole of v
    w_lag: float  # [-] first pole of w


class Wind(NamedTuple):
    """What the air does; parts that are None are not there and cost nothing."""

    steady: SteadyWind | None = None
    gust: Gust | None = None
    turbulence: Turbulence | None = None


CALM = TurbulentAir(0.0, 0.0, 0.0, 0.0, 0.0)  # [m/s, -] before the first step


@elementwise
def turbulence_of(sigma: float, speed: float) -> Turbulence:
    """Filters for turbulence of `sigma` [m/s] on each axis, flown through at `speed` [m/s].

    MIL-F-8785C (1980) in time, with T = L / V: white noise through
    sigma sqrt(2 T) / (1 + T s) for u, through sigma sqrt(T) (1 + sqrt(3) T s) / (1 + T s)^2 for v
    and w. The samples of the latter, correlated by R(t) = sigma^2 exp(-t / T) (1 - t / (2 T)), are
    those of the same double pole behind a sum of two successive samples of noise. Its gains
    follow from R at lags of one and two steps, exactly: no filter is approximated.
    """
    steps = STEP * speed / SCALE  # in units of T
    a = exp_small(-steps)
    a2 = a * a
    # of y[k] - 2 a y[k-1] + a^2 y[k-2]: variance, and covariance of neighbours
    variance = 1.0 + 2.0 * steps * a2 - a2 * a2
    covariance = a * (a2 * (1.0 - 0.5 * steps) - (1.0 + 0.5 * steps))
    total = sqrt(variance + 2.0 * covariance)
    difference = sqrt(variance - 2.0 * covariance)
    return Turbulence(
        a,
        sigma * sqrt(1.0 - a2),
        sigma * 0.5 * (total + difference),
        sigma * 0.5 * (total - difference),
    )


@elementwise
def turbulence_step(
    air: TurbulentAir, noise: tuple[float, float, float], turbulence: Turbulence
) -> TurbulentAir:
    """Turbulence a step later, driven by three unit normals `noise` [-]; MIL-F-8785C (1980).

    From CALM it has its strength after some 1 s.
    """
    a = turbulence.decay
    n_u, n_v, n_w = noise
    v_lag = a * air.v_lag + n_v
    w_lag = a * air.w_lag + n_w
    now, before = turbulence.across, turbulence.across_before
    return TurbulentAir(
        a * air.u + turbulence.along * n_u,
        a * air.v + now * v_lag + before * air.v_lag,
        a * air.w + now * w_lag + before * air.w_lag,
        v_lag,
        w_lag,
    )


@optional
def _calm(turbulence: Turbulence) -> TurbulentAir:
    return CALM


@optional
def calm_air(wind: Wind) -> TurbulentAir | None:
    """Air [m/s, -] before a flight; None where it never becomes turbulent."""
    air: TurbulentAir | None = _calm(wind.turbulence)
    return air


@optional
def _later(
    air: TurbulentAir, noise: tuple[float, float, float], turbulence: Turbulence
) -> TurbulentAir:
    return turbulence_step(air, noise, turbulence)


@optional
def turbulent_air(
    air: TurbulentAir | None, noise: tuple[float, float, float], wind: Wind
) -> TurbulentAir | None:
    """Air [m/s, -] a step later, driven by three unit normals `noise` [-]; None as `calm_air`."""
    later: TurbulentAir | None = _later(air, noise, wind.turbulence)
    return later


def is_turbulent(wind: Wind | None) -> bool:
    """Whether a flight needs draws for its air."""
    return wind is not None and wind.turbulence is not None


def _still(state: State) -> Velocity:
    return Velocity(0.0, 0.0, 0.0)


@partial(optional, otherwise=_still)
def steady_wind(state: State, steady: SteadyWind) -> Velocity:
    """Steady wind [m/s] at the altitude and attitude of a state; none for None."""
    above = state.h - steady.altitude
    north = steady.north + steady.shear_north * above
    east = steady.east + steady.shear_east * above
    sin_phi, cos_phi = sin_cos(state.phi)
    sin_theta, cos_theta = sin_cos(state.theta)
    sin_psi, cos_psi = sin_cos(state.psi)
    ahead = north * cos_psi + east * sin_psi
    across = east * cos_psi - north * sin_psi
    return Velocity(
        ahead * cos_theta,
        ahead * sin_theta * sin_phi + across * cos_phi,
        ahead * sin_theta * cos_phi - across * sin_phi,
    )


@changed_by
def add_gust(air: Velocity, time: float, gust: Gust) -> Velocity:
    """Air [m/s] with the gust at `time` [s], MIL-F-8785C (1980): (1 - cos) / 2, once around."""
    _, cosine = sin_cos(2.0 * PI * clamp((time - gust.start) / gust.duration, 0.0, 1.0))
    share = 0.5 * (1.0 - cosine)
    return Velocity(air.u + share * gust.u, air.v + share * gust.v, air.w + share * gust.w)


@changed_by
def add_turbulence(air: Velocity, turbulence: TurbulentAir) -> Velocity:
    """Air [m/s] with the turbulence of the step."""
    return Velocity(air.u + turbulence.u, air.v + turbulence.v, air.w + turbulence.w)


@elementwise
def wind_body(state: State, time: float, turbulence: TurbulentAir | None, wind: Wind) -> Velocity:
    """Velocity of the air over the ground [m/s] in body axes, at a state and `time` [s]."""
    steady = steady_wind(state, wind.steady)
    air: Velocity = add_turbulence(add_gust(steady, time, wind.gust), turbulence)
    return air


@changed_by
def through_air(state: State, time: float, turbulence: TurbulentAir | None, wind: Wind) -> State:
    """State with the velocity against the air [m/s] for that over the ground, at `time` [s]."""
    air = wind_body(state, time, turbulence, wind)
    return State(
        state.u - air.u,
        state.v - air.v,
        state.w - air.w,
        state.P,
        state.Q,
        state.R,
        state.phi,
        state.theta,
        state.psi,
        state.x,
        state.y,
        state.h,
        state.mass,
    )
