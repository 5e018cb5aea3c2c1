# Copyright 2026 ahv developers, Apache-2.0
"""Two campaigns of the same draws are paired, two flights compared; both can be a gate."""

import json
from concurrent.futures import ThreadPoolExecutor
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from scipy.stats import norm

from ahv_analysis.campaign.campaign import Campaign, fly_campaign
from ahv_analysis.campaign.columns import COLUMNS
from ahv_analysis.campaign.compare import compare_columns, mean_interval
from ahv_analysis.campaign.store import PLAUSIBLE
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.outcome import Cause
from test.test_command import assert_refused, told

RUNS = 60


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory):
    """One folder each of three short campaigns: two cases, and one of other draws."""
    folder = tmp_path_factory.mktemp("campaigns")
    flown = {
        "sc": ("neuro_adaptive_sc_gdi", 1),
        "di": ("neuro_adaptive_di", 1),
        "others": ("neuro_adaptive_di", 2),
    }
    with ThreadPoolExecutor(2) as pool:
        for name, (case, seed) in flown.items():
            campaign = Campaign(load_case(case, {"duration": 3.0}), 0.6, RUNS, seed)
            fly_campaign(campaign, folder / name, pool)
    return folder


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """A flight, the same again, and one of a vehicle with a little less lift."""
    folder = tmp_path_factory.mktemp("flights")
    less = folder / "less.yaml"
    less.write_text("/ahv/plant:\n  ros__parameters:\n    dispersion.CL: 0.999\n")
    for name, more in (("one", ()), ("two", ()), ("less", ("--dispersion", less))):
        end = told(
            *("fly", "nominal_di", "--engine", "library", "--duration", "1"),
            *("--out", folder / name, *more),
        )
        assert end.returncode == 0, end.stderr
    return folder


def drawn(lost_a, lost_b, seed=0):
    """Columns of two campaigns that lose these runs."""
    random = np.random.default_rng(seed)
    alphas = random.uniform(3.0, 5.0, (2, len(lost_a)))
    return [
        {
            "run": np.arange(len(lost)),
            "cause": np.where(lost, int(Cause.INLET_UNSTART), 0),
            "max_abs_alpha_deg": alpha,
        }
        for lost, alpha in zip((lost_a, lost_b), alphas, strict=True)
    ]


def test_who_saves_whom_and_the_exact_test_of_mcnemar():
    """Of 10 runs that only one of the two keeps, 9 to 1 or more uneven: 22 of 1024 ways."""
    lost_a = np.array([1] * 9 + [0] * 1 + [1] * 5 + [0] * 85, bool)
    lost_b = np.array([0] * 9 + [1] * 1 + [1] * 5 + [0] * 85, bool)
    found = compare_columns(*drawn(lost_a, lost_b))
    assert found.only_b == list(range(9)) and found.only_a == [9]
    assert found.kept_by_both == 85
    assert found.p_value == pytest.approx(22 / 1024, rel=1e-12)
    assert found.rates == (0.86, 0.94) and found.difference[0] == pytest.approx(0.08)
    assert found.difference[1] > 0.0


def test_the_interval_of_a_mean_holds_it_as_often_as_it_says():
    random = np.random.default_rng(5)
    held = 0
    for _ in range(200):
        low, high = mean_interval(random.normal(2.0, 3.0, 50))
        held += low <= 2.0 <= high
    assert 178 <= held <= 198  # 190 in the mean; 1 in 1000 of such tests is outside
    many = random.normal(2.0, 3.0, 30_000)
    low, high = mean_interval(many)
    assert (high - low) / 2 == pytest.approx(norm.ppf(0.975) * 3.0 / 30_000**0.5, rel=0.02)


def test_a_campaign_is_no_other_than_itself(campaigns, tmp_path):
    junit = tmp_path / "junit.xml"
    result = told(
        *("compare", campaigns / "sc", campaigns / "sc"),
        *("--tolerance", "*=0", "--junit", junit, "--out", tmp_path, "--json"),
    )
    found = json.loads(result.stdout)
    assert result.returncode == 0
    assert found["identical"] and found["differ"] == 0 and found["p_value"] == 1.0
    assert found["apart"] == "" and found["difference"] == [0.0, 0.0, 0.0]
    assert all(one["differ"] == 0 and one["mean"] == 0.0 for one in found["metrics"])
    suite = ElementTree.parse(junit).getroot()
    assert suite.get("failures") == "0" and int(suite.get("tests")) == len(found["metrics"]) + 1
    with Image.open(tmp_path / "compare.png") as picture:
        assert min(picture.size) > 400
    assert json.loads((tmp_path / "compare.json").read_text()) == found


def test_what_sets_two_campaigns_apart_is_said_and_can_fail_a_gate(campaigns, tmp_path):
    paths = campaigns / "sc", campaigns / "di"
    result = told("compare", *paths, "--out", tmp_path)
    assert result.returncode == 0 and "inner_loop.lambda 1.5 and 1.0" in " ".join(
        result.stdout.replace("│", " ").split()
    )
    junit = tmp_path / "junit.xml"
    strict = ("--tolerance", "max_abs_alpha_deg=0", "--junit", junit)
    assert told("compare", *paths, "--out", tmp_path, *strict).returncode == 1
    (failed,) = ElementTree.parse(junit).getroot().iter("failure")
    assert "mean difference" in failed.get("message")


def test_a_campaign_that_loses_more_than_chance_fails_the_gate(campaigns, tmp_path):
    """The column of causes is written anew, so that B loses six vehicles that A keeps."""
    from ahv_analysis.campaign.store import level_folder, part_files, read_part, write_part

    worse = tmp_path / "worse" / "runs-0.6"
    worse.mkdir(parents=True)
    (part,) = part_files(level_folder(campaigns / "sc", 0.6))
    columns, described = read_part(part)
    kept = np.flatnonzero(columns["cause"] == 0)[:6]
    columns = {name: column.copy() for name, column in columns.items()}
    columns["cause"][kept] = int(Cause.INLET_UNSTART)
    write_part(worse / part.name, [columns], described)
    result = told("compare", campaigns / "sc", tmp_path / "worse", "--out", tmp_path / "out")
    assert result.returncode == 1 and "A is better" in result.stdout
    for run in kept.tolist():
        assert f"ahv monte-carlo rerun {tmp_path / 'worse'} {run}\n" in result.stdout
    back = told("compare", tmp_path / "worse", campaigns / "sc", "--out", tmp_path / "out")
    assert back.returncode == 0 and "B is better" in back.stdout


@pytest.mark.parametrize(
    ("pair", "options", "words"),
    [
        (("sc", "others"), (), ("not of the same draws", "seed 1 there and 2 here")),
        (("sc", "nowhere"), (), ("no folder",)),
        (("sc", "."), (), ("a campaign and none",)),
        (("sc", "sc"), ("--tolerance", "alpha"), ("NAME=NUMBER", "'alpha'")),
        (("sc", "sc"), ("--tolerance", "alpha=-1"), ("NAME=NUMBER",)),
        (("sc", "sc"), ("--tolerance", "beta=1"), ("no 'beta'", "max_abs_beta_deg")),
        (("sc", "sc"), ("--level", "0.5"), ("there are: 0.6",)),
    ],
)
def test_what_cannot_be_compared_is_said_in_a_sentence(campaigns, tmp_path, pair, options, words):
    paths = [campaigns / name for name in pair]
    result = told("compare", *paths, *options, "--out", tmp_path / "out")
    assert_refused(result, words, tmp_path)


def test_the_same_flight_again_does_not_differ(flights, tmp_path):
    result = told("compare", flights / "one", flights / "two" / "bag", "--out", tmp_path, "--json")
    found = json.loads(result.stdout)
    assert result.returncode == 0 and found["beyond"] == [] and found["compared"] == 101
    assert all(one["differ"] == 0 for one in found["quantities"])


def test_a_flight_that_differs_is_within_its_tolerance_or_fails_the_gate(flights, tmp_path):
    paths = flights / "one", flights / "less"
    junit = tmp_path / "junit.xml"
    result = told("compare", *paths, "--out", tmp_path, "--junit", junit, "--json")
    found = json.loads(result.stdout)
    by_name = {one["name"]: one for one in found["quantities"]}
    assert result.returncode == 1 and "alpha" in found["beyond"]
    assert int(ElementTree.parse(junit).getroot().get("failures")) == len(found["beyond"])
    assert by_name["h"]["first_s"] > 0.0  # both start at one place
    alpha = abs(by_name["alpha"]["largest"])
    wide, narrow = ("--tolerance", f"alpha={1.01 * alpha}"), ("--tolerance", f"alpha={alpha / 2}")
    every = ("--tolerance", "*=1e9")
    assert told("compare", *paths, *every, *wide, "--out", tmp_path).returncode == 0
    assert told("compare", *paths, *every, *narrow, "--out", tmp_path).returncode == 1


def test_a_flight_that_ended_earlier_fails_the_gate(flights, tmp_path):
    folder = tmp_path / "short"
    told("fly", "nominal_di", "--engine", "library", "--duration", "0.5", "--out", folder)
    result = told("compare", flights / "one", folder, "--out", tmp_path / "out", "--json")
    found = json.loads(result.stdout)
    assert result.returncode == 1 and (found["compared"], found["only_a"]) == (51, 50)
    assert found["beyond"] == ["A has 50 states that the other has not"]


def test_every_column_says_what_it_means():
    assert COLUMNS.keys() == {"run", *PLAUSIBLE}
