# Copyright 2026 ahv developers, Apache-2.0
"""The wind acts through the velocity against the air, with the shapes and spectra it is given."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.signal import welch

from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.flight.case import load_case
from ahv_plant.dispersion import NOMINAL, FurtherDispersion, Truth, in_calm
from ahv_plant.hardware.wind import (
    CALM,
    Gust,
    SteadyWind,
    TurbulentAir,
    Wind,
    add_gust,
    steady_wind,
    through_air,
    turbulence_of,
    turbulence_step,
)
from ahv_plant.model.aerodynamics import Loads, air_data
from ahv_plant.model.constants import STEP
from ahv_plant.model.mass import inertia
from ahv_plant.model.rigid_body import motion
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.vehicle import state_rate, vehicle_step
from test.flights import CRUISE, STATES, SURFACES, between

unit = pytest.mark.unit
WINDS = st.builds(
    SteadyWind,
    north=between(-100.0, 100.0),
    east=between(-100.0, 100.0),
    altitude=between(10000.0, 40000.0),
    shear_north=between(-0.02, 0.02),
    shear_east=between(-0.02, 0.02),
)
GUST = Gust(u=-3.0, v=8.0, w=20.0, start=2.0, duration=0.5)
TRIMMED = Surfaces(-0.126, -0.126, 0.0)


def moved_by(state, air):
    """The state of a vehicle whose velocity over the ground has the air's added."""
    return state._replace(u=state.u + air.u, v=state.v + air.v, w=state.w + air.w)


# Steady wind


@unit
@given(STATES, WINDS)
def test_a_vehicle_that_drifts_with_the_air_moves_over_the_ground_as_the_wind_says(state, wind):
    """By the kinematics of the rigid body, which know nothing of wind."""
    air = steady_wind(state, wind)
    drifting = state._replace(**air._asdict())
    rate = motion(drifting, Loads(*[0.0] * 6), 0.0, inertia(state.mass))
    above = state.h - wind.altitude
    assert (rate.x, rate.y, rate.h) == pytest.approx(
        (wind.north + wind.shear_north * above, wind.east + wind.shear_east * above, 0.0), abs=1e-9
    )


@unit
@given(STATES, WINDS)
def test_a_vehicle_that_moves_with_the_air_feels_no_wind(state, wind):
    air = Wind(steady=wind)
    felt = through_air(moved_by(state, steady_wind(state, wind)), 0.0, None, air)
    assert felt == pytest.approx(state, rel=1e-12, abs=1e-9)


@unit
@settings(max_examples=10)
@given(between(-100.0, 100.0), between(-100.0, 100.0))
def test_a_flight_in_constant_wind_is_that_in_still_air_seen_from_a_moving_frame(north, east):
    """Galilei: the same air data, attitude and rates; what differs is the way over the ground."""
    wind = SteadyWind(north, east, 24000.0, 0.0, 0.0)
    truth, surfaces = Truth(wind=Wind(steady=wind)), Surfaces(-0.12, -0.13, 0.02)
    still = CRUISE._replace(phi=0.2, psi=1.0, P=0.02)
    moving = moved_by(still, steady_wind(still, wind))
    for step in range(200):
        still = State(*vehicle_step(still, surfaces, 0.3, step * STEP, NOMINAL))
        moving = State(*vehicle_step(moving, surfaces, 0.3, step * STEP, truth))
    felt = State(*through_air(moving, 2.0, None, truth.wind))
    assert air_data(felt, False) == pytest.approx(air_data(still, False), rel=1e-10, abs=1e-10)
    drifted = still._replace(x=still.x + 2.0 * north, y=still.y + 2.0 * east)
    assert felt == pytest.approx(drifted, rel=1e-10, abs=1e-9)


@unit
@given(STATES, SURFACES)
def test_air_that_stands_still_is_no_wind(state, surfaces):
    calm = Truth(wind=Wind(SteadyWind(0.0, 0.0, 0.0, 0.0, 0.0), Gust(0.0, 0.0, 0.0, 0.0, 1.0)))
    rate = state_rate(state, surfaces, 0.3, 0.5, NOMINAL)
    assert state_rate(state, surfaces, 0.3, 0.5, calm) == rate
    assert state_rate(state, surfaces, 0.3, 0.5, Truth(wind=Wind()), CALM) == rate


# Gust


@unit
@given(between(0.0, 4.0))
def test_a_gust_has_the_profile_of_one_minus_cosine(time):
    within = GUST.start <= time <= GUST.start + GUST.duration
    angle = 2.0 * math.pi * (time - GUST.start) / GUST.duration
    share = 0.5 * (1.0 - math.cos(angle)) if within else 0.0
    felt = State(*through_air(CRUISE, time, None, Wind(gust=GUST)))
    assert felt[:3] == pytest.approx(
        (CRUISE.u - share * GUST.u, CRUISE.v - share * GUST.v, CRUISE.w - share * GUST.w),
        abs=1e-9,
    )
    assert felt[3:] == CRUISE[3:]


@unit
def test_a_gust_has_its_peak_at_half_its_length():
    still = steady_wind(CRUISE, None)
    assert tuple(add_gust(still, 2.25, GUST)) == pytest.approx((-3.0, 8.0, 20.0), abs=1e-12)
    assert tuple(add_gust(still, 2.5, GUST)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


@unit
def test_a_gust_from_below_raises_the_angle_of_attack_and_the_vehicle():
    updraught = Truth(wind=Wind(gust=Gust(0.0, 0.0, -20.0, -0.5, 1.0)))  # at its peak at 0
    calm = state_rate(CRUISE, TRIMMED, 0.3, 0.0, NOMINAL)
    lifted = state_rate(CRUISE, TRIMMED, 0.3, 0.0, updraught)
    steeper = State(*through_air(CRUISE, 0.0, None, updraught.wind))
    assert air_data(steeper, False).alpha - air_data(CRUISE, False).alpha == pytest.approx(
        20.0 / 1786.4, rel=0.01
    )
    assert lifted.w < calm.w - 1.0  # [m/s^2] w is down


# Turbulence

LENGTH = 1750.0 * 0.3048  # [m]


def along_spectrum(omega, sigma, speed):
    """One-sided spectrum of u [m^2/s^2/(rad/s)] of MIL-F-8785C, in the frequency omega."""
    per_wave = LENGTH / speed
    return sigma**2 * 2.0 * per_wave / math.pi / (1.0 + (per_wave * omega) ** 2)


def across_spectrum(omega, sigma, speed):
    """The same of v and w."""
    per_wave = LENGTH / speed
    square = (per_wave * omega) ** 2
    return sigma**2 * per_wave / math.pi * (1.0 + 3.0 * square) / (1.0 + square) ** 2


SPECTRA = {"u": along_spectrum, "v": across_spectrum, "w": across_spectrum}


@kernel
def turbulent_flight(noise, turbulence, result):
    air = CALM
    for step in range(len(noise)):
        air = turbulence_step(air, (noise[step, 0], noise[step, 1], noise[step, 2]), turbulence)
        result[step, 0], result[step, 1], result[step, 2] = air.u, air.v, air.w


@pytest.fixture(scope="module", params=[(2.0, 1786.4), (5.0, 3000.0)])
def turbulent(request):
    """Three hours of turbulence (N, 3), its strength [m/s] and the speed [m/s]."""
    sigma, speed = request.param
    noise = np.random.default_rng(3).standard_normal((2**20, 3))
    result = np.empty_like(noise)
    turbulent_flight(noise, turbulence_of(sigma, speed), result)
    return result, sigma, speed


@unit
@pytest.mark.compiled
@pytest.mark.parametrize("axis", "uvw")
def test_turbulence_has_the_spectrum_of_the_specification(turbulent, axis):
    """Of what is sampled at 100 Hz: each frequency has those above 50 Hz that look like it."""
    flown, sigma, speed = turbulent
    rate, length = 1.0 / STEP, 4096
    frequency, found = welch(flown[:, "uvw".index(axis)], rate, nperseg=length)
    folded = np.abs(frequency[:, None] + rate * np.arange(-400, 401))
    # from rad/s to Hz, each of two sides
    two_sided = math.pi * SPECTRA[axis](2.0 * math.pi * folded, sigma, speed)
    ratio = found[2:-1] / (2.0 * two_sided.sum(axis=1))[2:-1]
    segments = 2 * len(flown) / length
    scatter = 1.06 / math.sqrt(segments)  # of one frequency; neighbours share some of it
    bands = ratio[: len(ratio) // 15 * 15].reshape(-1, 15).mean(axis=1)
    assert np.abs(bands - 1.0).max() < 5.0 * scatter * math.sqrt(2.0 / 15.0)
    assert bands.mean() == pytest.approx(1.0, abs=0.005)


@unit
@pytest.mark.compiled
def test_turbulence_has_its_strength_on_every_axis_and_ties_none_to_another(turbulent):
    flown, sigma, _ = turbulent
    covariance = np.cov(flown.T) / sigma**2
    assert covariance == pytest.approx(np.eye(3), abs=0.03)
    assert flown.mean(axis=0) / sigma == pytest.approx(np.zeros(3), abs=0.03)


@unit
@pytest.mark.parametrize("axis", "uv")
def test_the_filters_are_discretised_exactly(axis):
    """What they make of white noise is correlated as the cosine transform of the spectrum says."""
    sigma, speed = 2.0, 1786.4
    turbulence = turbulence_of(sigma, speed)
    response, air = [], CALM
    for step in range(1200):
        air = turbulence_step(air, (1.0, 1.0, 1.0) if step == 0 else (0.0, 0.0, 0.0), turbulence)
        response.append((air.u, air.v)["uv".index(axis)])
    for lag in (0, 1, 2, 7, 30, 90):
        made = math.fsum(np.multiply(response[lag:], response[: len(response) - lag]))
        if lag == 0:
            meant, _ = quad(SPECTRA[axis], 0.0, math.inf, args=(sigma, speed))
        else:
            meant, _ = quad(
                SPECTRA[axis], 0.0, math.inf, (sigma, speed), weight="cos", wvar=lag * STEP
            )
        assert made == pytest.approx(meant, abs=1e-6), lag


@unit
@given(STATES, SURFACES)
def test_turbulence_acts_like_a_wind_of_its_velocity_through_the_whole_step(state, surfaces):
    air = TurbulentAir(4.0, -3.0, 2.0, 9.0, 9.0)
    shifted = state._replace(u=state.u - 4.0, v=state.v + 3.0, w=state.w - 2.0)
    for time in (0.0, 0.005, 0.01):
        assert through_air(state, time, air, Wind()) == shifted
    turbulent = vehicle_step(state, surfaces, 0.3, 0.0, Truth(wind=Wind()), air)
    same = Gust(4.0, -3.0, 2.0, -1e5, 2e5)  # of a day: at its peak for the step
    assert turbulent == pytest.approx(
        vehicle_step(state, surfaces, 0.3, 0.0, Truth(wind=Wind(gust=same))), rel=1e-9, abs=1e-9
    )


# Settings and engines


@unit
def test_there_is_no_wind_unless_asked_for():
    assert load_case("nominal_di").plant.truth.wind is None
    alone = {"wind.altitude": 10000.0, "gust.start": 3.0, "gust.duration": 2.0}
    assert load_case("nominal_di", alone).plant.truth.wind is None


@unit
def test_each_part_of_the_wind_is_there_if_asked_for():
    def wind(**changes):
        named = {name.replace("__", "."): value for name, value in changes.items()}
        return load_case("nominal_di", named | {"initial.u": 1800.0}).plant.truth.wind

    steady = SteadyWind(0.0, 30.0, 24000.0, 0.005, 0.0)
    assert wind(wind__east=30.0, wind__shear_north=0.005) == Wind(steady=steady)
    assert wind(gust__w=-9.0, gust__start=3.0) == Wind(gust=Gust(0.0, 0.0, -9.0, 3.0, 1.0))
    assert wind(turbulence__sigma=2.0) == Wind(turbulence=turbulence_of(2.0, 1800.0))


def test_a_flight_in_wind_is_the_same_alone_and_in_a_lane():
    """With every dispersion beyond the nine as well."""
    gust = {"gust.v": 8.0, "gust.w": 20.0, "gust.start": 2.0}
    wind = {"wind.north": 20.0, "wind.east": 30.0, "wind.shear_east": 0.01}
    further = FurtherDispersion(1.1, 0.1, 0.9, 1.05, 1.1, 0.9, 0.95, 0.8)
    vehicle = {f"dispersion.{name}": value for name, value in further._asdict().items()}
    changes = {"duration": 6.0} | gust | wind | vehicle
    campaign = Campaign(load_case("neuro_adaptive_di", changes), 0.2, 5, 1)
    flown = fly_runs(campaign, 0, campaign.runs)
    for run in range(campaign.runs):
        again = fly_again(campaign, run)
        assert all(again[name].tobytes() == flown[name][[run]].tobytes() for name in flown)
    calm = campaign.case_of(0)
    calm = calm._replace(plant=calm.plant._replace(truth=in_calm(calm.plant.truth)))
    assert fly_alone(calm).max_abs_beta < 0.1 * math.radians(flown["max_abs_beta_deg"][0])
