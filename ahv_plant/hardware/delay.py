# Copyright 2026 ahv developers, Apache-2.0
"""Latency: whole steps from a measured state to the arrival of its commands at the actuators.

The commands under way are rows of an array, which the flight's loop keeps, one row a step in
turn; for a batch every number of a row is lanes.
"""

import numpy as np
from numpy.typing import NDArray

from ahv_plant.model.vectors import Controls, Surfaces
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.simd import load, store

LONGEST = 20  # [steps] of delay
ROWS = LONGEST + 2  # the newest, the longest delay, and a step of jitter
_LIKE = Controls(Surfaces(0.0, 0.0, 0.0), 0.0)


def line_at(start: Controls) -> NDArray[np.float64]:
    """Line (ROWS, 4[, lanes]) before the first command: what arrives from it is `start`.

    Its numbers may be arrays (lanes,).
    """
    return np.array([[*start.surfaces, start.throttle]] * ROWS)


@elementwise
def through(
    line: NDArray[np.float64], controls: Controls, step: int, delay: int, late: float
) -> Controls:
    """Send the `controls` of a step and return those that arrive at it.

    `delay` is in steps of 0.01 s; where `late` [-] is 1 what should arrive comes a step later, and
    what came before stays in force; else it is 0.
    """
    store(line[step % ROWS], controls)
    due = load(_LIKE, line[(step - delay + ROWS) % ROWS])
    last = load(_LIKE, line[(step - delay - 1 + ROWS) % ROWS])
    waits = late == 1.0
    return Controls(
        Surfaces(
            select(waits, last.surfaces.right_elevon, due.surfaces.right_elevon),
            select(waits, last.surfaces.left_elevon, due.surfaces.left_elevon),
            select(waits, last.surfaces.rudder, due.surfaces.rudder),
        ),
        select(waits, last.throttle, due.throttle),
    )
