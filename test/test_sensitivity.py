# Copyright 2026 ahv developers, Apache-2.0
"""What decides a campaign is found where it was planted, and nothing is where nothing was."""

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from PIL import Image

from ahv_analysis.campaign.campaign import Campaign, fly_campaign
from ahv_analysis.campaign.sensitivity import pawn, regression, sensitivities
from ahv_analysis.campaign.store import level_folder, part_files, read_part, write_part
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.outcome import Cause
from ahv_plant.dispersion import Dispersion
from test.test_command import assert_refused, told

NAMES = Dispersion._fields
RUNS = 300


def drawn(runs, seed):
    random = np.random.default_rng(seed)
    return {name: random.uniform(0.6, 1.4, runs) for name in NAMES}, random


@pytest.fixture(scope="module")
def planted(tmp_path_factory):
    """A campaign whose verdict is written anew: lost is who has a roll inertia above 1.25."""
    folder = tmp_path_factory.mktemp("planted")
    with ThreadPoolExecutor(2) as pool:
        campaign = Campaign(load_case("neuro_adaptive_di", {"duration": 0.05}), 0.4, RUNS, 3)
        fly_campaign(campaign, folder, pool)
    (part,) = part_files(level_folder(folder, 0.4))
    columns, described = read_part(part)
    cause = np.where(columns["Ixx"] > 1.25, int(Cause.INLET_UNSTART), 0)
    write_part(part, [columns | {"cause": cause}], described)
    return folder


@pytest.mark.parametrize("name", ["CL", "Izz"])
def test_one_factor_that_decides_by_construction_is_found_first_of_nine(name):
    """Through noise, once as a verdict and once as a quantity that no correlation sees."""
    factors, random = drawn(1000, 1)
    noise = random.normal(0.0, 0.05, 1000)
    verdict = sensitivities("lost", (factors[name] + noise < 0.7).astype(float), factors)
    assert verdict.factors[0].factor == name
    assert [one.factor for one in verdict.factors if one.decides] == [name]
    assert verdict.sentence.startswith(f"{name} decides which vehicles are lost")
    bowl = sensitivities("max_abs_alpha_deg", (factors[name] - 1.0) ** 2 + noise, factors)
    assert [one.factor for one in bowl.factors if one.decides] == [name]
    assert abs(bowl.factors[0].rank_correlation) < 0.1


def test_a_null_campaign_names_none():
    """Of 25 campaigns in which nothing decides, 0.25 would name something by chance."""
    named = 0
    for seed in range(25):
        factors, random = drawn(200, seed)
        verdicts = (random.uniform(size=200) < 0.1).astype(float)
        found = sensitivities("lost", verdicts, factors, seed)
        named += any(one.decides for one in found.factors)
        said = found.sentence.startswith("None of the 9 factors")
        assert said != any(one.decides for one in found.factors)
    assert named <= 2  # more are a chance of 2 in 1000


def test_the_index_is_that_of_closed_forms():
    """Of y = x the least tenth is 0.9 apart; of a verdict the shares of lost are compared."""
    x = np.random.default_rng(2).uniform(size=20_000)
    assert pawn(x, x) == pytest.approx(0.9, abs=1e-3)
    assert pawn((x < 0.1).astype(float), x) == pytest.approx(0.9, abs=0.01)
    assert pawn((x > 0.1).astype(float), x) == pytest.approx(0.9, abs=0.01)
    assert pawn(1.0 - 2.0 * x, x) == pytest.approx(pawn(x, x), abs=0.02)


def test_the_regression_finds_the_weights_that_were_planted():
    factors, random = drawn(20_000, 5)
    deviation = 0.8 / 12**0.5
    odds = -1.0 + (3.0 * (factors["Cm"] - 1.0) - 2.0 * (factors["CD"] - 1.0)) / deviation
    lost = random.uniform(size=20_000) < 1.0 / (1.0 + np.exp(-odds))
    weights, explained = regression("lost", lost.astype(float), factors)
    assert weights["Cm"] == pytest.approx(3.0, rel=0.06)
    assert weights["CD"] == pytest.approx(-2.0, rel=0.06)
    assert max(abs(weights[name]) for name in NAMES if name not in ("Cm", "CD")) < 0.1
    assert 0.3 < explained < 0.9
    linear, explained = regression("time_s", 2.0 * factors["CL"], factors)
    assert linear["CL"] == pytest.approx(1.0) and explained == pytest.approx(1.0)


def test_the_command_names_what_was_planted_and_draws_it(planted, tmp_path):
    result = told("sensitivity", planted, "--out", tmp_path, "--json")
    found = json.loads(result.stdout)
    assert result.returncode == 0 and len(found["factors"]) == 9
    assert found["factors"][0]["factor"] == "Ixx" and "Ixx >= 1.25" in found["sentence"]
    assert [one["factor"] for one in found["factors"] if one["decides"]] == ["Ixx"]
    for name in ("sensitivity", "scatter"):
        with Image.open(tmp_path / f"{name}.png") as picture:
            assert picture.width > 700
    assert json.loads((tmp_path / "sensitivity.json").read_text()) == found
    again = told("sensitivity", planted, "--of", "trim_alpha_deg", "--out", tmp_path)
    assert again.stdout.startswith("CL decides trim_alpha_deg")


@pytest.mark.parametrize(
    ("of", "words"),
    [
        ("beta", ("no column 'beta'", "max_abs_beta_deg")),
        ("time_s", ("nothing decides where nothing differs", "time_s is 0.05")),
    ],
)
def test_what_nothing_decides_is_said_in_a_sentence(planted, tmp_path, of, words):
    result = told("sensitivity", planted, "--of", of, "--out", tmp_path / "out")
    assert_refused(result, words, tmp_path)
