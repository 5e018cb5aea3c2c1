# Copyright 2026 ahv developers, Apache-2.0
"""Campaigns draw what they are asked to, besides the report's nine, and every run again."""

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from ahv_analysis.campaign.campaign import (
    Campaign,
    find_run,
    fly_again,
    fly_campaign,
    fly_runs,
    open_campaign,
)
from ahv_analysis.campaign.draws import load_draws
from ahv_analysis.errors import CampaignError
from ahv_analysis.flight.case import load_case
from ahv_msgs_py.parameters import ParameterError

TEXT = """
quantities:
  dispersion.mass: {normal: [1.0, 0.03]}
  dispersion.Iyy: {uniform: [0.6, 0.8]}
  wind.north: {truncated: [0, 20, -50, 50]}
correlation:
  - [dispersion.mass, wind.north, 0.5]
"""


@pytest.fixture
def draws(tmp_path):
    path = tmp_path / "draws.yaml"
    path.write_text(TEXT)
    return load_draws(path)


def campaign(draws=None, duration=1.0):
    return Campaign(load_case("nominal_di", {"duration": duration}), 0.1, 3, 4, draws=draws)


def test_every_run_flies_what_was_drawn_for_it(draws):
    runs = [campaign(draws).case_of(run).plant.truth for run in range(3)]
    assert len({truth.further.mass for truth in runs}) == 3
    assert len({truth.wind.steady.north for truth in runs}) == 3
    assert all(0.6 <= truth.dispersion.Iyy <= 0.8 for truth in runs)  # instead of the report's


def test_what_is_not_drawn_is_what_it_would_be_without(draws):
    for run in range(3):
        with_them = campaign(draws).case_of(run).parameters["plant"]
        without = campaign().case_of(run).parameters["plant"]
        differing = {name for name in without if with_them[name] != without[name]}
        assert differing == set(draws["quantities"])


def test_a_campaign_with_draws_is_kept_opened_and_flown_again(draws, tmp_path):
    with ThreadPoolExecutor(2) as pool:
        fly_campaign(campaign(draws), tmp_path / "kept", pool)
    opened = open_campaign(tmp_path / "kept")
    assert opened.draws == draws
    for run in range(3):
        row = find_run(opened, tmp_path / "kept", run)
        for name, column in fly_again(opened, run).items():
            assert np.array_equal(column[0], row[name], equal_nan=True), name


@pytest.mark.parametrize("first, second", [(True, False), (False, True)])
def test_what_is_drawn_is_part_of_what_a_campaign_is(draws, tmp_path, first, second):
    kept = tmp_path / "kept"
    with ThreadPoolExecutor(1) as pool:
        fly_campaign(campaign(draws if first else None, 0.05), kept, pool)
        with pytest.raises(CampaignError, match="draws"):
            fly_campaign(campaign(draws if second else None, 0.05), kept, pool)


def test_a_campaign_that_draws_nothing_else_is_one_of_before():
    described = json.loads(json.dumps(campaign().describe()))
    assert described.pop("draws") is None
    assert "final_altitude_m" in fly_runs(campaign(duration=0.05), 0, 2)


@pytest.mark.parametrize(
    "text, words",
    [
        ("quantities: {latency.delay: {uniform: [0.0, 0.1]}}", "latency.delay is counted"),
        ("quantities: {actuator.elevons.order: {uniform: [0, 2]}}", "order is counted"),
        ("quantities: {dispersion.mas: {normal: [1, 0.1]}}", "did you mean 'dispersion.mass'"),
        ("quantities: {dispersion.mass: {normal: [1, 1]}}", "must be a number from 0.05"),
        ("quantities: {dispersion.mass: {gamma: [1, 1]}}", "must be one of uniform"),
        ("quantities: {1: {normal: [1, 1]}}", "must be quantities"),
        ("quantities: {}", "must be quantities"),
        ("- 1", "must be quantities"),
        ("", "must be quantities"),
        ("draws: {}", "must be quantities"),
        ("quantities: [", "cannot be read"),
        ("\x00", "cannot be read"),
    ],
)
def test_a_file_that_draws_nonsense_is_refused_in_one_sentence(tmp_path, text, words):
    path = tmp_path / "draws.yaml"
    path.write_text(text)
    with pytest.raises(ParameterError, match=words) as refused:
        load_draws(path)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ParameterError, match=r"none\.yaml.*cannot be read"):
        load_draws(tmp_path / "none.yaml")
