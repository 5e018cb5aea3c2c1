# Copyright 2026 ahv developers, Apache-2.0
"""Guidance: the reference of every step, by time or by waypoints, beyond section 3.1.

    start_guidance(measured state, number, guidance) -> memory, reference
    guidance_step(memory, measured state, number, guidance) -> memory, reference

`number` counts the steps flown before. Without guidance both are None, and the loops hold the
altitude and the speed among their own settings.
"""

from collections.abc import Iterator
from math import hypot
from typing import NamedTuple

import numpy as np

from ahv_control.reference import Reference
from ahv_control.route import Route, RouteState, route_step, start_route
from ahv_control.schedule import Schedule, scheduled, speed_along
from ahv_plant.model.constants import GRAVITY, STEP
from ahv_plant.model.vectors import State, clamp
from ahv_plant.numerics.elementary import atan
from ahv_plant.numerics.elementwise import elementwise
from ahv_plant.numerics.optional import optional


class Guidance(NamedTuple):
    """Settings of the guidance."""

    schedule: Schedule
    route: Route | None  # which is flown instead, from where the schedule starts
    coordinated: float  # [-] 1 banks into turns, 0 turns by sideslip, as the report's loops do
    feed_forward: float  # [-] 1 sends the rates of what is followed, 0 sends zeros
    bank_limit: float  # [rad]


@elementwise
def coordinated_bank(speed: float, psi_rate: float, limit: float) -> float:
    """Bank phi* [rad] at which lift turns the vehicle: tan phi* = V psi_dot / g, up to a `limit`.

    V is `speed` [m/s], `psi_rate` is in [rad/s].
    """
    return clamp(atan(speed * psi_rate / GRAVITY), -limit, limit)


@elementwise
def aimed(
    altitude: float,
    climb: float,
    speed: float,
    acceleration: float,
    psi: float,
    turn: float,
    guidance: Guidance,
) -> Reference:
    """Reference of altitude [m], speed [m/s] and heading psi [rad] with their rates per second."""
    bank = coordinated_bank(speed, turn, guidance.bank_limit)
    ahead = guidance.feed_forward
    return Reference(
        altitude,
        speed,
        guidance.coordinated * bank,
        psi,
        ahead * climb,
        ahead * acceleration,
        ahead * turn,
    )


@elementwise
def by_time(memory: None, number: int, guidance: Guidance) -> Reference:
    """Reference at a step by the schedule."""
    time, schedule = number * STEP, guidance.schedule
    altitude, climb = scheduled(time, schedule.altitude, schedule.smooth)
    speed, acceleration = speed_along(time, altitude, climb, schedule)
    psi, turn = scheduled(time, schedule.heading, schedule.smooth)
    return aimed(altitude, climb, speed, acceleration, psi, turn, guidance)


@elementwise
def by_place(memory: RouteState, guidance: Guidance) -> Reference:
    """Reference at a step of a guidance that leads to waypoints, or to what is selected."""
    altitude, speed, psi = memory.altitude, memory.speed, memory.psi
    return aimed(
        altitude.value, altitude.rate, speed.value, speed.rate, psi.value, psi.rate, guidance
    )


def _by_place(memory: RouteState, number: int, guidance: Guidance, route: Route) -> Reference:
    return by_place(memory, guidance)


_reference = optional(_by_place, otherwise=by_time)
_first_on_route = optional(start_route)
_next_on_route = optional(route_step)


def _start(state: State, number: int, guidance: Guidance) -> tuple[RouteState | None, Reference]:
    start = guidance.schedule
    memory = _first_on_route(
        state,
        number,
        start.altitude[0, 1],
        start.speed[0, 1],
        start.heading[0, 1],
        guidance.route,
    )
    return memory, _reference(memory, number, guidance, guidance.route)


def _step(
    memory: RouteState | None, state: State, number: int, guidance: Guidance
) -> tuple[RouteState | None, Reference]:
    later = _next_on_route(memory, state, guidance.route)
    return later, _reference(later, number, guidance, guidance.route)


def _unguided_start(state: State, number: int) -> tuple[None, None]:
    return None, None


def _unguided(memory: None, state: State, number: int) -> tuple[None, None]:
    return None, None


start_guidance = optional(_start, otherwise=_unguided_start)
guidance_step = optional(_step, otherwise=_unguided)


def conditions(guidance: Guidance) -> Iterator[tuple[str, float, float, float]]:
    """Where a guidance leads: name, altitude [m], speed [m/s] and time [s] of every place.

    The time is the latest at which it can be reached flying straight at the least of the speeds.
    """
    schedule, route = guidance.schedule, guidance.route
    if route is not None:
        flown, x, y = 0.0, 0.0, 0.0
        slowest = min(route.waypoints[:, 3].min(), schedule.speed[0, 1])
        for count, (to_x, to_y, altitude, speed) in enumerate(route.waypoints.tolist(), 1):
            flown, x, y = flown + hypot(to_x - x, to_y - y), to_x, to_y
            yield f"waypoint {count}", altitude, speed, flown / max(slowest, 1.0)
    for rows in (schedule.altitude, schedule.speed):
        for at, _, _, over in rows.tolist():
            number = round((at + over) / STEP)
            reference = by_time(None, number, guidance)
            time = number * STEP
            yield f"at {time:g} s", reference.altitude, reference.speed, time


def fastest_turn(guidance: Guidance) -> float:
    """Largest rate [rad/s] of the heading that a guidance asks for, steps aside."""
    if guidance.route is not None:
        return guidance.route.turn_rate
    rows = guidance.schedule.heading
    taking_time = rows[rows[:, 3] > 0.0]
    steepest = 1.875 if guidance.schedule.smooth else 1.0  # of the quintic in its middle
    rates = np.abs(taking_time[:, 2] - taking_time[:, 1]) / taking_time[:, 3]
    return float(steepest * rates.max(initial=0.0))
