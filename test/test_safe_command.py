# Copyright 2026 ahv developers, Apache-2.0
"""Vehicles that lose their commands in the worst moment: while they pitch."""

from math import atan2

import pytest

from ahv_analysis.flight.case import dispersion_parameters, load_case
from ahv_analysis.flight.closed_loop import loop_step, start_loop
from ahv_plant.dispersion import draw_dispersion
from ahv_plant.model.constants import DEGREES, RADIANS, STEP
from ahv_plant.model.vectors import State
from ahv_plant.safe_command import level_surfaces, safe_surfaces
from ahv_plant.vehicle import vehicle_step

VEHICLES = 30  # dispersed by 30 %
PITCHING = 1.0  # [deg/s] more than commanded, when the commands stay away
CALM = 500  # steps of flight before that
OUTAGE = 200  # steps


def largest_alpha(run, fall_back):
    """Of the outage of one vehicle [deg]."""
    changes = dispersion_parameters(draw_dispersion(0.3, 11, run))
    case = load_case("neuro_adaptive_sc_gdi", changes)
    truth = case.plant.truth
    loop = start_loop(case.plant.initial, truth, case.control, None, None)
    for number in range(CALM):
        loop = loop_step(loop, number, truth, case.control, None, None)
    held, throttle = loop.commands.surfaces, loop.commands.throttle
    state = loop.plant.state._replace(Q=loop.plant.state.Q + PITCHING * RADIANS * (-1) ** run)
    largest = 0.0
    for step in range(OUTAGE):
        surfaces = held if step <= 20 else fall_back(held, loop.plant.state, state)
        state = State(*vehicle_step(state, surfaces, throttle, (CALM + step) * STEP, truth))
        largest = max(largest, abs(atan2(state.w, state.u)) * DEGREES)
    return largest


@pytest.fixture(scope="module")
def lost():
    """How many leave the 5 deg of the inlet, holding and by the safe command."""

    def holding(held, answered, measured):
        return level_surfaces(held)

    return [
        sum(largest_alpha(run, fall_back) > 5.0 for run in range(VEHICLES))
        for fall_back in (holding, safe_surfaces)
    ]


def test_an_outage_of_two_seconds_loses_no_vehicle(lost):
    assert lost[1] == 0


def test_a_hold_would_lose_a_part_of_them(lost):
    assert lost[0] >= 5
