# Copyright 2026 ahv developers, Apache-2.0
"""The boundary of the flight software: how a law is called, and what it answers.

A law is a value, its settings, with two element-wise functions:

    start(state, settings) -> memory, commands         at the first state of a flight
    step(memory, state, settings) -> memory, commands  at every state after that

The memory is the law's own, a named tuple of numbers. `ahv_control.flight_control` has those of
the report; `ahv_analysis.flight.closed_loop` closes the loop around them.
"""

from typing import NamedTuple

from ahv_plant.model.vectors import Attitude, Rates, Surfaces


class Commands(NamedTuple):
    """What the flight control answers to one state."""

    attitude: Attitude  # phi*, theta*, psi*
    rates: Rates  # P*, Q*, R*
    surfaces: Surfaces
    throttle: float  # [-] sigma_T
    status: int  # SolverStatus of the inner loop
