# Copyright 2026 ahv developers, Apache-2.0
"""Turns: by bank as lift turns the vehicle, by sideslip as its side force does."""

import math

import numpy as np
import pytest

from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_plant.model.aerodynamics import aerodynamic_coefficients, air_data, loads
from ahv_plant.model.constants import DEGREES, GRAVITY, RADIANS
from ahv_plant.model.mass import centre_of_gravity
from ahv_plant.trim import trim
from studies.turns import sideslip, turning

TURN = 0.1 * RADIANS  # [rad/s]


@pytest.fixture(scope="module", params=[True, False], ids=["banked", "by sideslip"])
def turn(request, tmp_path_factory):
    """Whether a turn at a constant rate is banked, and what is flown of it from level flight."""
    level = trim().state
    start = f"u: {level.u!r}, w: {level.w!r}, theta: {level.theta * DEGREES!r}, h: 24000.0"
    path = tmp_path_factory.mktemp("turn") / "case.yaml"
    path.write_text(
        "/**: {ros__parameters: {base: nominal_di, guided: true}}\n"
        f"/**/plant: {{ros__parameters: {{duration: 150.0, initial: {{{start}, "
        "P: 0.0, Q: 0.0, R: 0.0}}}\n"
        "/**/guidance: {ros__parameters: {shape: ramp, heading_changes: '15 at 0 over 150'}}\n"
    )
    record = record_of(fly(turning(load_case(str(path)), request.param)), False)
    assert record.inlet_started
    return request.param, record


def test_a_turn_goes_at_the_rate_that_is_asked_for_and_its_bank_is_that_of_lift(turn):
    """tan phi* = V psi_dot / g, or none; the heading is behind by psi_dot / k_psi."""
    banked, record = turn
    psi = record.column("psi")
    assert (psi[-100] - psi[-1100]) / 10.0 == pytest.approx(TURN, rel=0.02)
    wanted = math.atan(record.column("u")[-100] * TURN / GRAVITY) if banked else 0.0
    assert record.column("phi")[-100] == pytest.approx(wanted, abs=0.2 * RADIANS)
    assert record.references[-100, 3] - psi[-100] == pytest.approx(TURN / 0.2, rel=0.05)


def test_the_sideslip_of_a_turn_is_that_of_its_balance_of_forces(turn):
    """None worth the name where lift turns the vehicle; else the one whose side force does."""
    banked, record = turn
    place = len(record.stamps) - 100
    there = (float(record.column(name)[place]) for name in ("h", "u", "mass"))
    expected = 0.0 if banked else sideslip(TURN, *there)
    assert record.air.beta[place] == pytest.approx(expected, abs=0.1 * RADIANS)
    assert banked or expected * DEGREES < -1.0


def test_the_side_force_of_a_sideslip_is_that_of_the_turn():
    """m V psi_dot = Y: the balance of the study, by another way than its equations of motion."""
    level = trim()
    beta = sideslip(TURN, 24000.0, level.state.u, level.state.mass)
    slipping = level.state._replace(v=level.state.u * math.tan(beta))
    air = air_data(slipping, False)
    forces = loads(
        air,
        aerodynamic_coefficients(air, slipping, level.surfaces),
        centre_of_gravity(slipping.mass),
    )
    # what the rudder adds, which holds the nose in the slip, is a part of it
    assert forces.Fy == pytest.approx(slipping.mass * level.state.u * TURN, rel=0.1)
    assert np.sign(forces.Fy) == 1.0, "to the right, as the turn"
