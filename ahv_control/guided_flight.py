# Copyright 2026 ahv developers, Apache-2.0
"""A guidance whose plan may change in flight, from one step to the next.

Beyond section 3.1 of the report. Without a change it is the guidance of the closed loop, in every
bit. What follows a change begins with the reference as it was, so that it does not jump, unless
what is followed by time does.
"""

from typing import NamedTuple

import numpy as np

from ahv_control.guidance import Guidance, by_place, guidance_step, start_guidance
from ahv_control.reference import Reference
from ahv_control.route import Route, RouteState
from ahv_control.selected import (
    RateLimits,
    Selection,
    Target,
    joined,
    led_on,
    selected_step,
    target_of,
)
from ahv_plant.model.vectors import State


class Plan(NamedTuple):
    """What is to be flown."""

    guidance: Guidance
    selection: Selection | None  # which is flown instead
    limits: RateLimits


class Followed(NamedTuple):
    """What a guided flight remembers from step to step."""

    plan: Plan  # of the last step
    route: RouteState | None  # where on its way to waypoints or to a selection it is
    target: Target | None  # of a selection
    before: Reference  # one step before the last
    last: Reference


def start_followed(state: State, number: int, plan: Plan) -> Followed:
    """First step of a guidance, after `number` steps of the flight; it follows its profile."""
    route, reference = start_guidance(state, number, plan.guidance)
    flown = plan if plan.selection is None else plan._replace(selection=None)
    return Followed(flown, route, None, reference, reference)


def next_followed(now: Followed, state: State, number: int, plan: Plan) -> Followed:
    """One step later at a measured `state`, by the same plan or another one."""
    route, target = now.route, now.target
    if plan is not now.plan:
        route, target = _changed(now, state, plan)
    if target is None or route is None:
        route, reference = guidance_step(route, state, number, plan.guidance)
    else:
        route = selected_step(route, target, plan.limits)
        reference = by_place(route, plan.guidance)
    return Followed(plan, route, target, now.last, reference)


def _changed(now: Followed, state: State, plan: Plan) -> tuple[RouteState | None, Target | None]:
    """Where a flight goes on by another plan."""
    goes_on = joined(state, led_on(now.before, now.last, plan.limits), plan.guidance.route)
    if plan.selection is not None:
        if now.target is not None:
            return now.route, target_of(plan.selection, now.target)
        last = now.last
        return goes_on, target_of(plan.selection, Target(last.altitude, last.speed, last.psi))
    if plan.guidance.route is None:
        return None, None
    before = now.plan.guidance.route
    same = before is not None and (before.waypoints == plan.guidance.route.waypoints).all()
    return (now.route if same and now.target is None else goes_on), None


def warm_up(plan: Plan) -> None:
    """Fly some steps of a plan and of all that it can be changed to: no step may compile."""
    state = State(*[1.0] * len(State._fields))
    guidance = plan.guidance
    somewhere = np.array([[1.0, 1.0, 1.0, 1.0]])
    route = Route(somewhere, 1.0, plan.limits.build_up, *plan.limits[:3])
    for one in (guidance, guidance._replace(route=None), guidance._replace(route=route)):
        other = plan._replace(guidance=one, selection=None)
        now = next_followed(start_followed(state, 0, other), state, 1, other)
        now = next_followed(now, state, 2, other._replace(selection=Selection(1.0, 1.0, 1.0)))
        next_followed(now, state, 3, other)
