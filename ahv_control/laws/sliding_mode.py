# Copyright 2026 ahv developers, Apache-2.0
"""Sliding mode of second order, the super-twisting law, on the body rates.

H. Xu, M. D. Mirmirani and P. A. Ioannou, "Adaptive Sliding Mode Control Design for a Hypersonic
Flight Vehicle", Journal of Guidance, Control, and Dynamics 27(5), 2004, brought sliding modes to
this vehicle. The law here is the successor whose commands have no discontinuity: A. Levant,
"Sliding Order and Sliding Accuracy in Sliding Mode Control", International Journal of Control
58(6), 1993, with the gains of J. A. Moreno and M. Osorio, "Strict Lyapunov Functions for the
Super-Twisting Algorithm", IEEE Transactions on Automatic Control 57(4), 2012.

The sliding variable s of each channel is its rate less what is commanded. Where the disturbance of
its acceleration changes at less than L,

    demand = -1.5 sqrt(L |s|) sign(s) + v,    v_dot = -1.1 L sign(s)

takes s to zero in finite time, and v to the disturbance. Surfaces that follow late, or are told
late, answer sign(s) with a limit cycle; so both terms are smooth within a layer of the width phi,

    demand = -1.5 sqrt(L) s / sqrt(|s| + phi) + v,    v_dot = -1.1 L s / (|s| + phi),

in which the law is linear with the frequency omega = sqrt(L / phi). That frequency and the width
are its settings. The nominal inversion of section 3.3 makes surfaces of the demand.
"""

from math import sqrt
from typing import NamedTuple

from ahv_control.law import Commands
from ahv_control.laws._loops import Loops, answered, commanded, loops_of
from ahv_control.newton_raphson import solve_surfaces
from ahv_control.reference import Reference
from ahv_plant.model.constants import RADIANS, STEP
from ahv_plant.model.vectors import Measurement, Rates, State, Surfaces
from ahv_plant.numerics.elementwise import elementwise, select

PROPORTIONAL, INTEGRAL = 1.5, 1.1  # [-] of sqrt(L) and of L, Moreno and Osorio


class Settings(NamedTuple):
    """Settings of the law."""

    omega: float = 3.5  # [rad/s] of the linear law within the layer, all channels
    phi: float = 10.0  # [deg/s] width of the layer; the smaller, the nearer to a true sliding mode
    k_h: float = 0.01  # [1/s] altitude gain, eq 3.1
    k_attitude: float = 0.1  # [1/s] gain of the three attitude angles
    k_u: float = 0.1  # [1/s] speed gain, eq 3.2
    alpha_limit: float = 180.0  # [deg] angle of attack that commands stay within; 180 is off
    geometric_altitude: bool = False  # h is a geometric altitude, not a geopotential one


class Design(NamedTuple):
    """What is flown with."""

    L: float  # [rad/s^3] bound of what a disturbance changes by
    phi: float  # [rad/s]
    geometric: bool
    loops: Loops


def design(settings: Settings) -> Design:
    """Return what is flown with: width [rad/s] and frequency [rad/s] say which L it is for."""
    phi = settings.phi * RADIANS
    return Design(
        settings.omega * settings.omega * phi,
        phi,
        settings.geometric_altitude,
        loops_of(settings),
    )


@elementwise
def reaching(s: float, v: float, L: float, phi: float) -> float:
    """Demand [rad/s^2] of one channel at s [rad/s], v [rad/s^2], L [rad/s^3], phi [rad/s]."""
    return v - PROPORTIONAL * sqrt(L) * s / sqrt(abs(s) + phi)


@elementwise
def twisted(s: float, v: float, L: float, phi: float) -> float:
    """Integral v [rad/s^2] of one channel a step later: s, phi in [rad/s], L in [rad/s^3]."""
    return v - STEP * INTEGRAL * L * s / (abs(s) + phi)


@elementwise
def start(measured: Measurement, reference: Reference, settings: Design) -> tuple[Rates, Commands]:
    """Integrals of zero, and the commands to the first measurement."""
    none = Rates(0.0, 0.0, 0.0)
    return none, answer(measured.state, none, Surfaces(0.0, 0.0, 0.0), reference, settings)


@elementwise
def answer(
    state: State, v: Rates, previous: Surfaces, reference: Reference, settings: Design
) -> Commands:
    """Commands with the integrals v [rad/s^2]; the search begins at the `previous` [rad]."""
    attitude, rates = commanded(state, reference, settings.loops)
    L, phi = settings.L, settings.phi
    demand = Rates(
        reaching(state.P - rates.P, v.P, L, phi),
        reaching(state.Q - rates.Q, v.Q, L, phi),
        reaching(state.R - rates.R, v.R, L, phi),
    )
    solution = solve_surfaces(state, demand, previous, settings.geometric)
    return answered(state, attitude, rates, solution, reference, settings.loops)


@elementwise
def step(
    memory: Rates,
    before: Measurement,
    commands: Commands,
    measured: Measurement,
    reference: Reference,
    settings: Design,
) -> tuple[Rates, Commands]:
    """Integrals and commands one step later; surfaces at their stops hold the integrals."""
    state, rates, v = before.state, commands.rates, memory
    L, phi = settings.L, settings.phi
    free = commands.status == 0
    now = Rates(
        select(free, twisted(state.P - rates.P, v.P, L, phi), v.P),
        select(free, twisted(state.Q - rates.Q, v.Q, L, phi), v.Q),
        select(free, twisted(state.R - rates.R, v.R, L, phi), v.R),
    )
    return now, answer(measured.state, now, commands.surfaces, reference, settings)
