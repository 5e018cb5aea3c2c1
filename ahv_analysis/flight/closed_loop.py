# Copyright 2026 ahv developers, Apache-2.0
"""The closed loop: guidance, flight control and true vehicle, one step at a time.

Element-wise, so that it is the same in plain Python, compiled, and in lanes. Whoever flies, calls
`start_loop` and `loop_step` and looks at what is between them: the outcome of a run, a trajectory
to be drawn, a bag. The graph's nodes close the same loop by messages.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ahv_control.guidance import guidance_step, start_guidance
from ahv_control.law import Commands
from ahv_control.own_law import Control, is_compiled, start, step
from ahv_control.reference import Reference
from ahv_control.route import RouteState
from ahv_plant.dispersion import Truth
from ahv_plant.hardware.noise import Draws
from ahv_plant.model.vectors import Controls, State
from ahv_plant.numerics.elementwise import composition, elementwise
from ahv_plant.plant import Plant, Rig, plant_step, start_plant


class Loop(NamedTuple):
    """The closed loop at one step."""

    plant: Plant
    memory: Any  # of the flight control
    commands: Commands  # that answer the measurement
    route: RouteState | None  # memory of a guidance by waypoints
    reference: Reference | None  # that the commands follow; None where nothing guides


@elementwise
def start_loop(
    state: State, truth: Truth, control: Control, draws: Draws | None, rig: Rig | None
) -> Loop:
    """Loop at the first state of a flight; without a rig the hardware is ideal."""
    plant = start_plant(state, truth, draws, rig)
    route, reference = start_guidance(plant.measured.state, 0, control.guidance)
    memory, commands = start(plant.measured, reference, control)
    return Loop(plant, memory, commands, route, reference)


@composition
def loop_step(
    loop: Loop,
    number: int,
    truth: Truth,
    control: Control,
    draws: Draws | None,
    rig: Rig | None,
) -> Loop:
    """Loop one step later; `number` counts the steps flown before."""
    held = loop.commands
    command = Controls(held.surfaces, held.throttle)
    plant = plant_step(loop.plant, command, number, truth, draws, rig)
    route, reference = guidance_step(
        loop.route, plant.measured.state, number + 1, control.guidance
    )
    memory, commands = step(
        loop.memory, loop.plant.measured, held, plant.measured, reference, control
    )
    return Loop(plant, memory, commands, route, reference)


def loop_of(control: Control) -> tuple[Callable[..., Loop], Callable[..., Loop]]:
    """`start_loop` and `loop_step` for a law: where it is plain Python, so are they.

    Vehicle and hardware are compiled all the same, to the same bits.
    """
    if is_compiled(control):
        return start_loop, loop_step
    return _as_python(start_loop), _as_python(loop_step)


def _as_python(function: Callable[..., Loop]) -> Callable[..., Loop]:
    plain: Callable[..., Loop] = getattr(function, "py_func", function)
    return plain
