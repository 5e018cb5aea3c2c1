# Copyright 2026 ahv developers, Apache-2.0
"""What no vehicle of this kind could follow: refused before it flies, and in flight.

By the trimmed flight of section 3.5.1, and by turns that are trimmed alike.
"""

from collections.abc import Iterator
from math import atan, atan2, hypot, remainder, tau

from ahv_control.guidance import Guidance, by_time, conditions, fastest_turn
from ahv_control.guided_flight import Followed, Plan
from ahv_control.reference import Reference
from ahv_control.selected import Target, target_of
from ahv_control.steady_turn import CONTINUATION, steady_turn
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.model.constants import (
    DEGREES,
    GRAVITY,
    MAXIMUM_THRUST,
    SPECIFIC_IMPULSE,
    STEP,
    THROTTLE_MAXIMUM,
)
from ahv_plant.model.flight_condition import check_flight_condition
from ahv_plant.model.limits import LIMITS, NOT_FOUND
from ahv_plant.model.mass import MASS_MINIMUM
from ahv_plant.model.vectors import State

BURNING = THROTTLE_MAXIMUM * MAXIMUM_THRUST / (SPECIFIC_IMPULSE * GRAVITY)  # [kg/s] eq 2.6
AT_ONCE = (1, 8)  # CONTINUATION of what is asked in flight
STEEPEST = 1.875  # [-] of the quintic in its middle, by the rate of a ramp


def why_not_flown(
    altitude: float,
    speed: float,
    mass: float,
    bank: float,
    geometric: bool,
    continuation: tuple[int, ...] = CONTINUATION,
) -> str:
    """Which limits the nominal vehicle passes that turns level at a `bank` [rad]; empty if none.

    At `altitude` [m], u = `speed` [m/s] and `mass` [kg]: angle of attack, elevons and throttle.
    """
    found = steady_turn(altitude, speed, mass, bank, geometric, continuation)
    if found.alpha != found.alpha:
        return NOT_FOUND
    values = found.alpha * DEGREES, found.elevon * DEGREES, found.throttle
    passed = (limit.passed_by(value) for limit, value in zip(LIMITS, values, strict=True))
    return ", ".join(filter(None, passed))


def check_place(
    place: str,
    altitude: float,
    speed: float,
    mass: float,
    left: float,
    geometric: bool,
    turn: float = 0.0,
) -> None:
    """Raise ParameterError where the nominal vehicle cannot fly level, or `turn` [rad/s] so.

    It is refused only where that is certain: at `altitude` [m] and u = `speed` [m/s] with what the
    `mass` [kg] is after `left` [s] of full throttle.
    """
    lightest = max(mass - BURNING * left, MASS_MINIMUM)
    try:
        check_flight_condition(altitude, speed, mass, geometric)
    except ValueError as error:
        raise ParameterError(f"guidance: {place}: {error}") from error
    bank = atan(speed * turn / GRAVITY)
    why = why_not_flown(altitude, speed, lightest, bank, geometric)
    if why:
        turns = f"turns by {turn * DEGREES:.3g} deg/s, which takes a bank of {bank * DEGREES:.3g} "
        flies = f"{turns}deg," if turn else "flies level"
        raise ParameterError(
            f"guidance: {place}: no vehicle of {lightest / 1e3:.0f} t or more {flies} at "
            f"{altitude:g} m and {speed:g} m/s: {why}"
        )


def turns(guidance: Guidance) -> Iterator[tuple[str, float, float, float, float]]:
    """Where a guidance is sure to turn: place, altitude [m], speed [m/s], time [s], rate [rad/s].

    By waypoints, where the course changes by so much that the limit of the rate is reached.
    """
    route, schedule = guidance.route, guidance.schedule
    if route is None:
        for at, before, after, over in schedule.heading[1:].tolist():
            if over > 0.0 and after != before:
                steepest = STEEPEST if schedule.smooth else 1.0
                middle = round((at + 0.5 * over) / STEP)
                there = by_time(None, middle, guidance)
                rate = steepest * abs(after - before) / over
                yield f"at {middle * STEP:g} s", there.altitude, there.speed, middle * STEP, rate
        return
    flown, x, y, course = 0.0, 0.0, 0.0, None
    slowest = min(route.waypoints[:, 3].min(), schedule.speed[0, 1])
    last = schedule.altitude[0, 1], schedule.speed[0, 1]
    for count, (to_x, to_y, altitude, speed) in enumerate(route.waypoints.tolist(), 1):
        new = atan2(to_y - y, to_x - x)
        change = abs(remainder(new - course, tau)) if course is not None else 0.0
        if change > 2.0 * route.turn_rate * route.build_up:
            yield f"waypoint {count - 1}", *last, flown / max(slowest, 1.0), route.turn_rate
        flown, x, y, course = flown + hypot(to_x - x, to_y - y), to_x, to_y, new
        last = altitude, speed


def check_bank(turn: float, speed: float, limit: float) -> None:
    """Raise ParameterError if a `turn` [rad/s] at `speed` [m/s] takes more bank than `limit`."""
    bank = atan(speed * turn / GRAVITY)
    if bank > limit:
        raise ParameterError(
            f"guidance: a turn of {turn * DEGREES:.3g} deg/s takes a bank of {bank * DEGREES:.3g} "
            f"deg at {speed:g} m/s, but bank_limit is {limit * DEGREES:g} deg"
        )


def check_reach(guidance: Guidance, mass: float, geometric: bool, flown: float = 0.0) -> None:
    """Raise ParameterError for a reference that leads where the nominal vehicle cannot fly.

    Of `mass` [kg] when `flown` [s] of the flight are over. A turn is refused whose bank is beyond
    the limit, or takes more than the vehicle can give.
    """
    for place, altitude, speed, time in conditions(guidance):
        check_place(place, altitude, speed, mass, max(time - flown, 0.0), geometric)
    if not guidance.coordinated:
        return
    check_bank(fastest_turn(guidance), guidance.schedule.speed[0, 1], guidance.bank_limit)
    for place, altitude, speed, time, rate in turns(guidance):
        check_place(place, altitude, speed, mass, max(time - flown, 0.0), geometric, rate)


def check_change(plan: Plan, now: Followed, state: State, number: int) -> None:
    """Raise ParameterError for a plan that cannot be followed from a `state` on.

    `number` counts the steps flown; `now` is what was followed.
    """
    guidance, limits = plan.guidance, plan.limits
    geometric = guidance.schedule.geometric
    if plan.selection is None:
        check_reach(guidance, state.mass, geometric, number * STEP)
        return
    last = now.last
    before = now.target or Target(last.altitude, last.speed, last.psi)
    target = target_of(plan.selection, before)
    climb, faster = abs(target.altitude - last.altitude), abs(target.speed - last.speed)
    left = max(climb / limits.climb_rate, faster / limits.acceleration) + 2.0 * limits.build_up
    place = "selected", target.altitude, target.speed, state.mass, left, geometric
    check_place(*place)
    course = abs(remainder(target.psi - last.psi, tau))
    if guidance.coordinated and course > 2.0 * limits.turn_rate * limits.build_up:
        check_bank(limits.turn_rate, target.speed, guidance.bank_limit)
        check_place(*place, limits.turn_rate)


def why_not_followed(reference: Reference, mass: float, geometric: bool) -> str:
    """Why the nominal vehicle of `mass` [kg] cannot fly level as a reference is; empty if it can.

    The search is a short one, which has to end within a step.
    """
    altitude, speed, bank = reference.altitude, reference.speed, reference.phi
    try:
        check_flight_condition(altitude, speed, mass, geometric)
    except ValueError as error:
        return str(error)
    why = why_not_flown(altitude, speed, mass, bank, geometric, AT_ONCE)
    banked = f", bank {bank * DEGREES:.3g} deg" if bank else ""
    return why and f"{why} at {altitude:.0f} m, {speed:.1f} m/s{banked} and {mass / 1e3:.1f} t"
