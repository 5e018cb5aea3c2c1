# Copyright 2026 ahv developers, Apache-2.0
"""A batch of runs advanced together in lanes, and one run alone: the engine of the campaigns."""

import numpy as np

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Array
from ahv_analysis.flight.case import Case
from ahv_analysis.flight.closed_loop import loop_step, start_loop
from ahv_analysis.flight.outcome import START, Outcome, next_outcome
from ahv_control.flight_control import FlightControl
from ahv_plant.dispersion import Dispersion, Truth
from ahv_plant.level_trim import LevelTrim, level_trim
from ahv_plant.model.constants import STEP_NS
from ahv_plant.model.vectors import State
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.numerics.simd import LANES, load, store, widen
from ahv_plant.termination import termination

# What the rows of the arrays are: load() reads the shape of its result from these.
LIKE = (State(*[0.0] * len(State._fields)), Dispersion())


@kernel
def run_outcome(state, truth, control, steps):
    """Outcome of a flight; the numbers may be lanes."""
    one, altitude = state.u, control.outer.altitude
    loop, outcome = widen(start_loop(state, control, None, None), one), widen(START, one)
    for number in range(steps):
        outcome = next_outcome(outcome, loop, altitude, truth.geometric)
        loop = widen(loop_step(loop, number, truth, control, None, None), one)
    return next_outcome(outcome, loop, altitude, truth.geometric)


@kernel
def batch_outcomes(states, dispersions, like, truth, control, steps, result):
    """Fly a batch of runs: states (13, LANES) and dispersions (9, LANES) to result."""
    dispersion = load(like[1], dispersions)
    truth = Truth(truth.geometric, dispersion, truth.disturbance, truth.further, truth.wind)
    store(result, run_outcome(load(like[0], states), truth, control, steps))


@kernel
def trim_batch(dispersions, like, altitude, speed, mass, calm, result):
    """Level trims of a batch of vehicles: dispersions (9, LANES) to result (4, LANES)."""
    truth = Truth(calm.geometric, load(like[1], dispersions), None, calm.further, None)
    store(result, level_trim(altitude, speed, mass, truth))


@kernel
def run_trajectory(state, truth, control, steps, every, states, commands):
    """Fly one run; keep every so many states (13) and commands (10)."""
    loop = start_loop(state, control, None, None)
    for number in range(steps + 1):
        if number % every == 0:
            _keep(number // every, loop.plant.state, loop.commands, states, commands)
        if termination(loop.plant.state, truth.geometric) != 0:
            return number
        loop = loop_step(loop, number, truth, control, None, None)
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
    start, control = case.plant.initial, case.control
    flown = run_trajectory(start, truth, control, steps, every, states, commands)
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

    All else that is true is that of `truth`.
    """
    outcomes = np.empty((len(Outcome._fields), LANES))
    rows = []
    for first in range(0, len(states), LANES):
        batch_outcomes(
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
    dispersions: Array, altitude: float, speed: float, mass: float, calm: Truth
) -> Array:
    """Level trims (N, 4) of vehicles with `dispersions` (N, 9), fields of `LevelTrim`.

    Further dispersions and kind of altitude are those of `calm`.
    """
    trims = np.empty((len(LevelTrim._fields), LANES))
    rows = []
    for first in range(0, len(dispersions), LANES):
        vehicles = _lanes(dispersions, first)
        trim_batch(vehicles, LIKE, altitude, speed, mass, calm, trims)
        rows.append(trims.T.copy())
    return np.concatenate(rows)[: len(dispersions)]


def fly_alone(state: State, truth: Truth, control: FlightControl, steps: int) -> Outcome:
    """Outcome of one run by scalar code: the same bits as in a lane."""
    return Outcome(*run_outcome(state, truth, control, steps))


def _lanes(rows: Array, first: int) -> Array:
    """Transpose of LANES rows from `first` on; missing ones repeat the last."""
    index = np.minimum(np.arange(first, first + LANES), len(rows) - 1)
    return np.ascontiguousarray(rows[index].T)
