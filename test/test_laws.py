# Copyright 2026 ahv developers, Apache-2.0
"""Laws of others: each against something that is not itself."""

import ast
from itertools import pairwise
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from ahv_control.laws import eso, indi, lqi, network, sliding_mode
from ahv_control.laws._lqi_gains import CORNERS
from ahv_control.newton_raphson import nominal_response, solve_surfaces
from ahv_control.reference import held
from ahv_plant.dispersion import Dispersion, Truth
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import RADIANS, STEP, UNSTART_ALPHA
from ahv_plant.model.vectors import Controls, Measurement, Rates, Surfaces
from ahv_plant.plant import plant_step, start_plant
from ahv_plant.trim import trim
from ahv_plant.vehicle import state_rate
from studies import lqi_gains, network_weights

pytestmark = pytest.mark.unit

LAWS = (eso, indi, lqi, network, sliding_mode)
CRUISE = held(24000.0, 1786.4)
STATE = trim().state._replace(P=0.01, Q=-0.02, R=0.01, v=5.0)


def flown(law, settings, truth, steps, state=STATE):
    """Measurements and commands of a flight on ideal hardware; the last memory."""
    control, plant = law.design(settings), start_plant(state, truth, None, None)
    memory, commands = law.start(plant.measured, CRUISE, control)
    kept = [(plant.measured, commands)]
    for number in range(steps):
        told = Controls(commands.surfaces, commands.throttle)
        later = plant_step(plant, told, number, truth, None, None)
        memory, commands = law.step(
            memory, plant.measured, commands, later.measured, CRUISE, control
        )
        plant = later
        kept.append((plant.measured, commands))
    return kept, memory


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_a_law_is_a_file_of_at_most_150_lines_that_cites_a_paper(law):
    text = Path(law.__file__).read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    assert any(str(year) in ast.get_docstring(ast.parse(text)) for year in range(1970, 2027))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_every_law_brings_an_upset_vehicle_back(law):
    upset = Truth(dispersion=Dispersion(CL=1.1, Cm=0.8, Iyy=1.2))
    kept, _ = flown(law, law.Settings(), upset, 1500)
    alpha = np.array([np.arctan2(now.state.w, now.state.u) for now, _ in kept])
    assert max(abs(alpha)) < UNSTART_ALPHA
    last = kept[-1][0].state
    assert max(abs(last.P), abs(last.Q), abs(last.R)) < 0.1 * RADIANS
    assert abs(last.phi) < 2.0 * RADIANS


# linear-quadratic


@pytest.fixture(scope="module")
def linear():
    """Both motions, sampled, with gains and S, at the corner that is heavy and fast."""
    speed = CORNERS.fast * atmosphere(lqi.ALTITUDE, False).sound_speed
    motions = lqi_gains.linearised(trim(lqi.ALTITUDE, speed, CORNERS.heavy))
    by = lqi_gains.WEIGHTS
    scales = (
        (np.array(by.states), np.array([by.elevons, by.throttle])),
        (np.array(by.sideways), np.array([by.difference, by.rudder])),
    )
    return [
        (lqi_gains.sampled(motion), *lqi_gains.gains(motion, *scale), *scale)
        for motion, scale in zip(motions, scales, strict=True)
    ]


def test_the_gains_of_the_package_solve_riccati_s_equation(linear):
    corner = CORNERS.heavy_fast
    kept = (
        np.array([corner.elevons_by, corner.throttle_by]),
        np.array([corner.difference_by, corner.rudder_by]),
    )
    for K, (model, _, S, states, commands) in zip(kept, linear, strict=True):
        # value iteration by hand: the cost of flying on with K is S itself, only if K is optimal
        closed = model.A - model.B @ K
        cost = np.diag(states**-2.0) + K.T @ np.diag(commands**-2.0) @ K
        size = np.sqrt(np.outer(np.diag(S), np.diag(S)))
        assert np.max(np.abs(closed.T @ S @ closed + cost - S) / size) < 1e-6


def test_the_linear_vehicle_is_unstable_and_stable_with_the_gains(linear):
    for model, K, _, _, _ in linear:
        assert max(abs(np.linalg.eigvals(model.A))) > 1.005
        assert max(abs(np.linalg.eigvals(model.A - model.B @ K))) < 1.0 - 1e-5


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_between_the_corners_too_the_closed_loop_is_stable(share):
    mass = CORNERS.light + share * (CORNERS.heavy - CORNERS.light)
    mach = CORNERS.slow + share * (CORNERS.fast - CORNERS.slow)
    at = trim(lqi.ALTITUDE, mach * atmosphere(lqi.ALTITUDE, False).sound_speed, mass)
    corners = (
        CORNERS.light_slow,
        CORNERS.light_fast,
        CORNERS.heavy_slow,
        CORNERS.heavy_fast,
    )
    weights = ((1 - share) ** 2, (1 - share) * share, share * (1 - share), share**2)
    names = ("elevons_by", "throttle_by", "difference_by", "rudder_by")
    rows = [
        sum(
            weight * np.array(getattr(c, name)) for weight, c in zip(weights, corners, strict=True)
        )
        for name in names
    ]
    for motion, K in zip(lqi_gains.linearised(at), (rows[:2], rows[2:]), strict=True):
        model = lqi_gains.sampled(motion)
        assert max(abs(np.linalg.eigvals(model.A - model.B @ np.array(K)))) < 1.0


def test_a_scalar_riccati_equation_has_its_closed_form():
    # x_dot = u with equal weights: in continuous time K = 1 / (ratio), here to first order of STEP
    one = lqi_gains.Linear(np.zeros((1, 1)), np.ones((1, 1)))
    K, _ = lqi_gains.gains(one, np.array([2.0]), np.array([6.0]))
    r, q, T = 36.0**-1, 4.0**-1, STEP
    S = (q + sqrt(q * q + 4.0 * q * r / T**2)) / 2.0  # of S = S - S^2 T^2 / (r + S T^2) + q
    assert K[0, 0] == pytest.approx(S * T / (r + S * T * T), rel=1e-9)


def test_in_its_trim_the_linear_law_answers_the_trim():
    at = trim(24000.0, CORNERS.fast * atmosphere(24000.0, False).sound_speed, CORNERS.heavy)
    measured = Measurement(at.state, at.surfaces)
    _, commands = lqi.start(measured, held(24000.0, at.state.u), lqi.design(lqi.Settings()))
    assert commands.surfaces == pytest.approx(at.surfaces, abs=2e-5)
    assert commands.throttle == pytest.approx(at.throttle, abs=2e-4)


# incremental inversion


def test_where_the_model_is_exact_incremental_is_plain_inversion_to_first_order_of_the_step():
    quick = indi.Settings(omega_f=900.0)  # no filter
    kept, _ = flown(indi, quick, Truth(), 100)
    gain, worst = indi.design(quick).gain, 0.0
    for (_, last), (now, answered) in pairwise(kept[20:]):
        state = now.state
        demand = indi.wanted(state, answered.rates, gain)
        plain = solve_surfaces(state, demand, last.surfaces, False).surfaces
        change = max(abs(np.subtract(answered.surfaces, last.surfaces)))
        # the acceleration is that of half a step ago: one more half of what changes in a step
        worst = max(worst, *(abs(np.subtract(answered.surfaces, plain)) - 2.0 * change))
    assert worst < 1e-5


def test_an_increment_needs_of_the_model_its_slopes_alone():
    at = Surfaces(-0.1, -0.12, 0.01)
    model = nominal_response(STATE, at, False)
    shifted = Rates(model.P + 0.3, model.Q - 0.2, model.R + 0.1)  # a vehicle that does otherwise
    wanted = Rates(shifted.P + 0.01, shifted.Q + 0.02, shifted.R - 0.01)
    found = indi.increment(STATE, wanted, shifted, at, False).surfaces
    gained = np.subtract(nominal_response(STATE, found, False), model)
    assert gained == pytest.approx([0.01, 0.02, -0.01], abs=4e-4)


# extended state observer


def test_the_observer_finds_a_constant_disturbance_with_the_pole_of_its_design():
    pole, planted = eso.design(eso.Settings()).pole, 0.3  # [rad/s^2]
    assert pole == pytest.approx(np.exp(-eso.Settings().omega_o * STEP), rel=1e-12)
    x = rate = d = 0.0
    errors = []
    for _ in range(60):
        rate += STEP * (planted + 0.1)  # 0.1 the model knows of
        x, d = eso.observed(x, d, 0.1, rate, pole)
        errors.append(planted - d)
    # two poles at `pole` leave (1 + a k) pole^k: linear once the power is taken out
    scaled = np.array(errors) / pole ** np.arange(1, 61) / planted
    bent = np.diff(scaled, 2)
    assert np.max(np.abs(bent)) < 1e-8 * np.max(np.abs(scaled))
    assert abs(errors[-1]) < 1e-4 * planted


def test_in_flight_the_observer_finds_what_the_dispersion_does():
    dispersed = Truth(dispersion=Dispersion(Cm=0.8))
    kept, memory = flown(eso, eso.Settings(), dispersed, 300)
    before, commands = kept[-2]
    surfaces = commands.surfaces
    true = state_rate(before.state, surfaces, commands.throttle, 0.0, dispersed)
    nominal = nominal_response(before.state, surfaces, False)
    found = memory.disturbance.Q
    assert found == pytest.approx(true.Q - nominal.Q, abs=2e-4)
    assert abs(found) > 0.01


# sliding mode


def test_super_twisting_takes_a_disturbed_scalar_plant_to_zero_in_finite_time():
    L, phi = 1.0, 1e-12  # so narrow a layer is none
    s, v, sizes = 0.2, 0.0, []
    for number in range(1000):
        disturbance = 0.5 * np.sin(number * STEP)  # changes at 0.5 rad/s^3 at most
        s, v = (
            s + STEP * (sliding_mode.reaching(s, v, L, phi) + disturbance),
            sliding_mode.twisted(s, v, L, phi),
        )
        sizes.append(abs(s))
    # Levant: in discrete time what is left goes with the square of the step, and no longer falls
    reached = next(n for n in range(1000) if max(sizes[n:]) < 10.0 * STEP**2)
    assert 0.1 < reached * STEP < 3.0


def test_a_linear_law_as_strong_leaves_the_error_that_super_twisting_does_not():
    L, phi = 1.0, 1e-12
    omega, left = 3.5, {}
    for name in ("super-twisting", "linear"):
        s, v, sizes = 0.2, 0.0, []
        for number in range(2000):
            if name == "linear":
                demand = v - 1.5 * omega * s
                following = v - STEP * 1.1 * omega**2 * s
            else:
                demand = sliding_mode.reaching(s, v, L, phi)
                following = sliding_mode.twisted(s, v, L, phi)
            s, v = s + STEP * (demand + 0.5 * np.sin(number * STEP)), following
            sizes.append(abs(s))
        left[name] = max(sizes[1000:])
    assert left["super-twisting"] < 0.2 * left["linear"]


def test_within_its_layer_the_sliding_law_is_linear_with_the_frequency_of_its_settings():
    settings = sliding_mode.Settings()
    design, s = sliding_mode.design(settings), 1e-9
    slope = -sliding_mode.reaching(s, 0.0, design.L, design.phi) / s
    growth = -sliding_mode.twisted(s, 0.0, design.L, design.phi) / s / STEP
    assert slope == pytest.approx(1.5 * settings.omega, rel=1e-6)
    assert growth == pytest.approx(1.1 * settings.omega**2, rel=1e-6)


# network


def test_the_network_answers_as_its_teacher_does_where_it_was_not_taught():
    fresh = network_weights.drawn(network_weights.SEED + 7, 500)
    told = network.design(network.Settings()).network
    error = np.abs(network.forward(told, fresh) - network_weights.taught(fresh))
    assert np.all(error.mean(0) < [0.001, 0.001, 0.001, 0.001, 0.0002])  # [rad, rad, rad, -, rad]
    assert np.all(error.max(0) < [0.015, 0.015, 0.015, 0.01, 0.001])


def test_the_network_flies_where_its_teacher_flies():
    ways = [
        [now.state for now, _ in flown(law, law.Settings(), Truth(), 1000)[0]]
        for law in (network, lqi)
    ]
    apart = np.max(np.abs(np.subtract(*ways)), axis=0)
    assert apart[11] < 5.0  # [m]
    assert apart[7] < 0.2 * RADIANS
