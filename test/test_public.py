# Copyright 2026 ahv developers, Apache-2.0
"""Three lines in a notebook fly what the command flies, to the same bits."""

import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml

import ahv_analysis as ahv
from ahv_analysis import public
from ahv_analysis.campaign.campaign import Campaign, fly_runs
from ahv_analysis.flight.case import load_case
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.model.constants import DEGREES, INITIAL_MASS
from ahv_plant.trim import trim
from test.test_command import told

CASE = "neuro_adaptive_di"  # which other tests fly on hardware too
NORTH = {"truncated": [0.0, 20.0, -50.0, 50.0]}  # [m/s]


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


def test_draws_are_those_of_the_command(tmp_path):
    draws = {"quantities": {"dispersion.mass": {"normal": [1.0, 0.02]}, "wind.north": NORTH}}
    file, out = tmp_path / "draws.yaml", tmp_path / "command"
    file.write_text(yaml.safe_dump(draws))
    asked = ("--controller", "nominal_di", "--level", 0.1, "--draws", file, "--out", out)
    result = told("monte-carlo", *asked, "--runs", 2, "--seed", 5)
    assert result.returncode == 0, result.stderr
    expected = pq.read_table(next(out.rglob("part-*.parquet")))
    for given in (draws, file):
        found = ahv.fly_campaign("nominal_di", level=0.1, runs=2, seed=5, draws=given)
        assert found.equals(expected)
    plain = ahv.fly_campaign("nominal_di", level=0.1, runs=2, seed=5)
    assert plain["final_speed_mps"] != expected["final_speed_mps"]


def test_a_flight_on_hardware_is_the_run_of_a_campaign_on_it():
    flight = ahv.fly(CASE, dispersion=0.3, seed=5, run=1, hardware="typical")
    kept = ahv.fly_campaign(CASE, level=0.3, runs=2, seed=5, hardware="typical")
    assert float(flight.dataset()["u"][-1]) == kept["final_speed_mps"][1].as_py()
    assert flight.case.plant.hardware is not None


def test_a_map_is_a_table_of_campaigns(tmp_path):
    found = ahv.fly_map(
        CASE,
        x="latency.delay=0:0.2:2",
        y="level=0.2,0.3",
        settings={"duration": 5, "observer_surfaces": "commanded"},
        runs=3,
        seed=5,
        hardware="typical",
        folder=tmp_path,
    ).to_pylist()
    assert [(point["x"], point["y"]) for point in found] == [
        (0.0, 0.2),
        (0.2, 0.2),
        (0.0, 0.3),
        (0.2, 0.3),
    ]
    assert [point["successes"] for point in found] == [3, 0, 3, 0]
    assert len(list(tmp_path.rglob("part-*.parquet"))) == 4


def test_the_envelope_is_a_table_of_trims():
    found = ahv.envelope([24_000.0, 30_000.0], [6.0, 7.0], [INITIAL_MASS]).to_pylist()
    here = trim(24_000.0, found[0]["speed_mps"])
    assert found[0]["alpha_deg"] == here.alpha * DEGREES
    assert [point["within_limits"] for point in found] == [True, True, False, False]
    with pytest.raises(ParameterError, match=r"envelope: speed .* Mach 4 to 24"):
        ahv.envelope([24_000.0], [3.0], [INITIAL_MASS])


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
        ({"case": "nominal_di", "hardware": "ideel"}, "hardware 'ideel'"),
        ({"case": "nominal_di", "profile": "nowhere"}, "profile 'nowhere'"),
    ],
)
def test_what_is_wrong_is_named(wrong, words):
    with pytest.raises(ParameterError, match=words):
        ahv.fly(**wrong)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"level": 1.5}, "level is 1.5, but must be a number from 0 to 0.9"),
        ({"runs": 0}, "runs is 0, but must be 1 or more"),
        ({"draws": {"quantities": {}}}, "draws: must be quantities"),
        ({"draws": "nowhere.yaml"}, "nowhere.yaml"),
    ],
)
def test_what_is_wrong_with_a_campaign_is_named(wrong, words):
    with pytest.raises(ParameterError, match=words):
        ahv.fly_campaign(CASE, **({"level": 0.3, "runs": 1} | wrong))


def test_the_surface_is_curated_and_costs_nothing_until_it_is_used():
    assert set(ahv.__all__) == set(public.__all__)
    loaded = "import sys, ahv_analysis; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", loaded], check=False).returncode == 0
    with pytest.raises(AttributeError, match="no attribute 'fly_home'"):
        ahv.fly_home  # noqa: B018
