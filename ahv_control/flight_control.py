# Copyright 2026 ahv developers, Apache-2.0
"""The loops composed, as the graph composes its nodes (Fig. 3.1)."""

from typing import NamedTuple

from ahv_control.disturbance_learner import (
    LearnerSettings,
    LearnerState,
    disturbance_estimate,
    learner_step,
    start_learner,
)
from ahv_control.inner_loop import InnerLoop, Learned, adaptive_surfaces, nominal_surfaces
from ahv_control.intermediate_loop import IntermediateLoop, rate_command
from ahv_control.newton_raphson import nominal_response
from ahv_control.outer_loop import OuterLoop, attitude_command
from ahv_control.velocity_loop import VelocityLoop, throttle_command
from ahv_plant.model.vectors import Attitude, Rates, State, Surfaces
from ahv_plant.numerics.elementwise import elementwise

# The search for the first command starts here; later ones start at the command before.
NEUTRAL = Surfaces(0.0, 0.0, 0.0)


class FlightControl(NamedTuple):
    """Settings of all loops; without a learner the inner loop is nominal."""

    outer: OuterLoop
    intermediate: IntermediateLoop
    inner: InnerLoop
    velocity: VelocityLoop
    learner: LearnerSettings | None


class Commands(NamedTuple):
    """What the flight control answers to one state."""

    attitude: Attitude  # phi*, theta*, psi*
    rates: Rates  # P*, Q*, R*
    surfaces: Surfaces
    throttle: float  # [-] sigma_T
    status: int  # SolverStatus of the inner loop


@elementwise
def nominal_control(state: State, previous: Surfaces, settings: FlightControl) -> Commands:
    """All commands for `state` without a learner; `previous` surfaces were commanded before."""
    attitude = attitude_command(state, settings.outer)
    rates = rate_command(state, attitude, settings.intermediate)
    solution = nominal_surfaces(state, rates, previous, settings.inner)
    throttle = throttle_command(state, solution.surfaces, settings.velocity)
    return Commands(attitude, rates, solution.surfaces, throttle, solution.status)


@elementwise
def adaptive_control(
    state: State, learner: LearnerState, previous: Surfaces, settings: FlightControl
) -> Commands:
    """All commands for `state` with what was learned up to it."""
    attitude = attitude_command(state, settings.outer)
    rates = rate_command(state, attitude, settings.intermediate)
    estimate = disturbance_estimate(learner, Rates(state.P, state.Q, state.R))
    learned = Learned(learner.X_a, learner.X_d, estimate)
    solution = adaptive_surfaces(state, rates, learned, previous, settings.inner)
    throttle = throttle_command(state, solution.surfaces, settings.velocity)
    return Commands(attitude, rates, solution.surfaces, throttle, solution.status)


@elementwise
def first_learner(state: State, settings: LearnerSettings) -> LearnerState:
    """Learner for the first `state` of a flight."""
    return start_learner(Rates(state.P, state.Q, state.R), settings.first_estimate)


@elementwise
def next_learner(
    learner: LearnerState,
    before: State,
    surfaces: Surfaces,
    command: Rates,
    now: State,
    settings: LearnerSettings,
) -> LearnerState:
    """Learner at the state `now`, from the state `before` and what was commanded then."""
    return learner_step(
        learner,
        nominal_response(before, surfaces, settings.geometric),
        command,
        Rates(now.P, now.Q, now.R),
        settings,
    )


@elementwise
def next_adaptive_control(
    learner: LearnerState, before: State, answer: Commands, now: State, settings: FlightControl
) -> tuple[LearnerState, Commands]:
    """Learner and commands at the state `now`; `answer` was the one to the state `before`."""
    law: LearnerSettings = settings.learner  # type: ignore[assignment]  # it is an adaptive flight
    learned = next_learner(learner, before, answer.surfaces, answer.rates, now, law)
    return learned, adaptive_control(now, learned, answer.surfaces, settings)
