# Copyright 2026 ahv developers, Apache-2.0
"""Flights in wind: the same by every engine, and judged by the air that the vehicle meets."""

from itertools import islice
from math import atan, atan2, hypot

import numpy as np
import pytest

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.closed_loop import loop_step, start_loop
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.flight.outcome import Cause
from ahv_plant.hardware.noise import GUSTS, NoiseStream
from ahv_plant.hardware.wind import CALM, through_air, turbulence_step
from ahv_plant.model.constants import RADIANS, UNSTART_ALPHA
from ahv_plant.model.vectors import State
from ahv_plant.plant import all_draws, rig

TURBULENT = {"turbulence.sigma": 1.0, "noise.seed": 11, "noise.run": 1, "duration": 12.0}
ROUGH = TURBULENT | {
    "wind.north": -30.0,
    "wind.shear_east": 0.01,
    "gust.w": -5.0,
    "gust.start": 2.0,
    "actuator.elevons.order": 2,
    "latency.delay": 0.01,
    "latency.jitter": 0.2,
    "sensor.Q.noise": 0.02,
    "sensor.alpha.noise": 0.01,
    "sensor.speed.time_constant": 0.05,
    "air_data_sensors": True,
}


def loops(case):
    """Every loop of a flight."""
    plant, control = case.plant, case.control
    equipped = rig(plant.hardware)
    draws = all_draws(plant.hardware, plant.truth.wind, *plant.noise)
    loop = start_loop(plant.initial, plant.truth, control, next(draws), equipped)
    yield loop
    for number in range(plant.steps):
        loop = loop_step(loop, number, plant.truth, control, next(draws), equipped)
        yield loop


@pytest.mark.parametrize("random_starts", [False, True])
def test_a_run_in_turbulence_is_the_same_in_a_lane_alone_and_step_by_step(random_starts):
    campaign = Campaign(load_case("neuro_adaptive_sc_gdi", ROUGH), 0.1, 3, 11, random_starts)
    rows = fly_runs(campaign, 0, 3)
    assert random_starts or not np.any(rows["cause"])
    for run in range(3):
        for name, column in fly_again(campaign, run).items():
            assert np.array_equal(column[0], rows[name][run], equal_nan=True), name
        if rows["cause"][run] == 0:
            *_, last = fly(campaign.case_of(run))
            assert last.state.h == rows["final_altitude_m"][run]
            assert last.state.u == rows["final_speed_mps"][run]


def test_the_graph_flies_through_the_same_air(tmp_path):
    case = load_case("neuro_adaptive_sc_gdi", ROUGH | {"duration": 3.0})
    assert fly_graph(case, tmp_path / "bag")[0] == ""
    flown, alone = read_bag(tmp_path / "bag"), record_of(fly(case), False)
    assert np.asarray(flown.states).tobytes() == np.asarray(alone.states).tobytes()


def test_no_two_runs_meet_the_same_turbulence():
    campaign = Campaign(load_case("nominal_di", TURBULENT | {"duration": 2.0}), 0.0, 3, 11)
    assert len(set(fly_runs(campaign, 0, 3)["final_altitude_m"])) == 3


@pytest.mark.unit
def test_a_flight_meets_the_turbulence_that_its_filters_make_of_its_draws():
    case = load_case("nominal_di", TURBULENT)
    air, filters = CALM, case.plant.truth.wind.turbulence
    met = [loop.plant.turbulence for loop in islice(loops(case), 300)]
    for row, here in zip(NoiseStream(11, 1, GUSTS).block(300)[1:], met[1:], strict=True):
        air = turbulence_step(air, tuple(row[-4:-1]), filters)
        assert tuple(here) == tuple(air)
    assert met[0] == CALM


def test_hardware_of_a_flight_in_turbulence_alone_is_ideal():
    """Without the turbulence it flies as no hardware does, bit for bit."""
    ideal = load_case("nominal_di", {"duration": 3.0})
    turbulent = load_case("nominal_di", TURBULENT | {"duration": 3.0}).plant
    assert ideal.plant.hardware is None
    assert turbulent.hardware is not None
    there = ideal._replace(plant=ideal.plant._replace(hardware=turbulent.hardware))
    assert [step.state for step in fly(there)] == [step.state for step in fly(ideal)]


def test_an_updraught_unstarts_the_inlet_though_the_vehicle_does_not_pitch():
    updraught = {"gust.w": -100.0, "gust.start": 0.1, "gust.duration": 0.4, "duration": 1.0}
    case = load_case("nominal_di", updraught)
    row = {name: column[0] for name, column in fly_runs(Campaign(case, 0.0, 1, 0), 0, 1).items()}
    assert row["cause"] == Cause.INLET_UNSTART
    lost = round(row["time_s"] / 0.01) + 1
    state = next(islice(fly(case), lost, None)).state
    own = atan2(state.w, state.u)
    assert own < 0.8 * UNSTART_ALPHA
    rise = 50.0 * (1.0 - np.cos(2.0 * np.pi * (lost * 0.01 - 0.1) / 0.4))  # [m/s]
    met = own + atan(rise / hypot(state.u, state.w))  # across a velocity of next to no alpha
    assert row["max_abs_alpha_deg"] * RADIANS == pytest.approx(met, rel=0.01)
    assert row["nose_down_alpha_deg"] > 0.5 * row["max_abs_alpha_deg"]


@pytest.mark.unit
def test_air_data_tell_the_velocity_against_the_air_and_the_rest_is_as_it_is():
    """Perfect ones too."""
    windy = {"wind.north": 40.0, "wind.east": 30.0, "gust.w": 8.0, "duration": 0.3}
    case = load_case("nominal_di", windy | {"air_data_sensors": True})
    for number, (plant, *_) in enumerate(loops(case)):
        felt = State(*through_air(plant.state, number * 0.01, None, case.plant.truth.wind))
        assert plant.measured.state[:3] == pytest.approx(felt[:3], rel=1e-12, abs=1e-9)
        assert plant.measured.state[3:] == plant.state[3:]
        assert abs(plant.measured.state.u - plant.state.u) > 39.0
