# Copyright 2026 ahv developers, Apache-2.0
"""A batch of runs advanced together in lanes, and one run alone: the engine of the campaigns."""

from collections.abc import Sequence

import numpy as np

from ahv_analysis.bag.record import FlightRecord, record_of
from ahv_analysis.bag.rows import Array
from ahv_analysis.flight.case import Case
from ahv_analysis.flight.closed_loop import loop_of, loop_step, start_loop
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.outcome import START, Corridor, Outcome, next_outcome, outcome_after
from ahv_control.own_law import Control, is_compiled
from ahv_plant.dispersion import Dispersion, Truth
from ahv_plant.hardware.delay import ROWS
from ahv_plant.hardware.noise import NO_DRAWS, Channel, NoiseStream, draws_of
from ahv_plant.level_trim import LevelTrim, level_trim
from ahv_plant.model.constants import STEP_NS
from ahv_plant.model.vectors import State
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.numerics.optional import optional
from ahv_plant.numerics.simd import LANES, load, store, widen
from ahv_plant.plant import DRAWN, Hardware, Rig, all_draws, noise_stream, rig
from ahv_plant.termination import termination

# What the rows of the arrays are: load() reads the shape of its result from these.
LIKE = (State(*[0.0] * len(State._fields)), Dispersion())


@kernel
def run_outcome(state, truth, control, steps, corridor):
    """Outcome of a flight; the numbers may be lanes."""
    one = state.u
    loop, outcome = widen(start_loop(state, truth, control, None, None), one), widen(START, one)
    for number in range(steps):
        outcome = next_outcome(outcome, loop, number, control, truth, corridor)
        loop = widen(loop_step(loop, number, truth, control, None, None), one)
    return next_outcome(outcome, loop, steps, control, truth, corridor)


@kernel
def batch_outcomes(states, dispersions, like, truth, control, steps, corridor, result):
    """Fly a batch of runs: states (13, LANES) and dispersions (9, LANES) to result."""
    dispersion = load(like[1], dispersions)
    truth = Truth(truth.geometric, dispersion, truth.disturbance, truth.further, truth.wind)
    store(result, run_outcome(load(like[0], states), truth, control, steps, corridor))


@kernel
def begin(state, truth, control, draws, rig):
    """Loop and outcome before a flight on hardware; the numbers may be lanes."""
    loop = start_loop(state, truth, control, draws, rig)
    return widen(loop, state.u), widen(START, state.u)


@kernel
def go_on(loop, outcome, first, block, like, truth, control, rig, corridor):
    """Loop and outcome after as many steps as there are rows of draws in a block."""
    one = loop.plant.state.u
    for row in range(len(block)):
        outcome = next_outcome(outcome, loop, first + row, control, truth, corridor)
        draws = load(like, block[row])
        loop = widen(loop_step(loop, first + row, truth, control, draws, rig), one)
    return loop, outcome


@optional
def starting_at(starts, like, rig):
    """Hardware whose actuators rest where each run has them: `starts` (4, LANES)."""
    of_all = rig.hardware
    hardware = Hardware(
        of_all.actuators, of_all.delay, of_all.jitter, of_all.sensors, load(like, starts)
    )
    return Rig(hardware, rig.line)


@kernel
def begin_batch(states, starts, like, truth, control, block, rig, kept):
    """Put loop and outcome of a batch before its flight into `kept`."""
    states, draws = load(like[0], states), load(like[1], block[0])
    store(kept, begin(states, truth, control, draws, starting_at(starts, like[2], rig)))


@kernel
def go_on_batch(kept, like, dispersions, first, block, truth, control, rig, corridor):
    """Fly a batch for a block of draws, from what was `kept` to what is."""
    truth = Truth(
        truth.geometric, load(like[0], dispersions), truth.disturbance, truth.further, truth.wind
    )
    loop, outcome = load(like[2], kept)
    loop, outcome = go_on(loop, outcome, first, block, like[1], truth, control, rig, corridor)
    store(kept, (loop, outcome))


@kernel
def end_batch(kept, like, steps, control, truth, corridor, result):
    """Outcomes of a batch at the end of its flight."""
    loop, outcome = load(like, kept)
    store(result, next_outcome(outcome, loop, steps, control, truth, corridor))


@kernel
def trim_batch(dispersions, like, altitude, speed, mass, calm, result):
    """Level trims of a batch of vehicles: dispersions (9, LANES) to result (4, LANES)."""
    truth = Truth(calm.geometric, load(like[1], dispersions), None, calm.further, None)
    store(result, level_trim(altitude, speed, mass, truth))


@kernel
def run_trajectory(state, truth, control, steps, every, states, commands):
    """Fly one run; keep every so many states (13) and commands (10)."""
    loop = start_loop(state, truth, control, None, None)
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
    if case.plant.hardware is not None or not is_compiled(case.control):
        kept = (step for step in fly(case) if step.stamp % (every * STEP_NS) == 0)
        return record_of(kept, case.plant.truth.geometric)
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
    states: Array,
    dispersions: Array,
    truth: Truth,
    control: Control,
    steps: int,
    corridor: Corridor | None = None,
) -> Array:
    """Outcomes (N, 23) of N runs from `states` (N, 13) on vehicles with `dispersions` (N, 9).

    All else that is true is that of `truth`.
    """
    outcomes = np.empty((len(Outcome._fields), LANES))
    rows = []
    for first in range(0, len(states), LANES):
        batch_outcomes(
            lanes_of(states, first),
            lanes_of(dispersions, first),
            LIKE,
            truth,
            control,
            steps,
            corridor,
            outcomes,
        )
        rows.append(outcomes.T.copy())
    return np.concatenate(rows)[: len(states)]


def fly_batch_on_hardware(
    states: Array,
    dispersions: Array,
    starts: Array,
    noise: Sequence[NoiseStream],
    truth: Truth,
    control: Control,
    hardware: Hardware,
    steps: int,
    corridor: Corridor | None = None,
) -> Array:
    """Outcomes (N, 23) as `fly_batch`, on hardware, with the draws of every run.

    The actuators rest at `starts` (N, 4), in the order of `Controls`, until they are told.
    """
    outcomes = np.empty((len(Outcome._fields), LANES))
    sample = begin(State(*states[0]), truth, control, NO_DRAWS, rig(hardware))
    kept = np.empty((_count(sample), LANES))
    like = (Dispersion(), NO_DRAWS, sample)
    block = np.zeros((DRAWN, len(Channel), LANES))
    rows = []
    for first in range(0, len(states), LANES):
        streams = noise[first : first + LANES]
        line = np.array([lanes_of(starts, first)] * ROWS)
        equipped = Rig(hardware, line)

        def drawn(count: int, streams: Sequence[NoiseStream] = streams) -> Array:
            for lane, stream in enumerate(streams):
                stream.fill(block[:count, :, lane])
            return block[:count]

        first_states, controls = lanes_of(states, first), lanes_of(starts, first)
        wanted = (LIKE[0], NO_DRAWS, hardware.start)
        begin_batch(first_states, controls, wanted, truth, control, drawn(1), equipped, kept)
        vehicles = lanes_of(dispersions, first)
        for flown in range(0, steps, DRAWN):
            draws = drawn(min(DRAWN, steps - flown))
            go_on_batch(kept, like, vehicles, flown, draws, truth, control, equipped, corridor)
        end_batch(kept, sample, steps, control, truth, corridor, outcomes)
        rows.append(outcomes.T.copy())
    return np.concatenate(rows)[: len(states)]


def _count(value: object) -> int:
    """Numbers in a nested tuple."""
    return sum(map(_count, value)) if isinstance(value, tuple) else value is not None


def find_trims(
    dispersions: Array, altitude: float, speed: float, mass: float, calm: Truth
) -> Array:
    """Level trims (N, 4) of vehicles with `dispersions` (N, 9), fields of `LevelTrim`.

    Further dispersions and kind of altitude are those of `calm`.
    """
    trims = np.empty((len(LevelTrim._fields), LANES))
    rows = []
    for first in range(0, len(dispersions), LANES):
        vehicles = lanes_of(dispersions, first)
        trim_batch(vehicles, LIKE, altitude, speed, mass, calm, trims)
        rows.append(trims.T.copy())
    return np.concatenate(rows)[: len(dispersions)]


def fly_alone(case: Case, corridor: Corridor | None = None) -> Outcome:
    """Outcome of one run by scalar code: the same bits as in a lane."""
    state, steps, truth, hardware, noise = case.plant
    if not is_compiled(case.control):
        return _fly_plain(case, corridor)
    if hardware is None:
        return Outcome(*run_outcome(state, truth, case.control, steps, corridor))
    equipped, stream = rig(hardware), noise_stream(hardware, truth.wind, *noise)
    loop, outcome = begin(state, truth, case.control, draws_of(stream.block(1)[0]), equipped)
    for flown in range(0, steps, DRAWN):
        block = stream.block(min(DRAWN, steps - flown))
        loop, outcome = go_on(
            loop, outcome, flown, block, NO_DRAWS, truth, case.control, equipped, corridor
        )
    return Outcome(*next_outcome(outcome, loop, steps, case.control, truth, corridor))


def _fly_plain(case: Case, corridor: Corridor | None) -> Outcome:
    """Outcome of one run of a law in plain Python; nothing changes once it has failed."""
    state, steps, truth, hardware, noise = case.plant
    control, equipped = case.control, rig(hardware)
    draws = all_draws(hardware, truth.wind, *noise)
    first, later = loop_of(control)
    loop, outcome = first(state, truth, control, next(draws), equipped), START
    for number in range(steps):
        outcome = outcome_after(outcome, loop, number, control, truth, corridor)
        if outcome.cause != 0.0:
            return outcome
        loop = later(loop, number, truth, control, next(draws), equipped)
    return outcome_after(outcome, loop, steps, control, truth, corridor)


def lanes_of(rows: Array, first: int) -> Array:
    """Transpose of LANES rows from `first` on; missing ones repeat the last."""
    index = np.minimum(np.arange(first, first + LANES), len(rows) - 1)
    return np.ascontiguousarray(rows[index].T)
