# Copyright 2026 ahv developers, Apache-2.0
"""Three lines in a notebook fly what the command flies, to the same bits."""

import subprocess
import sys

import numpy as np
import pytest

import ahv_analysis as ahv
from ahv_analysis import public
from ahv_analysis.campaign.campaign import Campaign, fly_runs
from ahv_analysis.flight.case import load_case
from ahv_msgs_py.parameters import ParameterError


def test_a_drawn_flight_is_the_run_of_a_campaign():
    flight = ahv.fly("neuro_adaptive_di", dispersion=0.3, seed=1, run=7)
    (row,) = fly_runs(Campaign(load_case("neuro_adaptive_di"), 0.3, 8, 1), 7, 1)["final_speed_mps"]
    data = flight.dataset()
    assert float(data["u"][-1]) == row
    assert data.attrs["case"] == "neuro_adaptive_di"
    assert data["alpha"].attrs["units"] == "rad"
    assert flight.summary()["success"]


def test_a_campaign_is_a_table_and_its_folder_is_flown_on(tmp_path):
    few = ahv.fly_campaign("nominal_di", level=0.2, runs=3, seed=5, folder=tmp_path)
    more = ahv.fly_campaign("nominal_di", level=0.2, runs=5, seed=5, folder=tmp_path)
    assert few.num_rows == 3
    assert more.slice(0, 3).equals(few)
    assert more["run"].to_pylist() == [0, 1, 2, 3, 4]
    again = ahv.fly_campaign("nominal_di", level=0.2, runs=2, seed=5, folder=tmp_path)
    assert again.equals(few.slice(0, 2))


def test_multipliers_are_given_by_name():
    flight = ahv.fly("nominal_di", dispersion={"CL": 0.8}, duration=1.0)
    assert flight.case.plant.truth.dispersion.CL == 0.8
    assert np.all(flight.record.stamps == np.arange(101) * 10_000_000)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"case": "nominal_id"}, "nominal_id.*neither a YAML file nor one of"),
        ({"case": "nominal_di", "dispersion": 1.5}, "level is 1.5, but must be 0 to 0.9"),
        ({"case": "nominal_di", "dispersion": {"CX": 1.0}}, "dispersion.CX"),
        ({"case": "nominal_di", "duration": -1.0}, "duration is -1"),
    ],
)
def test_what_is_wrong_is_named(wrong, words):
    with pytest.raises(ParameterError, match=words):
        ahv.fly(**wrong)


def test_the_surface_is_curated_and_costs_nothing_until_it_is_used():
    assert set(ahv.__all__) == set(public.__all__)
    loaded = "import sys, ahv_analysis; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", loaded], check=False).returncode == 0
    with pytest.raises(AttributeError, match="no attribute 'fly_home'"):
        ahv.fly_home  # noqa: B018
