# Copyright 2026 ahv developers, Apache-2.0
"""Active disturbance rejection: an extended state observer beside the nominal inversion.

After J. Han, "From PID to Active Disturbance Rejection Control", IEEE Transactions on Industrial
Electronics 56(3), 2009; with the bandwidth as the observer's one setting as Z. Gao, "Scaling and
Bandwidth-Parameterization Based Controller Tuning", American Control Conference, 2003; in discrete
time after R. Miklosovic, A. Radke and Z. Gao, "Discrete Implementation and Generalization of the
Extended State Observer", American Control Conference, 2006.

Each rate x of P, Q, R is taken for x_dot = f(X, U) + d with the nominal f of eq 2.3 and a
disturbance d that may be anything but fast. The observer has both its poles at omega_o; what it
finds is taken off what the report's loops ask of the nominal vehicle.
"""

from typing import NamedTuple

from ahv_control.law import Commands
from ahv_control.laws._loops import Loops, answered, commanded, loops_of
from ahv_control.newton_raphson import nominal_response, solve_surfaces
from ahv_control.reference import Reference
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import Measurement, Rates, State, Surfaces
from ahv_plant.numerics.elementary import exp_small
from ahv_plant.numerics.elementwise import elementwise


class Settings(NamedTuple):
    """Settings of the law."""

    omega_o: float = 25.0  # [rad/s] bandwidth of the observer, both of its poles
    k_P: float = 2.0  # [1/s] gain of the roll rate
    k_Q: float = 7.0  # [1/s] gain of the pitch rate
    k_R: float = 2.0  # [1/s] gain of the yaw rate
    k_h: float = 0.01  # [1/s] altitude gain, eq 3.1
    k_attitude: float = 0.1  # [1/s] gain of the three attitude angles
    k_u: float = 0.1  # [1/s] speed gain, eq 3.2
    alpha_limit: float = 180.0  # [deg] angle of attack that commands stay within; 180 is off
    geometric_altitude: bool = False  # h is a geometric altitude, not a geopotential one


class Design(NamedTuple):
    """What is flown with."""

    pole: float  # [-] of the observer, both of them
    gain: Rates  # [1/s]
    geometric: bool
    loops: Loops


class Observer(NamedTuple):
    """Memory of the law."""

    rates: Rates  # [rad/s] estimated
    disturbance: Rates  # [rad/s^2] estimated


def design(settings: Settings) -> Design:
    """Return what is flown with: the observer's bandwidth [rad/s] as a pole [-] of one step."""
    return Design(
        exp_small(-settings.omega_o * STEP),
        Rates(settings.k_P, settings.k_Q, settings.k_R),
        settings.geometric_altitude,
        loops_of(settings),
    )


@elementwise
def observed(
    x: float, d: float, acceleration: float, now: float, pole: float
) -> tuple[float, float]:
    """Estimates of one channel a step later: its rate [rad/s] and its disturbance [rad/s^2].

    The model predicts, from `x`, `d` and its `acceleration` [rad/s^2]; what is measured `now`
    corrects, with the gains that put both poles [-] of the error where they are wanted.
    """
    predicted = x + STEP * (acceleration + d)
    error = now - predicted
    slow = 1.0 - pole
    return predicted + (1.0 - pole * pole) * error, d + slow * slow / STEP * error


@elementwise
def answer(
    state: State,
    observer: Observer,
    previous: Surfaces,
    reference: Reference,
    settings: Design,
) -> Commands:
    """Commands with what was observed; the search for surfaces begins at the `previous` [rad]."""
    attitude, rates = commanded(state, reference, settings.loops)
    k, d = settings.gain, observer.disturbance
    demand = Rates(
        k.P * (rates.P - state.P) - d.P,
        k.Q * (rates.Q - state.Q) - d.Q,
        k.R * (rates.R - state.R) - d.R,
    )
    solution = solve_surfaces(state, demand, previous, settings.geometric)
    return answered(state, attitude, rates, solution, reference, settings.loops)


@elementwise
def start(
    measured: Measurement, reference: Reference, settings: Design
) -> tuple[Observer, Commands]:
    """Observer that has seen the first rates only, and the commands to them."""
    state = measured.state
    observer = Observer(Rates(state.P, state.Q, state.R), Rates(0.0, 0.0, 0.0))
    neutral = Surfaces(0.0, 0.0, 0.0)
    return observer, answer(state, observer, neutral, reference, settings)


@elementwise
def step(
    memory: Observer,
    before: Measurement,
    commands: Commands,
    measured: Measurement,
    reference: Reference,
    settings: Design,
) -> tuple[Observer, Commands]:
    """Observer and commands one step later; surfaces act where they are measured [rad]."""
    model = nominal_response(before.state, measured.surfaces, settings.geometric)
    state, x, d, pole = measured.state, memory.rates, memory.disturbance, settings.pole
    x_P, d_P = observed(x.P, d.P, model.P, state.P, pole)
    x_Q, d_Q = observed(x.Q, d.Q, model.Q, state.Q, pole)
    x_R, d_R = observed(x.R, d.R, model.R, state.R, pole)
    observer = Observer(Rates(x_P, x_Q, x_R), Rates(d_P, d_Q, d_R))
    return observer, answer(state, observer, commands.surfaces, reference, settings)
