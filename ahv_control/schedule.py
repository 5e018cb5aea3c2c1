# Copyright 2026 ahv developers, Apache-2.0
"""A reference as a function of time: transitions of altitude, speed and heading, one by one.

A transition is a row (at [s], from, to, over [s]): a step if it takes no time, else a ramp, or a
smooth one whose rate and acceleration begin and end at zero, 10 s^3 - 15 s^4 + 6 s^5: of all such
the one of least jerk (Flash and Hogan, 1985). Its largest rate is 15/8 of a ramp's, its largest
jerk 60 times the change over the time to the third power.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import STEP
from ahv_plant.numerics.elementwise import elementwise, select

Transitions = NDArray[np.float64]  # (n, 4), n >= 1, in the order of their times
KEEPS = ("speed", "Mach number", "dynamic pressure")  # what stays as it is when altitude changes


class Schedule(NamedTuple):
    """Transitions of what is to be followed; the first row of each is where it starts."""

    altitude: Transitions  # [m]
    speed: Transitions  # [m/s] at the first altitude
    heading: Transitions  # [rad]
    smooth: bool  # else ramps
    keeps: int  # place in KEEPS
    geometric: bool  # h is a geometric altitude


@elementwise
def scheduled(time: float, rows: Transitions, smooth: bool) -> tuple[float, float]:
    """Value at a `time` [s] by transitions `rows`, and its rate per second.

    A smooth transition follows the quintic of the module; at its end the value is that of the row.
    """
    value, rate = rows[0, 1], 0.0
    for row in range(len(rows)):
        begin, first, last, over = rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3]
        begun, done = time >= begin, time >= begin + over
        length = select(over > 0.0, over, 1.0)
        s = (time - begin) / length
        curved = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        steepness = select(smooth, 30.0 * s * s * (1.0 - s) * (1.0 - s), 1.0)
        under_way = first + (last - first) * select(smooth, curved, s)
        value = select(begun, select(done, last, under_way), value)
        rate = select(begun, select(done, 0.0, (last - first) * steepness / length), rate)
    return value, rate


@elementwise
def speed_ratio(altitude: float, first: float, keeps: int, geometric: bool) -> float:
    """Speed at `altitude` [m] over that at the `first` one [m], of what is kept (KEEPS)."""
    here, there = atmosphere(altitude, geometric), atmosphere(first, geometric)
    mach = here.sound_speed / there.sound_speed
    pressure = sqrt(there.density / here.density)
    return select(keeps == 1, mach, select(keeps == 2, pressure, 1.0))


@elementwise
def speed_along(
    time: float, altitude: float, climb: float, schedule: Schedule
) -> tuple[float, float]:
    """Speed [m/s] and its rate [m/s^2] at a `time` [s] and an `altitude` [m].

    The altitude changes at `climb` [m/s]; the part of the rate that comes of that is the change
    in the next step.
    """
    speed, rate = scheduled(time, schedule.speed, schedule.smooth)
    first, keeps, geometric = schedule.altitude[0, 1], schedule.keeps, schedule.geometric
    ratio = speed_ratio(altitude, first, keeps, geometric)
    later = speed_ratio(altitude + climb * STEP, first, keeps, geometric)
    return speed * ratio, rate * ratio + speed * (later - ratio) / STEP
