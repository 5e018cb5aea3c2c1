# Copyright 2026 ahv developers, Apache-2.0
"""The report's loops around a law of the rates, sections 3.1, 3.2 and 3.4.

Altitude and attitude come before it, speed after it, so that only the inner loop sets
such laws apart from the report's, and from each other.
"""

from typing import Any, NamedTuple

from ahv_control.intermediate_loop import IntermediateLoop, rate_command
from ahv_control.law import Commands
from ahv_control.newton_raphson import Solution
from ahv_control.outer_loop import OuterLoop, attitude_command
from ahv_control.reference import Reference
from ahv_control.velocity_loop import VelocityLoop, throttle_command
from ahv_plant.model.constants import RADIANS
from ahv_plant.model.vectors import Attitude, Rates, State
from ahv_plant.numerics.elementwise import elementwise


class Loops(NamedTuple):
    """Settings of the loops around a law of the rates; their own references are not used."""

    outer: OuterLoop
    intermediate: IntermediateLoop
    velocity: VelocityLoop


def loops_of(settings: Any) -> Loops:
    """Loops from settings with the fields k_h, k_attitude, k_u, alpha_limit, geometric_altitude.

    Gains are in [1/s], the limit is in [deg].
    """
    k, bound = settings.k_attitude, settings.alpha_limit * RADIANS
    return Loops(
        OuterLoop(0.0, settings.k_h, bound, 90.0 * RADIANS),
        IntermediateLoop(k, k, k),
        VelocityLoop(0.0, settings.k_u, settings.geometric_altitude),
    )


@elementwise
def commanded(state: State, reference: Reference, loops: Loops) -> tuple[Attitude, Rates]:
    """Attitude [rad] and rates [rad/s] that the outer and the intermediate loop ask for."""
    attitude = attitude_command(state, reference, None, loops.outer)
    return attitude, rate_command(state, attitude, reference.psi_rate, loops.intermediate)


@elementwise
def answered(
    state: State,
    attitude: Attitude,
    rates: Rates,
    solution: Solution,
    reference: Reference,
    loops: Loops,
) -> Commands:
    """All commands [rad, rad/s, -] once the surfaces are found: the velocity loop adds its own."""
    throttle = throttle_command(state, solution.surfaces, reference, loops.velocity)
    return Commands(attitude, rates, solution.surfaces, throttle, solution.status)
