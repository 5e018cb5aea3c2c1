"""The three loops and the velocity loop composed, as the graph composes its nodes (Fig. 3.1)."""

from typing import NamedTuple

from ahv_control.inner_loop import InnerLoop, surface_command
from ahv_control.intermediate_loop import IntermediateLoop, Rates, rate_command
from ahv_control.outer_loop import Attitude, OuterLoop, attitude_command
from ahv_control.velocity_loop import VelocityLoop, throttle_command
from ahv_plant.compiled import elementwise
from ahv_plant.state import State, Surfaces

# The search for the first command starts here; later ones start at the command before.
NEUTRAL = Surfaces(0.0, 0.0, 0.0)


class FlightControl(NamedTuple):
    """Settings of all loops."""

    outer: OuterLoop
    intermediate: IntermediateLoop
    inner: InnerLoop
    velocity: VelocityLoop


class Commands(NamedTuple):
    """What the flight control answers to one state."""

    attitude: Attitude  # phi*, theta*, psi*
    rates: Rates  # P*, Q*, R*
    surfaces: Surfaces
    throttle: float  # [-] sigma_T
    status: int  # SolverStatus of the inner loop


@elementwise
def flight_control(state: State, previous: Surfaces, settings: FlightControl) -> Commands:
    """All commands for `state`; `previous` are the surfaces commanded one step before."""
    attitude = attitude_command(state, settings.outer)
    rates = rate_command(state, attitude, settings.intermediate)
    solution = surface_command(state, rates, previous, settings.inner)
    throttle = throttle_command(state, solution.surfaces, settings.velocity)
    return Commands(attitude, rates, solution.surfaces, throttle, solution.status)
