# Copyright 2026 ahv developers, Apache-2.0
"""The boundary of the flight software: how a law is called, and what it answers.

A law is a file, or a module of a package, with three names:

    Settings                                a NamedTuple of numbers, truths, texts; with defaults
    start(measured, reference, settings) -> memory, commands
    step(memory, before, commands, measured, reference, settings) -> memory, commands

The first function is for the first measurement of a flight, the second for every one after it:
`before` is the measurement one step ago, `commands` what was flown in answer to it. `reference` is
what is to be flown now: by the guidance, or where nothing guides, the altitude and the speed of
the case. The memory is the law's own: what else it keeps from step to step, numbers in named
tuples or None.

A fourth name is optional: `design(settings)`, called once before a flight, answers what `start`
and `step` are given in place of the settings: gains that are computed of them, arrays, anything.

Where `start` and `step` are marked `@elementwise` they are compiled, and fly in the lanes of
campaigns; without the mark they are ordinary Python and fly too, at their own speed. Commands are
held within the stops of Section 3.5.2; where a law raises, or answers what is no number, the
commands before hold on, and the flight counts as failed.

The report's laws are called in the same way (flight_control.py), but for the reference: it is None
where nothing guides, and their loops hold what their own settings say.
"""

from typing import NamedTuple

from ahv_plant.model.vectors import Attitude, Rates, Surfaces
from ahv_plant.numerics.elementwise import elementwise


class Commands(NamedTuple):
    """What the flight control answers to one state."""

    attitude: Attitude  # phi*, theta*, psi*
    rates: Rates  # P*, Q*, R*
    surfaces: Surfaces
    throttle: float  # [-] sigma_T
    status: int  # SolverStatus of the inner loop


@elementwise
def direct(surfaces: Surfaces, throttle: float) -> Commands:
    """Commands of a law that has no inner loops: surfaces [rad] and throttle [-] alone.

    Those of attitude and rates are zero then, and are not drawn.
    """
    return Commands(Attitude(0.0, 0.0, 0.0), Rates(0.0, 0.0, 0.0), surfaces, throttle, 0)
