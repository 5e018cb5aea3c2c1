# Copyright 2026 ahv developers, Apache-2.0
"""The boundary of the flight software: how a law is called, and what it answers.

A law is a value, its settings, with two element-wise functions:

    start(measured, reference, settings) -> memory, commands
    step(memory, before, commands, measured, reference, settings) -> memory, commands

The first is for the first measurement of a flight, the second for every one after it: `before` is
the measurement one step ago, `commands` what was answered to it. The reference is what is to be
flown now, or None where nothing guides: then the law holds what its settings say. The memory is
the law's own: what else it keeps from step to step, numbers in named tuples or None.
`ahv_control.flight_control` has the laws of the report; the closed loop calls them.
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
