# Copyright 2026 ahv developers, Apache-2.0
"""The worst of a box is found where it is known to be, and rare losses have their probability."""

import json
from concurrent.futures import ThreadPoolExecutor
from math import factorial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.stats import norm

from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.campaign.campaign import Campaign, fly_runs
from ahv_analysis.campaign.rare import combine, subset_simulation
from ahv_analysis.campaign.vehicles import LOSS, Vehicles, fly_vehicles, vehicle_case
from ahv_analysis.campaign.worst import Probe, bisect, find_lost, find_worst
from ahv_analysis.errors import CampaignError
from ahv_analysis.flight.case import load_case, load_dispersion
from ahv_plant.dispersion import Dispersion
from test.test_command import assert_refused, told

CASE = "neuro_adaptive_sc_gdi"


def test_the_worst_of_a_slope_is_a_corner_and_of_a_hill_its_top():
    slope = np.array([1.0, -2.0, 0.5, 3.0, -1.0, 1.0, 0.1, -0.1, 2.0])
    found = find_worst(lambda x: (x - 1.0) @ slope, 0.3, 2, 0)
    assert np.allclose(found.dispersion, 1.0 + 0.3 * np.sign(slope), atol=1e-12)
    assert found.severity == found.corner_severity == pytest.approx(0.3 * np.abs(slope).sum())
    top = 1.0 + np.linspace(-0.2, 0.2, 9)
    hill = find_worst(lambda x: 6.0 - 4.0 * np.sum((x - top) ** 2, axis=1), 0.3, 1, 0)
    assert hill.lost and hill.lost_corners == 0 and hill.corner_severity < LOSS < hill.severity


def test_a_loss_inside_the_box_is_found_where_no_corner_is_lost():
    top = np.full(9, 1.1)
    vehicle, severity = find_lost(lambda x: 5.5 - 3.0 * np.sum((x - top) ** 2, axis=1), 0.3, 0)
    assert severity > LOSS and np.all(np.abs(vehicle - 1.0) <= 0.3 + 1e-12)


@pytest.mark.parametrize(("kept", "lost"), [(0.0, 0.9), (60.0, 1.0)])
def test_bisection_ends_where_losses_begin(kept, lost):
    """The least rate and the largest level alike: from what is kept to what is not."""
    border = kept + 0.37 * (lost - kept)
    rising = 1.0 if lost > kept else -1.0
    resolution = abs(lost - kept) / 90

    def probe(value):
        return Probe(value, 5.5 if rising * value > rising * border else 4.0, [1.0] * 9)

    found = bisect(probe, kept, lost, resolution)
    assert rising * found.kept <= rising * border < rising * found.lost
    assert abs(found.lost - found.kept) == pytest.approx(resolution)
    assert bisect(probe, lost, 2 * lost, resolution).kept is None
    assert bisect(probe, kept, border, resolution).lost is None


def test_a_vehicle_of_a_search_flies_as_in_a_campaign_and_alone(tmp_path):
    """Severity says what the outcome says; and the file remembers it."""
    case = load_case(CASE, {"duration": 20.0})
    campaign = Campaign(case, 0.6, 32, 1)
    rows = fly_runs(campaign, 0, 32)
    vehicles = np.array([campaign.dispersion(run) for run in range(32)])
    lost = rows["cause"] != 0
    assert 0 < lost.sum() < 32
    found = fly_vehicles(case, vehicles)
    assert np.array_equal(found > LOSS, lost)
    assert np.array_equal(found[~lost], rows["max_abs_alpha_deg"][~lost])
    sooner = np.argsort(rows["time_s"][lost], kind="stable")
    assert np.all(np.diff(found[lost][sooner]) <= 0.0)
    run = int(np.flatnonzero(lost)[0])
    assert fly_alone(vehicle_case(case, vehicles[run])).cause == rows["cause"][run]
    with ThreadPoolExecutor(2) as pool:
        first = Vehicles(case, tmp_path / "flown.parquet", pool)
        assert np.array_equal(first.fly(vehicles), found)
        first.save()
        again = Vehicles(case, tmp_path / "flown.parquet", None)  # nobody flies
        assert np.array_equal(again.fly(vehicles[::-1]), found[::-1])
        other = load_case(CASE, {"duration": 10.0})
        with pytest.raises(CampaignError, match="of another case, or of other code"):
            Vehicles(other, tmp_path / "flown.parquet", pool)
    (tmp_path / "flown.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(CampaignError, match="no flights of a search, or is damaged"):
        Vehicles(case, tmp_path / "flown.parquet", None)


@pytest.mark.parametrize(
    ("limit", "threshold", "probability"),
    [
        (lambda z: z @ np.ones(9) / 3.0, 4.0, norm.sf(4.0)),
        # nine uniform numbers whose sum is below 1: the corner of a cube
        (lambda z: -norm.cdf(z).sum(axis=1), -1.0, 1.0 / factorial(9)),
        # a plateau, as of flights that never exceed the angle they start with
        (lambda z: np.maximum(z @ np.ones(9) / 3.0, 1.0), 3.0, norm.sf(3.0)),
    ],
)
def test_rare_probabilities_are_those_of_closed_forms(limit, threshold, probability):
    held = means = 0.0
    for seed in range(6):
        found = combine(
            [
                subset_simulation(limit, threshold, 9, np.random.default_rng((seed, number)))
                for number in range(8)
            ]
        )
        held += found.low <= probability <= found.high
        means += found.probability / 6
    assert held >= 4
    assert means == pytest.approx(probability, rel=0.25)


def test_what_never_happens_has_no_probability():
    found = combine(
        [
            subset_simulation(lambda z: np.tanh(z[:, 0]), 2.0, 9, np.random.default_rng(number))
            for number in range(2)
        ]
    )
    assert not found.found and found.probability == 0.0


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """Name of a case that flies for 18 s: lost is who is lost soonest."""
    path = tmp_path_factory.mktemp("case") / "short.yaml"
    sections = f"/**:\n  ros__parameters:\n    base: {CASE}\n"
    path.write_text(f"{sections}/**/plant:\n  ros__parameters:\n    duration: 18.0\n")
    return path


def test_the_worst_vehicle_is_saved_flown_drawn_and_reported(short, tmp_path):
    result = told("worst", short, "--level", "0.4", "--starts", "1", "--out", tmp_path, "--json")
    found = json.loads(result.stdout)
    assert result.returncode == 0 and found["lost"] and found["lost_corners"] > 0
    multipliers = load_dispersion(tmp_path / "worst.yaml")
    assert multipliers == {f"dispersion.{name}": x for name, x in found["dispersion"].items()}
    assert multipliers["dispersion.CL"] == 0.6  # what little lift does is known of campaigns
    alone = fly_alone(load_case(str(short), multipliers))
    assert alone.cause != 0
    with Image.open(tmp_path / "worst.png") as picture:
        assert picture.width > 700
    assert "inlet unstart" in Path(found["page"]).read_text()
    again = json.loads(
        told("worst", short, "--level", "0.4", "--starts", "1", "--out", tmp_path, "--json").stdout
    )
    assert again == found


@pytest.mark.slow
def test_losses_begin_between_25_and_30_percent(tmp_path):
    with ThreadPoolExecutor(2) as pool:
        flights = Vehicles(load_case(CASE), tmp_path / "flown.parquet", pool)
        assert find_lost(flights.fly, 0.25, 0)[1] <= LOSS < find_lost(flights.fly, 0.3, 0)[1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("worst", CASE, "--level", "1"), ("level 1", "0 to 0.9")),
        (("worst", "nobody"), ("case 'nobody'",)),
        (("worst", CASE, "--over", "latency.delay=0:0.1"), ("--over needs --radius",)),
        (("worst", CASE, "--radius", "--over", "latency.delay=0"), ("NAME=KEPT:LOST",)),
        (("worst", CASE, "--radius", "--over", "latency.dela=0:0.1"), ("latency.delay",)),
        (("worst", CASE, "--radius", "--over", "mach=5:9"), ("mach is none",)),
        (("rare", CASE, "--level", "0"), ("level 0 must be above 0",)),
    ],
)
def test_what_cannot_be_searched_is_said_in_a_sentence(tmp_path, options, words):
    result = told(*options, "--out", tmp_path / "out")
    assert_refused(result, words, tmp_path)


def test_rare_losses_are_as_many_as_a_campaign_counts(short, tmp_path):
    """At 40 %, where both can count: brute force and simulation agree."""
    result = told(
        *("rare", short, "--level", "0.4", "--repetitions", "2", "--out", tmp_path, "--json")
    )
    found = json.loads(result.stdout)
    case = load_case(str(short))
    lost = np.sum(fly_runs(Campaign(case, 0.4, 960, 1), 0, 960)["cause"] != 0)
    error = 3.0 * np.sqrt(lost) / 960 * 2**0.5
    assert found["probability"] == pytest.approx(lost / 960, abs=error)
    assert found["most_central_loss"].keys() == set(Dispersion._fields)
    assert (tmp_path / "rare.png").exists()
