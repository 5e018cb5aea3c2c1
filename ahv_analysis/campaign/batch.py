# Copyright 2026 ahv developers, Apache-2.0
"""A batch of runs advanced together in lanes, and one run alone: the engine of the campaigns."""

import numpy as np

from ahv_analysis.bag.record import Array, FlightRecord
from ahv_analysis.flight.case import Case
from ahv_analysis.flight.outcome import START, Outcome, count_step, observer_error
from ahv_control.flight_control import (
    NEUTRAL,
    FlightControl,
    adaptive_control,
    first_learner,
    next_adaptive_control,
    nominal_control,
)
from ahv_plant.dispersion import Dispersion, Truth
from ahv_plant.level_trim import LevelTrim, level_trim
from ahv_plant.model.constants import STEP, STEP_NS
from ahv_plant.model.vectors import State
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.numerics.simd import LANES, load, store, widen
from ahv_plant.termination import termination
from ahv_plant.vehicle import vehicle_step

# What the rows of the arrays are: load() reads the shape of its result from these.
LIKE = (State(*[0.0] * len(State._fields)), Dispersion())


@kernel
def fly_adaptive(state, truth, control, steps):
    """Outcome of an adaptive flight; the numbers may be lanes."""
    one = state.u
    learner = widen(first_learner(state, control.learner), one)
    answer = widen(adaptive_control(state, learner, NEUTRAL, control), one)
    outcome = widen(START, one)
    altitude = control.outer.altitude
    for step in range(steps):
        observed = observer_error(state, learner)
        outcome = count_step(outcome, state, answer, observed, altitude, truth.geometric)
        later = vehicle_step(state, answer.surfaces, answer.throttle, step * STEP, truth)
        learner, answer = next_adaptive_control(learner, state, answer, later, control)
        answer = widen(answer, one)
        state = later
    observed = observer_error(state, learner)
    return count_step(outcome, state, answer, observed, altitude, truth.geometric)


@kernel
def fly_nominal(state, truth, control, steps):
    """Outcome of a nominal flight; the numbers may be lanes."""
    one = state.u
    answer = widen(nominal_control(state, NEUTRAL, control), one)
    outcome = widen(START, one)
    observed = widen(0.0, one)
    altitude = control.outer.altitude
    for step in range(steps):
        outcome = count_step(outcome, state, answer, observed, altitude, truth.geometric)
        state = vehicle_step(state, answer.surfaces, answer.throttle, step * STEP, truth)
        answer = widen(nominal_control(state, answer.surfaces, control), one)
    return count_step(outcome, state, answer, observed, altitude, truth.geometric)


@kernel
def adaptive_batch(states, dispersions, like, truth, control, steps, result):
    """Fly a batch of adaptive runs: states (13, LANES) and dispersions (9, LANES) to result."""
    truth = Truth(truth.geometric, load(like[1], dispersions), truth.disturbance)
    store(result, fly_adaptive(load(like[0], states), truth, control, steps))


@kernel
def nominal_batch(states, dispersions, like, truth, control, steps, result):
    """Fly a batch of nominal runs: states (13, LANES) and dispersions (9, LANES) to result."""
    truth = Truth(truth.geometric, load(like[1], dispersions), truth.disturbance)
    store(result, fly_nominal(load(like[0], states), truth, control, steps))


@kernel
def trim_batch(dispersions, like, altitude, speed, mass, geometric, result):
    """Level trims of a batch of vehicles: dispersions (9, LANES) to result (4, LANES)."""
    truth = Truth(geometric, load(like[1], dispersions), None)
    store(result, level_trim(altitude, speed, mass, truth))


@kernel
def adaptive_trajectory(state, truth, control, steps, every, states, commands):
    """Fly one adaptive run; keep every so many states (13) and commands (10)."""
    learner = first_learner(state, control.learner)
    answer = adaptive_control(state, learner, NEUTRAL, control)
    for step in range(steps + 1):
        if step % every == 0:
            _keep(step // every, state, answer, states, commands)
        if termination(state, truth.geometric) != 0:
            return step
        later = vehicle_step(state, answer.surfaces, answer.throttle, step * STEP, truth)
        learner, answer = next_adaptive_control(learner, state, answer, later, control)
        state = later
    return steps


@kernel
def nominal_trajectory(state, truth, control, steps, every, states, commands):
    """Fly one nominal run; keep every so many states (13) and commands (10)."""
    answer = nominal_control(state, NEUTRAL, control)
    for step in range(steps + 1):
        if step % every == 0:
            _keep(step // every, state, answer, states, commands)
        if termination(state, truth.geometric) != 0:
            return step
        state = vehicle_step(state, answer.surfaces, answer.throttle, step * STEP, truth)
        answer = nominal_control(state, answer.surfaces, control)
    return steps


@kernel
def _keep(row, state, answer, states, commands):
    for i, value in enumerate(state):
        states[row, i] = value
    for i in range(3):
        commands[row, i] = answer.attitude[i]
        commands[row, 3 + i] = answer.rates[i]
        commands[row, 6 + i] = answer.surfaces[i]
    commands[row, 9] = answer.throttle


def fly_trajectory(case: Case, every: int) -> FlightRecord:
    """Fly a case alone and keep every so many of its steps, to be drawn."""
    steps, truth = case.plant.steps, case.plant.truth
    states = np.empty((steps // every + 1, len(State._fields)))
    commands = np.empty((steps // every + 1, 10))
    fly = nominal_trajectory if case.control.learner is None else adaptive_trajectory
    flown = fly(case.plant.initial, truth, case.control, steps, every, states, commands)
    kept = slice(flown // every + 1)
    return FlightRecord(
        np.arange(steps // every + 1)[kept] * (every * STEP_NS),
        states[kept],
        commands[kept, 0:3],
        commands[kept, 3:6],
        commands[kept, 6:9],
        commands[kept, 9],
        truth.geometric,
    )


def fly_batch(
    states: Array, dispersions: Array, truth: Truth, control: FlightControl, steps: int
) -> Array:
    """Outcomes (N, 14) of N runs from `states` (N, 13) on vehicles with `dispersions` (N, 9).

    Disturbance and kind of altitude are those of `truth`.
    """
    fly = nominal_batch if control.learner is None else adaptive_batch
    outcomes = np.empty((len(Outcome._fields), LANES))
    rows = []
    for first in range(0, len(states), LANES):
        fly(
            _lanes(states, first),
            _lanes(dispersions, first),
            LIKE,
            truth,
            control,
            steps,
            outcomes,
        )
        rows.append(outcomes.T.copy())
    return np.concatenate(rows)[: len(states)]


def find_trims(
    dispersions: Array, altitude: float, speed: float, mass: float, geometric: bool
) -> Array:
    """Level trims (N, 4) of vehicles with `dispersions` (N, 9), fields of `LevelTrim`."""
    trims = np.empty((len(LevelTrim._fields), LANES))
    rows = []
    for first in range(0, len(dispersions), LANES):
        vehicles = _lanes(dispersions, first)
        trim_batch(vehicles, LIKE, altitude, speed, mass, geometric, trims)
        rows.append(trims.T.copy())
    return np.concatenate(rows)[: len(dispersions)]


def fly_alone(state: State, truth: Truth, control: FlightControl, steps: int) -> Outcome:
    """Outcome of one run by scalar code: the same bits as in a lane."""
    fly = fly_nominal if control.learner is None else fly_adaptive
    return Outcome(*fly(state, truth, control, steps))


def _lanes(rows: Array, first: int) -> Array:
    """Transpose of LANES rows from `first` on; missing ones repeat the last."""
    index = np.minimum(np.arange(first, first + LANES), len(rows) - 1)
    return np.ascontiguousarray(rows[index].T)
