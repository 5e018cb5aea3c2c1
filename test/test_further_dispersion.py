# Copyright 2026 ahv developers, Apache-2.0
"""Each dispersion beyond the report's nine multiplies what it names, and nothing else."""

import math

import pytest
from hypothesis import given

from ahv_analysis.flight.case import load_case
from ahv_plant.dispersion import NOMINAL, FurtherDispersion, Truth, disperse_air, in_calm
from ahv_plant.hardware.wind import Wind
from ahv_plant.model.aerodynamics import air_data
from ahv_plant.model.constants import GRAVITY, MAXIMUM_THRUST, SPECIFIC_IMPULSE
from ahv_plant.model.mass import inertia
from ahv_plant.model.vectors import Surfaces
from ahv_plant.trim import trim
from ahv_plant.vehicle import state_rate
from test.flights import STATES, SURFACES, between

pytestmark = pytest.mark.unit

FACTORS = between(0.5, 1.5)
NEUTRAL = Surfaces(0.0, 0.0, 0.0)


def rate_of(state, surfaces, throttle=0.0, **further):
    truth = Truth(further=FurtherDispersion(**further)) if further else NOMINAL
    return state_rate(state, surfaces, throttle, 0.0, truth)


def level(state):
    """At rest in attitude, so that rates are forces and moments, and gravity is along w."""
    return state._replace(phi=0.0, theta=0.0, P=0.0, Q=0.0, R=0.0)


def accelerations(rate):
    """Those of the forces [m/s^2] and moments [rad/s^2] of a level vehicle."""
    return [rate.u, rate.v, rate.w - GRAVITY, rate.P, rate.Q, rate.R]


def scaled(values, factor):
    return pytest.approx([factor * value for value in values], rel=1e-9, abs=1e-9)


@given(STATES, SURFACES, between(0.1, 0.9))
def test_the_nominal_values_change_nothing(state, surfaces, throttle):
    nominal = Truth(further=FurtherDispersion())
    assert state_rate(state, surfaces, throttle, 0.0, nominal) == state_rate(
        state, surfaces, throttle, 0.0, NOMINAL
    )


@given(STATES, SURFACES, FACTORS)
def test_all_that_the_air_does_is_in_proportion_to_its_density(state, surfaces, factor):
    still = level(state)
    thin = accelerations(rate_of(still, surfaces, density=factor))
    assert thin == scaled(accelerations(rate_of(still, surfaces)), factor)


@given(STATES, FACTORS)
def test_the_speed_of_sound_goes_with_the_root_of_the_temperature(state, factor):
    nominal = air_data(state, False)
    hot = disperse_air(nominal, FurtherDispersion(temperature=factor))
    assert hot.mach == pytest.approx(nominal.mach / math.sqrt(factor), rel=1e-14)
    assert hot == nominal._replace(mach=hot.mach)


@given(STATES, SURFACES, FACTORS)
def test_warm_air_is_flown_through_like_standard_air_at_a_lower_mach_number(
    state, surfaces, factor
):
    """The same Mach number and dynamic pressure by another speed and density: the same forces."""
    still = level(state)
    fast = still._replace(u=2.0 * still.u, v=2.0 * still.v, w=2.0 * still.w)
    other = rate_of(fast, surfaces, temperature=4.0 * factor, density=0.25)
    assert accelerations(other) == scaled(
        accelerations(rate_of(still, surfaces, temperature=factor)), 1.0
    )


@given(STATES, SURFACES, between(0.1, 0.9), FACTORS)
def test_the_engine_gives_its_multiple_of_thrust_for_as_much_more_fuel(
    state, surfaces, throttle, factor
):
    off = rate_of(state, surfaces)
    on = rate_of(state, surfaces, throttle, thrust=factor)
    thrust = factor * throttle * MAXIMUM_THRUST
    assert on.u - off.u == pytest.approx(thrust / state.mass, rel=1e-9)
    assert on.mass == pytest.approx(-thrust / (SPECIFIC_IMPULSE * GRAVITY), rel=1e-12)
    assert on._replace(u=off.u, mass=off.mass) == off


@given(STATES, SURFACES, between(0.1, 0.9), FACTORS)
def test_forces_move_a_heavier_vehicle_less_and_moments_as_before(
    state, surfaces, throttle, factor
):
    still = level(state)
    nominal = rate_of(still, surfaces, throttle)
    heavy = rate_of(still, surfaces, throttle, mass=factor)
    assert accelerations(heavy)[:3] == scaled(accelerations(nominal)[:3], 1.0 / factor)
    assert heavy[3:] == nominal[3:]
    assert heavy.mass == nominal.mass


@given(STATES, SURFACES, between(-1.0, 1.0))
def test_a_shifted_centre_of_gravity_gives_the_forces_an_arm(state, surfaces, shift):
    still = level(state)
    nominal = rate_of(still, surfaces)
    shifted = rate_of(still, surfaces, X_cg=shift)
    body = inertia(still.mass)
    Fy, Fz = still.mass * nominal.v, still.mass * (nominal.w - GRAVITY)
    assert pytest.approx(-shift * Fz / body.Iyy, rel=1e-9, abs=1e-12) == shifted.Q - nominal.Q
    assert pytest.approx(shift * Fy / body.Izz, rel=1e-9, abs=1e-12) == shifted.R - nominal.R
    assert shifted._replace(Q=nominal.Q, R=nominal.R) == nominal


@pytest.mark.parametrize("name", Surfaces._fields)
@given(STATES, FACTORS)
def test_a_surface_has_its_multiple_of_the_effect(name, state, factor):
    """By the ratio of what a small deflection to either side does, and of that surface alone."""
    still = level(state)

    def effect(moved, **further):
        up = accelerations(rate_of(still, NEUTRAL._replace(**{moved: 1e-3}), **further))
        down = accelerations(rate_of(still, NEUTRAL._replace(**{moved: -1e-3}), **further))
        return [one - other for one, other in zip(up, down, strict=True)]

    for moved in Surfaces._fields:
        weight = factor if moved == name else 1.0
        expected = [weight * one for one in effect(moved)]
        assert effect(moved, **{name: factor}) == pytest.approx(expected, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize(
    "further",
    [{"mass": 1.1}, {"thrust": 0.8}, {"density": 0.9}, {"X_cg": 0.2}, {"left_elevon": 0.8}],
    ids=str,
)
def test_a_dispersed_vehicle_is_trimmed_with_its_own_weight_and_thrust(further):
    """All seven rates vanish: also that of u, with the throttle that the trim gives."""
    found = trim(truth=Truth(further=FurtherDispersion(**further)))
    if "left_elevon" in further:  # one elevon is weaker: level flight needs unequal ones
        assert not found.converged
    else:
        assert found.converged and found.throttle != trim().throttle


def test_further_dispersions_are_there_if_asked_for():
    assert load_case("nominal_di").plant.truth.further is None
    asked = {"dispersion.mass": 1.1, "dispersion.X_cg": -0.1, "dispersion.CL": 0.9}
    truth = load_case("nominal_di", asked).plant.truth
    assert truth.further == FurtherDispersion(mass=1.1, X_cg=-0.1)
    assert truth.dispersion.CL == 0.9


def test_a_trim_is_sought_without_wind_and_disturbance_on_the_vehicle_as_it_is():
    vehicle = Truth(further=FurtherDispersion(mass=1.1))
    assert in_calm(vehicle._replace(wind=Wind())) == vehicle
