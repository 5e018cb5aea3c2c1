# Copyright 2026 ahv developers, Apache-2.0
"""Altitude, speed and heading that are selected in flight, instead of a profile.

Beyond section 3.1 of the report. They are led to as those of a waypoint are (route.py), from where
the reference was, and the vehicle flies on straight.
"""

from typing import NamedTuple

from ahv_control.reference import Reference
from ahv_control.route import Led, Route, RouteState, bearing_error, first_ahead, lead
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import State, clamp
from ahv_plant.numerics.elementary import sin_cos
from ahv_plant.numerics.elementwise import elementwise


class Selection(NamedTuple):
    """What is selected; None is not, and stays as it is."""

    altitude: float | None  # [m]
    speed: float | None  # [m/s]
    psi: float | None  # [rad]


class Target(NamedTuple):
    """What is led to."""

    altitude: float  # [m]
    speed: float  # [m/s]
    psi: float  # [rad] by the shorter way


class RateLimits(NamedTuple):
    """How fast the reference may change."""

    climb_rate: float  # [m/s]
    acceleration: float  # [m/s^2]
    turn_rate: float  # [rad/s]
    build_up: float  # [s] in which a rate reaches its limit


def target_of(selection: Selection, before: Target) -> Target:
    """Target of a selection; what is not selected is that of the one `before`."""
    chosen = zip(selection, before, strict=True)
    return Target(*(old if new is None else new for new, old in chosen))


def led_on(before: Reference, last: Reference, limits: RateLimits) -> tuple[Led, Led, Led]:
    """Altitude [m], speed [m/s] and heading [rad] of the `last` reference, and their rates.

    The rates are those since the reference one step `before`, within their limits.
    """

    def led(value: float, old: float, limit: float) -> Led:
        return Led(value, float(clamp((value - old) / STEP, -limit, limit)))

    return (
        led(last.altitude, before.altitude, limits.climb_rate),
        led(last.speed, before.speed, limits.acceleration),
        led(last.psi, before.psi, limits.turn_rate),
    )


def joined(state: State, led: tuple[Led, Led, Led], route: Route | None) -> RouteState:
    """Memory of a flight that leaves what it followed: to the first waypoint ahead, if any."""
    leg = 0.0 if route is None else float(first_ahead(state, route))
    return RouteState(leg, state.x, state.y, *led)


@elementwise
def selected_step(now: RouteState, target: Target, limits: RateLimits) -> RouteState:
    """What is followed one step later, on the way to a `target`."""
    sine, cosine = sin_cos(target.psi)
    turn = bearing_error(cosine, sine, now.psi.value)
    build_up = limits.build_up
    climb, faster = target.altitude - now.altitude.value, target.speed - now.speed.value
    return RouteState(
        now.leg,
        now.x,
        now.y,
        lead(now.altitude, climb, limits.climb_rate, build_up),
        lead(now.speed, faster, limits.acceleration, build_up),
        lead(now.psi, turn, limits.turn_rate, build_up),
    )
