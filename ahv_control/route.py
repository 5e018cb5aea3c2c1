# Copyright 2026 ahv developers, Apache-2.0
"""A reference by places: from waypoint to waypoint, by the measured position.

Beyond the report, whose heading and altitude are constant (sections 3.1 and 3.2).

Heading, altitude and speed are led towards those of the waypoint ahead: at a rate that is limited,
and reached within a build-up time, so that nothing overshoots: the rate wanted is the distance
left over the build-up time, and with that time as the inverse of its gain it need never be cut
faster than it may be built up.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import State, clamp
from ahv_plant.numerics.elementary import atan2, sin_cos
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.simd import widen

# (n, 4), n >= 1: x north [m], y east [m], altitude [m], speed [m/s]
Waypoints = NDArray[np.float64]


class Route(NamedTuple):
    """Waypoints, and how the vehicle is led from one to the next."""

    waypoints: Waypoints
    radius: float  # [m] within which a waypoint is reached
    build_up: float  # [s] in which a rate reaches its limit
    climb_rate: float  # [m/s] limit
    acceleration: float  # [m/s^2] limit
    turn_rate: float  # [rad/s] limit


class Led(NamedTuple):
    """A value that is led to a target."""

    value: float  # [m], [m/s] or [rad]
    rate: float  # [1/s] times the unit of the value


class RouteState(NamedTuple):
    """Where on its route a vehicle is."""

    leg: float  # [-] waypoints reached
    x: float  # [m] north, where the guidance started
    y: float  # [m] east
    altitude: Led  # [m]
    speed: Led  # [m/s]
    psi: Led  # [rad]


class Ahead(NamedTuple):
    """The waypoint ahead."""

    x: float  # [m] north of the vehicle; zero past the last one
    y: float  # [m] east
    altitude: float  # [m]
    speed: float  # [m/s]
    reached: float  # [-] 1 or 0


@elementwise
def lead(now: Led, left: float, limit: float, build_up: float) -> Led:
    """Value and rate one step later, `left` being what is missing to the target.

    The rate stays within its `limit` per second, and changes by no more than limit / build_up [s].
    """
    wanted = clamp(left / build_up, -limit, limit)
    change = limit / build_up * STEP
    rate = now.rate + clamp(wanted - now.rate, -change, change)
    return Led(now.value + rate * STEP, rate)


@elementwise
def bearing_error(x: float, y: float, psi: float) -> float:
    """Angle [rad] from heading `psi` [rad] to a place `x` [m] north and `y` [m] east of here.

    Zero for the place here.
    """
    sine, cosine = sin_cos(psi)
    ahead, aside = x * cosine + y * sine, y * cosine - x * sine
    return atan2(aside, select((ahead == 0.0) & (aside == 0.0), 1.0, ahead))


@elementwise
def waypoint_ahead(now: RouteState, state: State, route: Route) -> Ahead:
    """Waypoint of the leg that is flown, as seen from the vehicle [m].

    Past the last one there is none to turn to; its altitude and speed stay.

    A waypoint is reached within the radius, and when it is passed: when it lies behind the plane
    through the vehicle that is square to the leg.
    """
    points, one = route.waypoints, state.u
    x, y, reached = widen(0.0, one), widen(0.0, one), widen(0.0, one)
    altitude, speed = widen(points[-1, 2], one), widen(points[-1, 3], one)
    from_x, from_y = now.x, now.y
    for place in range(len(points)):
        here = now.leg == float(place)
        to_x, to_y = points[place, 0] - state.x, points[place, 1] - state.y
        along = to_x * (points[place, 0] - from_x) + to_y * (points[place, 1] - from_y)
        near = to_x * to_x + to_y * to_y < route.radius * route.radius
        x, y = select(here, to_x, x), select(here, to_y, y)
        altitude = select(here, points[place, 2], altitude)
        speed = select(here, points[place, 3], speed)
        reached = select(here, select(near | (along < 0.0), 1.0, 0.0), reached)
        from_x, from_y = widen(points[place, 0], one), widen(points[place, 1], one)
    return Ahead(x, y, altitude, speed, reached)


@elementwise
def first_ahead(state: State, route: Route) -> float:
    """Count [-] of the waypoints before the first that is ahead, within 90 deg of the heading."""
    points = route.waypoints
    sine, cosine = sin_cos(state.psi)
    leg = widen(float(len(points)), state.u)
    for after in range(len(points)):
        place = len(points) - 1 - after
        x, y = points[place, 0] - state.x, points[place, 1] - state.y
        leg = select(x * cosine + y * sine > 0.0, float(place), leg)
    return leg


@elementwise
def climb_and_turn(state: State) -> tuple[float, float]:
    """Rates of altitude [m/s] and heading [rad/s] of a state, eqs 2.4 and 2.5."""
    sin_phi, cos_phi = sin_cos(state.phi)
    sin_theta, cos_theta = sin_cos(state.theta)
    down = state.v * sin_phi + state.w * cos_phi
    turn = (state.Q * sin_phi + state.R * cos_phi) / cos_theta
    return state.u * sin_theta - down * cos_theta, turn


@elementwise
def start_route(
    state: State, number: int, altitude: float, speed: float, psi: float, route: Route
) -> RouteState:
    """Route at its first waypoint, from `altitude` [m], u = `speed` [m/s] and `psi` [rad].

    A guidance that starts in flight, after `number` steps, goes on from where the vehicle is to
    the first waypoint ahead, climbing and turning as it does: it may have been started again.
    """
    one, under_way = state.u, number > 0
    still = widen(0.0, one)
    ahead = first_ahead(state, route)
    climb, turn = climb_and_turn(state)
    climb = clamp(climb, -route.climb_rate, route.climb_rate)
    turn = clamp(turn, -route.turn_rate, route.turn_rate)
    return RouteState(
        ahead if under_way else still,
        state.x,
        state.y,
        Led(state.h if under_way else widen(altitude, one), climb if under_way else still),
        Led(state.u if under_way else widen(speed, one), still),
        Led(state.psi if under_way else widen(psi, one), turn if under_way else still),
    )


@elementwise
def route_step(now: RouteState, state: State, route: Route) -> RouteState:
    """Route one step later, by the measured `state`; past the last waypoint, straight on."""
    ahead = waypoint_ahead(now, state, route)
    turn = bearing_error(ahead.x, ahead.y, now.psi.value)
    return RouteState(
        now.leg + ahead.reached,
        now.x,
        now.y,
        lead(now.altitude, ahead.altitude - now.altitude.value, route.climb_rate, route.build_up),
        lead(now.speed, ahead.speed - now.speed.value, route.acceleration, route.build_up),
        lead(now.psi, turn, route.turn_rate, route.build_up),
    )
