# Copyright 2026 ahv developers, Apache-2.0
"""The loops composed, as the graph composes its nodes (Fig. 3.1)."""

from typing import NamedTuple

from ahv_control.disturbance_learner import (
    LearnerSettings,
    LearnerState,
    disturbance_estimate,
    learner_step,
    start_learner,
    with_servos,
)
from ahv_control.guidance import Guidance
from ahv_control.inner_loop import InnerLoop, Learned, adaptive_demand, nominal_demand
from ahv_control.intermediate_loop import IntermediateLoop, rate_command
from ahv_control.law import Commands
from ahv_control.newton_raphson import nominal_response, solve_surfaces
from ahv_control.outer_loop import (
    Integral,
    OuterLoop,
    attitude_command,
    first_integral,
    next_integral,
)
from ahv_control.reference import Reference, held
from ahv_control.servo_model import (
    ServoModel,
    modelled_surfaces,
    next_model,
    resting_model,
)
from ahv_control.velocity_loop import VelocityLoop, throttle_command
from ahv_plant.model.vectors import Measurement, Rates, State, Surfaces
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.optional import changed_by, optional

# The search for the first command starts here; later ones start at the command before.
NEUTRAL = Surfaces(0.0, 0.0, 0.0)


class FlightControl(NamedTuple):
    """Settings of all loops; without a learner the inner loop is nominal.

    The guidance is before the law, which is told its reference: without one the outer and the
    velocity loop hold their own altitude and speed.
    """

    outer: OuterLoop
    intermediate: IntermediateLoop
    inner: InnerLoop
    velocity: VelocityLoop
    learner: LearnerSettings | None
    guidance: Guidance | None = None

    @property
    def altitude(self) -> float:
        """Altitude [m] that is held without guidance."""
        return self.outer.altitude

    @property
    def speed(self) -> float:
        """Speed u [m/s] that is held without guidance, eq 3.2."""
        return self.velocity.speed


class Memory(NamedTuple):
    """What the loops keep from step to step; None is what a law does without."""

    learner: LearnerState | None
    integral: Integral | None  # of the altitude


def _told(settings: FlightControl, reference: Reference) -> Reference:
    return reference


def _own(settings: FlightControl) -> Reference:
    return held(settings.outer.altitude, settings.velocity.speed)


# followed(settings, reference): the reference, or where it is None what the loops hold
followed = optional(_told, otherwise=_own)


@elementwise
def start(
    measured: Measurement, reference: Reference | None, settings: FlightControl
) -> tuple[Memory, Commands]:
    """Memory and commands at the first measurement of a flight."""
    state = measured.state
    memory = Memory(
        first_learner(state, settings.learner), first_integral(state, settings.outer.integral)
    )
    return memory, answer(state, reference, memory, NEUTRAL, settings)


@elementwise
def step(
    memory: Memory,
    before: Measurement,
    commands: Commands,
    measured: Measurement,
    reference: Reference | None,
    settings: FlightControl,
) -> tuple[Memory, Commands]:
    """Memory and commands at a measurement; `commands` answered the one `before`."""
    learner = next_learner(
        memory.learner, before.state, commands.surfaces, commands.rates, measured, settings.learner
    )
    wanted = followed(settings, reference)
    outer = settings.outer
    integral = next_integral(memory.integral, measured.state, wanted, outer, outer.integral)
    later = Memory(learner, integral)
    return later, answer(measured.state, reference, later, commands.surfaces, settings)


def _learned_demand(state: State, rates: Rates, inner: InnerLoop, learner: LearnerState) -> Rates:
    estimate = disturbance_estimate(learner, Rates(state.P, state.Q, state.R))
    learned = Learned(learner.X_a, learner.X_d, estimate)
    demand: Rates = adaptive_demand(state, rates, learned, inner)
    return demand


_demand = optional(_learned_demand, otherwise=nominal_demand)


@elementwise
def answer(
    state: State,
    reference: Reference | None,
    memory: Memory,
    previous: Surfaces,
    settings: FlightControl,
) -> Commands:
    """All commands for `state` with the memory of what was before it.

    The `previous` surfaces [rad] were commanded before.
    """
    wanted = followed(settings, reference)
    attitude = attitude_command(state, wanted, memory.integral, settings.outer)
    rates = rate_command(state, attitude, wanted.psi_rate, settings.intermediate)
    demand = _demand(state, rates, settings.inner, memory.learner)
    surfaces, status = solve_surfaces(state, demand, previous, settings.inner.geometric)
    throttle = throttle_command(state, surfaces, wanted, settings.velocity)
    return Commands(attitude, rates, surfaces, throttle, status)


@optional
def first_learner(state: State, settings: LearnerSettings) -> LearnerState:
    """Learner for the first `state` of a flight; None without `settings`.

    Its model of the servos, if it has one, starts at rest where the nominal vehicle is in balance.
    """
    start = start_learner(Rates(state.P, state.Q, state.R), settings.first_estimate)
    learner: LearnerState = _in_balance(start, state, settings.geometric, settings.servo_model)
    return learner


@changed_by
def _in_balance(
    learner: LearnerState, state: State, geometric: bool, model: ServoModel
) -> LearnerState:
    surfaces, _ = solve_surfaces(state, Rates(0.0, 0.0, 0.0), NEUTRAL, geometric)
    return with_servos(learner, resting_model(surfaces, model))


@optional
def next_learner(
    learner: LearnerState,
    before: State,
    surfaces: Surfaces,
    command: Rates,
    now: Measurement,
    settings: LearnerSettings,
) -> LearnerState:
    """Learner now, from the state `before` and the surfaces and rates that were commanded then.

    The observer of eq 4.3 is told the surfaces as measured now, or where a model of the servos has
    them, instead of the commanded ones: else it would take every lag of an actuator for a
    disturbance of the vehicle. None without `settings`.
    """
    servos = next_model(learner.servos, surfaces, settings.servo_model)
    reckoned = modelled_surfaces(surfaces, servos, settings.servo_model)
    acting = Surfaces(
        select(settings.measured_surfaces, now.surfaces.right_elevon, reckoned.right_elevon),
        select(settings.measured_surfaces, now.surfaces.left_elevon, reckoned.left_elevon),
        select(settings.measured_surfaces, now.surfaces.rudder, reckoned.rudder),
    )
    return learner_step(
        with_servos(learner, servos),
        nominal_response(before, acting, settings.geometric),
        command,
        Rates(now.state.P, now.state.Q, now.state.R),
        settings,
    )
