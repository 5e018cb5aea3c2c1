# Copyright 2026 ahv developers, Apache-2.0
"""The equations of motion against NASA's check case, conservation laws and their general form."""

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ahv_plant.model.aerodynamics import Loads
from ahv_plant.model.constants import GRAVITY, STEP
from ahv_plant.model.mass import Inertia
from ahv_plant.model.rigid_body import angular_acceleration, motion
from test.flights import STATES, between

pytestmark = pytest.mark.unit

SLUG_FT2 = 1.3558179483314004  # [kg m^2]
BRICK = Inertia(*(value * SLUG_FT2 for value in (0.001894220, 0.006211019, 0.007194665)))


def tumble(rates, steps):
    """Body rates [rad/s] after torque-free steps of 0.01 s, by Runge-Kutta."""

    def rate(now):
        return np.array(
            angular_acceleration(*(float(value) for value in now), 0.0, 0.0, 0.0, BRICK)
        )

    for _ in range(steps):
        k1 = rate(rates)
        k2 = rate(rates + 0.5 * STEP * k1)
        k3 = rate(rates + 0.5 * STEP * k2)
        k4 = rate(rates + STEP * k3)
        rates = rates + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return rates


@pytest.mark.parametrize("simulation", ["01", "04"])
def test_tumbling_brick_of_nasa_check_case_2(simulation):
    with open(Path(__file__).parent / "data" / "nesc" / f"Atmos_02_sim_{simulation}.csv") as file:
        rows = [[float(value) for value in row.values()] for row in csv.DictReader(file)]
    assert len(rows) == 301
    rates = np.radians([10.0, 20.0, 30.0])
    for row in rows[1:]:
        rates = tumble(rates, 10)
        assert np.degrees(rates) == pytest.approx(row[1:], abs=1e-9), f"at {row[0]} s"


@given(*[between(-1.0, 1.0)] * 3, *[between(-1e6, 1e6)] * 3, *[between(1e6, 1e7)] * 3)
def test_eq_2_3_in_its_general_form_with_no_cross_inertia(P, Q, R, L, M, N, Ixx, Iyy, Izz):
    Ixz = 0.0
    G = Ixx * Izz - Ixz**2
    c1 = ((Iyy - Izz) * Izz - Ixz**2) / G
    c2 = (Ixx - Iyy + Izz) * Ixz / G
    c3, c4, c7, c9 = Izz / G, Ixz / G, 1 / Iyy, Ixx / G
    c5, c6 = (Izz - Ixx) / Iyy, Ixz / Iyy
    c8 = (Ixx * (Ixx - Iyy) + Ixz**2) / G
    expected = (
        c1 * Q * R + c2 * P * Q + c3 * L + c4 * N,
        c5 * P * R - c6 * (P**2 - R**2) + c7 * M,
        c8 * P * Q - c2 * Q * R + c4 * L + c9 * N,
    )
    found = angular_acceleration(P, Q, R, L, M, N, Inertia(Ixx, Iyy, Izz))
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


@given(*[between(-1.0, 1.0)] * 3)
def test_a_torque_free_body_keeps_its_energy(P, Q, R):
    body = Inertia(1.4e6, 1.3e7, 1.5e7)
    rates = angular_acceleration(P, Q, R, 0.0, 0.0, 0.0, body)
    power = sum(i * rate * dot for i, rate, dot in zip(body, (P, Q, R), rates, strict=True))
    assert power == pytest.approx(0.0, abs=1e-8 * max(body))


def earth_from_body(state):
    return Rotation.from_euler("ZYX", (state.psi, state.theta, state.phi))


BODY = Inertia(1.4e6, 1.3e7, 1.3e7)
FORCES = st.builds(Loads, *[between(-1e6, 1e6)] * 3, *[st.just(0.0)] * 3)


@given(STATES)
def test_position_moves_with_the_velocity_in_earth_axes(state):
    rate = motion(state, Loads(*[0.0] * 6), 0.0, BODY)
    north, east, down = earth_from_body(state).apply((state.u, state.v, state.w))
    assert (rate.x, rate.y, -rate.h) == pytest.approx((north, east, down), abs=1e-9)


@given(STATES, FORCES)
def test_newton_holds_in_earth_axes(state, forces):
    """Acceleration in Earth axes is force by mass plus gravity (erratum of eq 2.1)."""
    rate = motion(state, forces, 0.0, BODY)
    spin, velocity = (state.P, state.Q, state.R), (state.u, state.v, state.w)
    in_body = np.array((rate.u, rate.v, rate.w)) + np.cross(spin, velocity)
    expected = earth_from_body(state).apply(np.array(forces[:3]) / state.mass)
    expected = expected + np.array((0.0, 0.0, GRAVITY))
    assert earth_from_body(state).apply(in_body) == pytest.approx(expected, abs=1e-9)


@given(STATES)
def test_attitude_turns_with_the_body_rates(state):
    rate = motion(state, Loads(*[0.0] * 6), 0.0, BODY)
    step = 1e-6
    later = state._replace(
        **{
            name: getattr(state, name) + step * getattr(rate, name)
            for name in ("phi", "theta", "psi")
        }
    )
    turn = (earth_from_body(state).inv() * earth_from_body(later)).as_rotvec() / step
    assert turn == pytest.approx((state.P, state.Q, state.R), abs=1e-5)
