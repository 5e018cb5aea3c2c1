# Copyright 2026 ahv developers, Apache-2.0
"""Inner loop: from body-rate command to the control surfaces (section 3.3, chapters 4 and 5)."""

from typing import NamedTuple

from ahv_control.error_dynamics import ErrorDynamics, error_decay
from ahv_control.newton_raphson import Solution, solve_surfaces
from ahv_plant.model.vectors import Rates, State, Surfaces
from ahv_plant.numerics.elementwise import elementwise


class InnerLoop(NamedTuple):
    """Settings of the inner loop."""

    tracking: ErrorDynamics  # of the rates to their command, section 3.3 and eq 5.11
    following: ErrorDynamics  # of the approximate to the desired plant, eqs 4.4 and 5.14
    k_ap: Rates  # [1/s] observer gain, eq 4.3
    geometric: bool  # h is a geometric altitude


class Learned(NamedTuple):
    """What the disturbance learner tells the inner loop."""

    X_a: Rates  # [rad/s] approximate plant
    X_d: Rates  # [rad/s] desired plant
    estimate: Rates  # [rad/s^2] d-hat


@elementwise
def nominal_demand(state: State, command: Rates, settings: InnerLoop) -> Rates:
    """Angular acceleration [rad/s^2] under which the rates approach the command, section 3.3."""
    return error_decay(Rates(state.P, state.Q, state.R), command, settings.tracking)


@elementwise
def adaptive_demand(state: State, command: Rates, learned: Learned, settings: InnerLoop) -> Rates:
    """Nominal f(X, U) [rad/s^2] under which X_a follows X_d, eqs 4.4-4.5 and 5.14-5.15.

    X_d moves as the nominal plant under the nominal law, X_d_dot = f(X_d, U_d). The approximate
    plant moves at f(X, U) + d-hat + k_ap (X - X_a); setting that to X_d_dot plus the decay of
    X_a - X_d gives f(X, U).
    """
    X_a, X_d, k_ap, d = learned.X_a, learned.X_d, settings.k_ap, learned.estimate
    desired = error_decay(X_d, command, settings.tracking)
    follow = error_decay(X_a, X_d, settings.following)
    return Rates(
        desired.P + follow.P - d.P - k_ap.P * (state.P - X_a.P),
        desired.Q + follow.Q - d.Q - k_ap.Q * (state.Q - X_a.Q),
        desired.R + follow.R - d.R - k_ap.R * (state.R - X_a.R),
    )


@elementwise
def nominal_surfaces(
    state: State, command: Rates, previous: Surfaces, settings: InnerLoop
) -> Solution:
    """Surfaces [rad] of the nominal law; the search starts at the `previous` ones."""
    demand = nominal_demand(state, command, settings)
    return solve_surfaces(state, demand, previous, settings.geometric)


@elementwise
def adaptive_surfaces(
    state: State, command: Rates, learned: Learned, previous: Surfaces, settings: InnerLoop
) -> Solution:
    """Surfaces [rad] of the adaptive law; the search starts at the `previous` ones."""
    demand = adaptive_demand(state, command, learned, settings)
    return solve_surfaces(state, demand, previous, settings.geometric)
