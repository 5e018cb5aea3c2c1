# Copyright 2026 ahv developers, Apache-2.0
"""A flight in this process, without ROS: the same laws and vehicle, composed the same way."""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from ahv_analysis.bag.record import Step
from ahv_analysis.bag.rows import Array
from ahv_analysis.bag.solver_status import failed_status, lost_status
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.flight.case import Case, notes
from ahv_analysis.flight.closed_loop import Loop, loop_of, loop_step, start_loop
from ahv_analysis.interrupt import signals_wait
from ahv_control.flight_control import Memory
from ahv_control.law_file import compiling
from ahv_control.learner_message import estimate_values, learner_values
from ahv_control.newton_raphson import SolverStatus
from ahv_control.own_law import TROUBLES, Control, OwnLaw, is_compiled
from ahv_msgs_py.layout import clock_bytes
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    CLOCK,
    DIAGNOSTICS,
    DISTURBANCE_ESTIMATE,
    LEARNER,
    RATE_COMMAND,
    REFERENCE,
    STATE,
    SURFACE_COMMAND,
    SURFACES,
    THROTTLE_COMMAND,
    TRUTH,
    LoopTopic,
)
from ahv_plant.dispersion import Truth
from ahv_plant.hardware.noise import Draws, draws_of
from ahv_plant.model.constants import STEP, STEP_NS
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.numerics.optional import optional
from ahv_plant.plant import Rig, noise_stream, rig
from ahv_plant.termination import termination, termination_reason

BLOCK = 100  # steps that are flown at a time
CHUNK = 1000 * STEP_NS  # [ns] of flight that a bag keeps together
INTERRUPTED = "interrupted"  # why a flight ended early, where a signal does not end the program


@optional
def _drawn(row: int, block: Array) -> Draws:
    """Draws in a row of a block; None where nothing is drawn."""
    return draws_of(block[row])


@kernel
def fly_on(loop, first, steps, truth, control, block, rig):
    """Loop after `first` steps, and after each of so many more, up to where the flight ends.

    Settings are handed over once for all of them: that takes longer than a step.
    """
    flown = [loop]
    for row in range(steps):
        loop = loop_step(loop, first + row, truth, control, _drawn(row, block), rig)
        flown.append(loop)
        if termination(loop.plant.state, truth.geometric) != 0:
            break
    return flown


def _fly_on(
    loop: Loop,
    first: int,
    steps: int,
    truth: Truth,
    control: Control,
    block: Array | None,
    rig: Rig | None,
) -> list[Loop]:
    """`fly_on` of a law in plain Python."""
    flown = [loop]
    _, later = loop_of(control)
    for row in range(steps):
        flown.append(later(flown[-1], first + row, truth, control, _drawn(row, block), rig))
        if termination(flown[-1].plant.state, truth.geometric) != 0:
            break
    return flown


def fly(case: Case) -> Iterator[Step]:
    """Fly `case`: its steps 0 to N, or fewer if the model no longer describes the vehicle."""
    with compiling(case.law):
        yield from _steps(case)


def _steps(case: Case) -> Iterator[Step]:
    truth, control, equipped = case.plant.truth, case.control, rig(case.plant.hardware)
    noise = None
    if case.plant.hardware is not None:
        noise = noise_stream(case.plant.hardware, truth.wind, *case.plant.noise)
    block = noise and noise.block(1)
    start, on = (start_loop, fly_on) if is_compiled(control) else (loop_of(control)[0], _fly_on)
    loop = start(case.plant.initial, truth, control, _drawn(0, block), equipped)
    for first in range(0, case.plant.steps, BLOCK):
        steps = min(BLOCK, case.plant.steps - first)
        block = noise and noise.block(steps)
        flown = on(loop, first, steps, truth, control, block, equipped)
        loop = flown.pop()
        reason = termination_reason(loop.plant.state, truth.geometric, (first + len(flown)) * STEP)
        for number, before in enumerate(flown[:-1], first):
            yield _step(number, before, "", case)
        yield _step(first + len(flown) - 1, flown[-1], reason, case)
        if reason:
            return
    yield _step(case.plant.steps, loop, "", case)


def _step(number: int, loop: Loop, ended_early: str, case: Case) -> Step:
    plant = loop.plant
    measured = None if case.plant.hardware is None else plant.measured
    return Step(
        number * STEP_NS,
        plant.state,
        loop.commands,
        loop.memory.learner if isinstance(loop.memory, Memory) else None,
        ended_early,
        measured,
        loop.reference,
        isinstance(case.control, OwnLaw),
    )


def fly_library(
    case: Case, path: Path, *, progress: Callable[[int], None] = lambda steps: None
) -> tuple[str, float]:
    """Fly `case` and record it to the bag `path`, as `fly_graph` does.

    `progress(steps)` is called now and then. Returns why the flight ended early (empty if it did
    not) and the seconds that it took. A signal ends the flight in order, as there.
    """
    for _ in zip(range(2), fly(case), strict=False):
        pass  # compile the laws before there is a bag
    with signals_wait() as interrupted:
        bag = BagWriter(path, notes(case))
        started = time.perf_counter()
        try:
            for step in fly(case):
                write_step(bag, step)
                if (step.stamp + STEP_NS) % CHUNK == 0:
                    bag.flush()
                    progress(step.stamp // STEP_NS)
                if interrupted():
                    progress(step.stamp // STEP_NS)
                    return INTERRUPTED, time.perf_counter() - started
        finally:
            bag.close()
        return step.ended_early, time.perf_counter() - started


def write_step(bag: BagWriter, step: Step) -> None:
    """File a step as the recorder files the messages of the graph."""
    answers = step.commands
    bag.write(CLOCK.name, clock_bytes(step.stamp))
    messages: list[tuple[LoopTopic, Sequence[float]]] = [
        (STATE, step.told),
        (ATTITUDE_COMMAND, answers.attitude),
        (RATE_COMMAND, answers.rates),
        (SURFACE_COMMAND, answers.surfaces),
        (THROTTLE_COMMAND, (answers.throttle,)),
    ]
    if step.reference is not None:
        messages.append((REFERENCE, step.reference))
    if step.learner is not None:
        messages.append((LEARNER, learner_values(step.learner)))
        messages.append((DISTURBANCE_ESTIMATE, estimate_values(step.estimate)))
    if step.measured is not None:
        messages += [(SURFACES, step.measured.surfaces), (TRUTH, step.state)]
    for topic, values in messages:
        bag.write(topic.name, topic.layout.encode(step.stamp, values))
    if answers.status == SolverStatus.SINGULAR:
        bag.write(DIAGNOSTICS.name, lost_status(step.stamp, step.own_law))
    if answers.status == SolverStatus.NO_ANSWER:
        why = next(reversed(TROUBLES), "its answer is no number")
        bag.write(DIAGNOSTICS.name, failed_status(step.stamp, why))
