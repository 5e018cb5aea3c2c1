# Copyright 2026 ahv developers, Apache-2.0
"""What a flight of a campaign comes to, kept up step by step: verdict, cause, extremes.

Element-wise, so that a run counts the same alone and in a lane.
"""

from collections.abc import Callable
from enum import IntEnum
from functools import partial
from math import sqrt
from typing import NamedTuple

from ahv_analysis.flight.closed_loop import Loop
from ahv_control.disturbance_learner import LearnerState
from ahv_control.flight_control import FlightControl, Memory
from ahv_control.own_law import Control, OwnLaw, followed, is_compiled
from ahv_control.reference import Reference
from ahv_plant.dispersion import Truth
from ahv_plant.hardware.wind import through_air
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import STEP, UNSTART_ALPHA
from ahv_plant.model.vectors import State
from ahv_plant.numerics.by_type import by_type
from ahv_plant.numerics.elementary import atan2, atan_ratio
from ahv_plant.numerics.elementwise import elementwise, kernel, select
from ahv_plant.numerics.optional import optional
from ahv_plant.termination import termination


class Cause(IntEnum):
    """Why a run failed; the first that happened, and of several at once the first listed."""

    SUCCESS = 0
    STATE_IS_NOT_FINITE = 1
    LEFT_THE_ATMOSPHERE_MODEL = 2
    SURFACES_LOST_THE_VEHICLE = 3  # the Newton step met a singular Jacobian
    INLET_UNSTART = 4  # |alpha| > 5 deg
    LEFT_THE_MASS_MODEL = 5  # the fuel is burnt
    LAW_FAILED = 6  # it raised, or answered what is no number
    LEFT_THE_CORRIDOR = 7  # for longer than it may, where a campaign has one


class Corridor(NamedTuple):
    """What a run must keep to beside |alpha| <= 5 deg: how far it may be from its reference."""

    altitude: float  # [m]
    speed: float  # [m/s]
    longest: float  # [s] that it may be outside without a break: steps of h* take minutes


class Outcome(NamedTuple):
    """What one run came to, up to its failure; angles in rad, in the order of a batch's rows."""

    cause: float  # a Cause
    steps: float  # flown before the failure
    max_abs_alpha: float
    max_abs_beta: float
    max_abs_rate: float  # [rad/s] of P, Q, R
    max_abs_phi: float
    min_surface: float
    max_surface: float
    min_throttle: float
    max_throttle: float
    max_altitude_error: float  # [m]
    max_observer_error: float  # [rad/s] largest |X - X_a|; zero without a learner
    final_altitude: float  # [m] last before the failure
    final_speed: float  # [m/s]
    squared_altitude_error: float  # [m^2] sum over the steps
    squared_speed_error: float  # [m^2/s^2] sum over the steps
    max_speed_error: float  # [m/s]
    max_heading_error: float  # [rad]
    final_altitude_error: float  # [m] altitude less h*
    final_mass: float  # [kg]
    least_mach: float  # [-]
    outside: float  # steps outside the corridor; zero without one
    outside_now: float  # steps without a break up to now


START = Outcome(
    *(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 9.0, -9.0, 9.0, -9.0, 0.0, 0.0, 0.0, 0.0),
    *(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 99.0, 0.0, 0.0),
)


@elementwise
def _of_learner(state: State, learner: LearnerState | None) -> float:
    if learner is None:
        return select(state.P == state.P, 0.0, 0.0)  # as wide as P
    X_a = learner.X_a
    return max(abs(state.P - X_a.P), abs(state.Q - X_a.Q), abs(state.R - X_a.R))


@elementwise
def _of_loops(state: State, memory: Memory, control: FlightControl) -> float:
    return _of_learner(state, memory.learner)


@elementwise
def _of_none(state: State, memory: object, control: OwnLaw) -> float:
    return select(state.P == state.P, 0.0, 0.0)


def _observer_of(kind: type) -> Callable[..., float]:
    return _of_none if issubclass(kind, OwnLaw) else _of_loops


# observer_error(state, memory, control): largest |X - X_a| [rad/s] of the three channels at a
# state as it was told to the learner; zero without one
observer_error = by_type(_observer_of)


@elementwise
def cause_now(state: State, moving: State, status: int, geometric: bool) -> float:
    """Cause for which a flight fails at a state whose surfaces were found with `status`.

    `moving` has the velocity against the air: the inlet knows no other.
    """
    left = termination(state, geometric)
    unstart = select(abs(atan2(moving.w, moving.u)) > UNSTART_ALPHA, 4.0, 0.0)
    lost = select(status == 3, 3.0, unstart)
    spent = select(left == 3, 5.0, lost)
    outside = select(left == 2, 2.0, spent)
    return select(left == 1, 1.0, outside)


@elementwise
def _cause_of_own(cause: float, status: int, control: OwnLaw) -> float:
    return select((cause == 0.0) & (status == 4), 6.0, cause)


@elementwise
def _cause_of_loops(cause: float, status: int, control: FlightControl) -> float:
    return cause


def _with_law_of(kind: type) -> Callable[..., float]:
    return _cause_of_own if issubclass(kind, OwnLaw) else _cause_of_loops


# _with_law(cause, status, control): the same, if there is none so far that of a law of one's own
_with_law = by_type(_with_law_of)


@kernel
def first_cause(states, lost, failed, geometric):
    """Cause at the first of `states` (n, 13) that has one.

    The surfaces are lost at the place `lost`, and the law has no answer at `failed`.

    States alone do not tell the wind: in wind, the angle of attack is that over the ground.
    """
    for step in range(len(states)):
        s = states[step]
        state = State(
            s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11], s[12]
        )
        cause = cause_now(state, state, 3 if step == lost else 0, geometric)
        if cause != 0.0:
            return cause
        if step == failed:
            return 6.0
    return 0.0


def _never(state: State, reference: Reference) -> float:
    return 0.0


@partial(optional, otherwise=_never)
def outside_now(state: State, reference: Reference, corridor: Corridor) -> float:
    """1 where a state is outside its corridor [-], else 0; 0 without one."""
    high = abs(state.h - reference.altitude) > corridor.altitude
    fast = abs(state.u - reference.speed) > corridor.speed
    return select(high | fast, 1.0, 0.0)


def _any_time(steps: float) -> bool:
    return False


@partial(optional, otherwise=_any_time)
def _too_long(steps: float, corridor: Corridor) -> bool:
    return steps * STEP > corridor.longest


@elementwise
def next_outcome(
    outcome: Outcome,
    loop: Loop,
    number: int,
    control: Control,
    truth: Truth,
    corridor: Corridor | None,
) -> Outcome:
    """Outcome after one more state and its answer; once a run has failed nothing changes.

    `number` counts the steps flown before. Angles are those against the air; the altitude error
    [m] is that to the reference of `control`. Without a `corridor` no error of it is a failure.
    """
    state, answer = loop.plant.state, loop.commands
    wanted = followed(loop.reference, control)
    observed = observer_error(loop.plant.measured.state, loop.memory, control)
    moving = through_air(state, number * STEP, loop.plant.turbulence, truth.wind)
    alpha = abs(atan2(moving.w, moving.u))
    v = abs(moving.v)
    beta = atan_ratio(v, abs(moving.u))  # close to asin(v / V_t), and never more
    flying = outcome.cause == 0.0
    outside = outside_now(state, wanted, corridor)
    so_long = (outcome.outside_now + outside) * outside
    left = select(_too_long(so_long, corridor), 7.0, 0.0)
    found = _with_law(
        cause_now(state, moving, answer.status, truth.geometric), answer.status, control
    )
    cause = select(flying, select(found == 0.0, left, found), outcome.cause)
    counts = cause == 0.0
    high, fast = state.h - wanted.altitude, state.u - wanted.speed
    turned = abs(state.psi - wanted.psi)
    against_air = moving.u * moving.u + moving.v * moving.v + moving.w * moving.w
    mach = sqrt(against_air) / atmosphere(state.h, truth.geometric).sound_speed
    surfaces = answer.surfaces
    least = -max(-surfaces.right_elevon, -surfaces.left_elevon, -surfaces.rudder)
    most = max(surfaces.right_elevon, surfaces.left_elevon, surfaces.rudder)
    rate = max(abs(state.P), abs(state.Q), abs(state.R))
    return Outcome(
        cause,
        outcome.steps + select(counts, 1.0, 0.0),
        # the failing state still counts for alpha, so that the margin tells of it
        select(flying, max(outcome.max_abs_alpha, alpha), outcome.max_abs_alpha),
        select(counts, max(outcome.max_abs_beta, beta), outcome.max_abs_beta),
        select(counts, max(outcome.max_abs_rate, rate), outcome.max_abs_rate),
        select(counts, max(outcome.max_abs_phi, abs(state.phi)), outcome.max_abs_phi),
        select(counts, -max(-outcome.min_surface, -least), outcome.min_surface),
        select(counts, max(outcome.max_surface, most), outcome.max_surface),
        select(counts, -max(-outcome.min_throttle, -answer.throttle), outcome.min_throttle),
        select(counts, max(outcome.max_throttle, answer.throttle), outcome.max_throttle),
        select(
            counts,
            max(outcome.max_altitude_error, abs(high)),
            outcome.max_altitude_error,
        ),
        select(counts, max(outcome.max_observer_error, observed), outcome.max_observer_error),
        select(counts, state.h, outcome.final_altitude),
        select(counts, state.u, outcome.final_speed),
        outcome.squared_altitude_error + select(counts, high * high, 0.0),
        outcome.squared_speed_error + select(counts, fast * fast, 0.0),
        select(counts, max(outcome.max_speed_error, abs(fast)), outcome.max_speed_error),
        select(counts, max(outcome.max_heading_error, turned), outcome.max_heading_error),
        select(counts, high, outcome.final_altitude_error),
        select(counts, state.mass, outcome.final_mass),
        select(counts, -max(-outcome.least_mach, -mach), outcome.least_mach),
        # the step that is too much still counts, so that the time outside tells of it
        outcome.outside + select(flying, outside, 0.0),
        select(flying, so_long, outcome.outside_now),
    )


def outcome_after(
    outcome: Outcome,
    loop: Loop,
    number: int,
    control: Control,
    truth: Truth,
    corridor: Corridor | None,
) -> Outcome:
    """`next_outcome` of any law: one in plain Python may remember what is not compiled."""
    if not is_compiled(control) and isinstance(control, OwnLaw):
        told = OwnLaw(None, control.altitude, control.speed, control.guidance)
        return next_outcome(outcome, loop._replace(memory=None), number, told, truth, corridor)
    return next_outcome(outcome, loop, number, control, truth, corridor)
