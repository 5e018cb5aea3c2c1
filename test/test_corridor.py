# Copyright 2026 ahv developers, Apache-2.0
"""What a campaign says of how its runs followed their reference, and the corridor they keep to."""

import numpy as np
import pytest

from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.outcome import Cause, Corridor
from ahv_plant.model.constants import DEGREES, STEP

SPEED = 1786.4  # [m/s] to follow
CORRIDOR = Corridor(350.0, 110.0, 15.0)


@pytest.fixture(scope="module")
def campaign():
    """Runs that begin anywhere within 600 m and 150 m/s of what they are to hold."""
    case = load_case("nominal_di", {"duration": 40.0})
    return Campaign(case, 0.02, 12, 3, random_starts=True, corridor=CORRIDOR)


@pytest.fixture(scope="module")
def rows(campaign):
    """Its columns, flown in lanes."""
    return fly_runs(campaign, 0, campaign.runs)


def flown(campaign, run):
    """What the library flies of a run: times, altitude errors, speed errors, the record."""
    record = record_of(fly(campaign.case_of(run)), False)
    return record.column("h") - 24000.0, record.column("u") - SPEED, record


def first_too_long(outside, longest):
    """Place of the first step at which a run has been outside for longer than `longest` [s]."""
    stretch = 0
    for place, out in enumerate(outside):
        stretch = stretch + 1 if out else 0
        if stretch * STEP > longest:
            return place
    return None


def test_a_run_is_lost_once_it_was_outside_its_corridor_for_too_long(campaign, rows):
    found = set()
    for run in range(campaign.runs):
        high, fast, record = flown(campaign, run)
        if not record.inlet_started:
            assert rows["cause"][run] == Cause.INLET_UNSTART
            continue
        outside = (np.abs(high) > CORRIDOR.altitude) | (np.abs(fast) > CORRIDOR.speed)
        lost = first_too_long(outside, CORRIDOR.longest)
        cause = Cause.SUCCESS if lost is None else Cause.LEFT_THE_CORRIDOR
        assert rows["cause"][run] == cause
        end = len(outside) if lost is None else lost + 1
        assert rows["outside_corridor_s"][run] == pytest.approx(np.sum(outside[:end]) * STEP)
        found.add(cause)
    assert len(found) == 2, "some are lost, and some are not"


def test_columns_of_tracking_are_those_of_the_flight(campaign, rows):
    for run in np.flatnonzero(rows["cause"] == Cause.SUCCESS).tolist():
        high, fast, record = flown(campaign, run)
        expected = {
            "rms_altitude_error_m": np.sqrt(np.mean(high**2)),
            "final_altitude_error_m": high[-1],
            "rms_speed_error_mps": np.sqrt(np.mean(fast**2)),
            "max_speed_error_mps": np.max(np.abs(fast)),
            "max_heading_error_deg": np.max(np.abs(record.column("psi"))) * DEGREES,
            "fuel_kg": record.column("mass")[0] - record.column("mass")[-1],
            "least_mach": np.min(record.air.mach),
        }
        for name, value in expected.items():
            assert rows[name][run] == pytest.approx(value, rel=1e-9), name


def test_a_lane_keeps_its_corridor_to_the_bits_of_the_run_alone(campaign, rows):
    alone = fly_again(campaign, 4)
    assert all(np.array_equal(alone[name][0], rows[name][4], equal_nan=True) for name in rows)


def test_a_campaign_without_a_corridor_says_nothing_of_one():
    case = load_case("nominal_di")
    assert "corridor" not in Campaign(case, 0.2, 5, 3).describe()
    assert Campaign(case, 0.2, 5, 3, corridor=CORRIDOR).describe()["corridor"] == {
        "altitude": 350.0,
        "speed": 110.0,
        "longest": 15.0,
    }
