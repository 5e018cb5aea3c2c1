# Copyright 2026 ahv developers, Apache-2.0
"""Incremental nonlinear dynamic inversion with measured surfaces.

After S. Sieberling, Q. P. Chu and J. A. Mulder, "Robust Flight Control Using Incremental Nonlinear
Dynamic Inversion and Angular Acceleration Prediction", Journal of Guidance, Control, and Dynamics
33(6), 2010; with surfaces and rates behind the same filter, so that they belong together, after
E. J. J. Smeur, Q. Chu and G. C. H. E. de Croon, "Adaptive Incremental Nonlinear Dynamic Inversion
for Attitude Control of Micro Air Vehicles", the same journal, 39(3), 2016.

What moves the vehicle is not computed but measured: the angular acceleration by the difference of
the rates, the surfaces that go with it by their transducers. The nominal vehicle says only what a
change of the surfaces changes, by one Newton-Raphson step from where they are.
"""

from typing import NamedTuple

from ahv_control.law import Commands
from ahv_control.laws._loops import Loops, answered, commanded, loops_of
from ahv_control.newton_raphson import (
    Iterate,
    Solution,
    angular_response,
    flight_condition,
    newton_step,
    solve_surfaces,
)
from ahv_control.reference import Reference
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import Measurement, Rates, State, Surfaces, limit_surfaces
from ahv_plant.numerics.elementary import exp_small
from ahv_plant.numerics.elementwise import elementwise, select


class Settings(NamedTuple):
    """Settings of the law."""

    omega_f: float = 7.0  # [rad/s] bandwidth of the filter of rates and surfaces
    k_P: float = 2.0  # [1/s] gain of the roll rate
    k_Q: float = 8.0  # [1/s] gain of the pitch rate
    k_R: float = 2.0  # [1/s] gain of the yaw rate
    k_h: float = 0.01  # [1/s] altitude gain, eq 3.1
    k_attitude: float = 0.1  # [1/s] gain of the three attitude angles
    k_u: float = 0.1  # [1/s] speed gain, eq 3.2
    alpha_limit: float = 180.0  # [deg] angle of attack that commands stay within; 180 is off
    geometric_altitude: bool = False  # h is a geometric altitude, not a geopotential one


class Design(NamedTuple):
    """What is flown with."""

    share: float  # [-] of what is new that passes the filter in a step
    gain: Rates  # [1/s]
    geometric: bool
    loops: Loops


class Filtered(NamedTuple):
    """Memory of the law."""

    rates: Rates  # [rad/s]
    surfaces: Surfaces  # [rad]


def design(settings: Settings) -> Design:
    """Return what is flown with: the filter's bandwidth [rad/s] as its share [-] in one step."""
    return Design(
        1.0 - exp_small(-settings.omega_f * STEP),
        Rates(settings.k_P, settings.k_Q, settings.k_R),
        settings.geometric_altitude,
        loops_of(settings),
    )


@elementwise
def wanted(state: State, rates: Rates, gain: Rates) -> Rates:
    """Angular acceleration [rad/s^2] under which the rates [rad/s] approach what is commanded."""
    return Rates(
        gain.P * (rates.P - state.P), gain.Q * (rates.Q - state.Q), gain.R * (rates.R - state.R)
    )


@elementwise
def increment(
    state: State, demand: Rates, acceleration: Rates, at: Surfaces, geometric: bool
) -> Solution:
    """Surfaces [rad] that change an `acceleration` to the one in `demand` [rad/s^2].

    The acceleration is that under the surfaces `at` [rad]. Of the nominal model only the slopes
    have a part in it: its own acceleration cancels out.
    """
    condition = flight_condition(state, geometric)
    model, _, _, _ = angular_response(condition, at)
    shifted = Rates(
        model.P + demand.P - acceleration.P,
        model.Q + demand.Q - acceleration.Q,
        model.R + demand.R - acceleration.R,
    )
    found = newton_step(condition, shifted, Iterate(at, 0.0, True))
    held = limit_surfaces(found.surfaces)
    free = (
        (held.right_elevon == found.surfaces.right_elevon)
        & (held.left_elevon == found.surfaces.left_elevon)
        & (held.rudder == found.surfaces.rudder)
    )
    # SolverStatus as plain numbers: singular 3, saturated 1, converged 0
    return Solution(held, select(found.regular, select(free, 0, 1), 3))


@elementwise
def start(
    measured: Measurement, reference: Reference, settings: Design
) -> tuple[Filtered, Commands]:
    """At the first state nothing is known of any acceleration: plain inversion, section 3.3."""
    state, neutral = measured.state, Surfaces(0.0, 0.0, 0.0)
    attitude, rates = commanded(state, reference, settings.loops)
    solution = solve_surfaces(
        state, wanted(state, rates, settings.gain), neutral, settings.geometric
    )
    memory = Filtered(Rates(state.P, state.Q, state.R), solution.surfaces)
    return memory, answered(state, attitude, rates, solution, reference, settings.loops)


@elementwise
def step(
    memory: Filtered,
    before: Measurement,
    commands: Commands,
    measured: Measurement,
    reference: Reference,
    settings: Design,
) -> tuple[Filtered, Commands]:
    """Filtered measurements and commands one step later."""
    state, acted, share = measured.state, measured.surfaces, settings.share
    old, at = memory.rates, memory.surfaces
    dP, dQ, dR = (
        share * (state.P - old.P),
        share * (state.Q - old.Q),
        share * (state.R - old.R),
    )
    surfaces = Surfaces(
        at.right_elevon + share * (acted.right_elevon - at.right_elevon),
        at.left_elevon + share * (acted.left_elevon - at.left_elevon),
        at.rudder + share * (acted.rudder - at.rudder),
    )
    attitude, rates = commanded(state, reference, settings.loops)
    acceleration = Rates(dP / STEP, dQ / STEP, dR / STEP)
    demand = wanted(state, rates, settings.gain)
    solution = increment(state, demand, acceleration, surfaces, settings.geometric)
    now = Filtered(Rates(old.P + dP, old.Q + dQ, old.R + dR), surfaces)
    return now, answered(state, attitude, rates, solution, reference, settings.loops)
