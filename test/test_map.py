# Copyright 2026 ahv developers, Apache-2.0
"""A map is its points, and a point is the campaign of its parameters."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image

from ahv_analysis.campaign.axis import places_of, read_axis, read_settings, with_value
from ahv_analysis.campaign.campaign import Campaign, fly_runs
from ahv_analysis.campaign.map import Map, fly_map
from ahv_analysis.campaign.store import part_files, read_part
from ahv_analysis.errors import CampaignError
from ahv_analysis.flight.case import load_case, make_case, read_case
from ahv_analysis.report.map_figure import CONTOURS, draw_map
from ahv_plant.numerics.compiling import told_of_compiling
from test.test_command import assert_refused, told

CASE = "neuro_adaptive_sc_gdi"
RUNS = 3
X, Y = "latency.delay=0.02:0.04:2", "sensor.[PQR].noise=0:0.2:2"


def tiny(x=X, y=Y, level=0.3, runs=RUNS):
    _, given = read_case(CASE, hardware="typical")
    given = with_value(given, places_of("duration"), 1.0)
    return Map(CASE, given, read_axis(x), read_axis(y), level, runs, 5)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A map, its folder and its points."""
    out = tmp_path_factory.mktemp("map")
    with ThreadPoolExecutor(2) as pool:
        return tiny(), out, fly_map(tiny(), out, pool)


def test_a_point_is_the_campaign_of_its_parameters(flown):
    """Set as a case file sets them, and flown without a map."""
    map_, out, points = flown
    assert [(point.x, point.y) for point in points] == [
        (0.02, 0.0),
        (0.04, 0.0),
        (0.02, 0.2),
        (0.04, 0.2),
    ]
    changes = {"duration": 1.0, "latency.delay": 0.04}
    changes |= {f"sensor.{rate}.noise": 0.2 for rate in "PQR"}
    base = load_case(CASE, hardware="typical")
    given = base.parameters | {"plant": base.parameters["plant"] | changes}
    alone = Campaign(make_case(CASE, given), 0.3, RUNS, 5)
    (part,) = part_files(map_.folder(out, 0.04, 0.2) / "runs-0.3")
    columns, described = read_part(part)
    assert described == alone.describe()
    expected = fly_runs(alone, 0, RUNS)
    assert columns.keys() == expected.keys()
    for name, column in expected.items():
        assert np.array_equal(columns[name], column, equal_nan=True), name
    assert points[-1].runs == RUNS
    assert points[-1].successes == np.sum(expected["cause"] == 0)


def test_every_point_has_the_same_vehicles(flown):
    map_, out, points = flown
    drawn = [
        read_part(part)[0]["CL"]
        for point in points
        for part in part_files(map_.folder(out, point.x, point.y) / "runs-0.3")
    ]
    assert len(drawn) == 4 and all(np.array_equal(drawn[0], other) for other in drawn)


def test_a_map_over_the_level_flies_each_level(tmp_path):
    map_ = tiny(y="level=0.1:0.4:2")
    assert [campaign.level for campaign in map_.campaigns.values()] == [0.1, 0.1, 0.4, 0.4]


def test_what_was_flown_is_not_flown_again(flown):
    map_, out, points = flown

    class Idle:
        def submit(self, *job):
            raise AssertionError(job)

    done = []
    assert fly_map(map_, out, Idle(), done.append) == points
    assert done[-1] == 4 * RUNS


def test_points_with_other_values_compile_nothing(flown, tmp_path):
    compiled = []
    other = tiny("latency.delay=0:0.1:2", "actuator.elevons.bandwidth=5:50:2")
    with ThreadPoolExecutor(2) as pool, told_of_compiling(compiled.append):
        assert len(fly_map(other, tmp_path, pool)) == 4
    assert not any(compiled)


def test_an_interrupted_map_keeps_its_points_and_resumes(flown, tmp_path):
    map_, _, points = flown
    done = []
    with ThreadPoolExecutor(1) as pool:
        assert fly_map(map_, tmp_path, pool, done.append, lambda: sum(done) > 0) == []
        kept = len(list(tmp_path.rglob("part-*.parquet")))
        assert kept > 0
        assert fly_map(map_, tmp_path, pool) == points


def test_a_finer_map_takes_what_a_coarser_one_flew(flown):
    _, out, points = flown
    with ThreadPoolExecutor(2) as pool:
        finer = fly_map(tiny(x="latency.delay=0.02:0.04:3"), out, pool)
    assert [point for point in finer if point.x != 0.03] == points


def test_another_map_is_not_mixed_in(flown):
    _, out, _ = flown
    with ThreadPoolExecutor(2) as pool, pytest.raises(CampaignError, match="another campaign"):
        fly_map(replace(tiny(), seed=6), out, pool)


def test_a_pattern_sets_every_parameter_of_its_kind_in_every_node():
    gains = read_axis("k_ap_?=5:10")
    names = [(node, parameter.name) for node, parameter in gains.places]
    assert sorted(names) == [
        (node, f"k_ap_{rate}") for node in ("disturbance_learner", "inner_loop") for rate in "PQR"
    ]
    case = make_case(CASE, with_value(read_case(CASE)[1], gains.places, 7.0))
    changed = {
        (node, name)
        for node, values in load_case(CASE).parameters.items()
        for name, value in values.items()
        if case.parameters[node][name] != value
    }
    assert changed == set(names)
    assert tuple(case.control.inner.k_ap) == (7.0, 7.0, 7.0)


def test_what_the_hardware_of_a_point_decides_is_decided_at_the_point():
    """A case that is ideal has no measured surfaces; a point of it that has a delay does."""
    given = with_value(
        read_case(CASE)[1], *read_settings(["observer_surfaces=measured"])["observer_surfaces"]
    )
    map_ = Map(CASE, given, read_axis("latency.delay=0:0.02:2"), tiny().y, 0.3, 1, 0)
    heard = {
        x: c.case.parameters["disturbance_learner"]["observer_surfaces"]
        for (x, y), c in map_.campaigns.items()
        if y == 0.0
    }
    assert heard == {0.0: "commanded", 0.02: "measured"}


def test_values_of_an_axis_are_those_that_one_would_write():
    assert read_axis("latency.delay=0:0.1:11").values == tuple(n / 100 for n in range(11))
    assert read_axis("latency.delay=0:0.1").title == "latency.delay [s]"
    assert len(read_axis("level=0:0.5").values) == 6


def test_a_setting_has_the_type_of_its_parameter():
    settings = read_settings(["observer_surfaces=commanded", "duration=60"])
    _, given = read_case(CASE, hardware="typical")
    for places, value in settings.values():
        given = with_value(given, places, value)
    case = make_case(CASE, given)
    assert case.parameters["disturbance_learner"]["observer_surfaces"] == "commanded"
    assert case.plant.steps == 6000


@pytest.mark.parametrize(
    "axes, words",
    [
        ((X, "sensor.Q.nose=0:1"), ("sensor.Q.nose", "did you mean 'sensor.Q.noise'")),
        ((X, "k_ao_?=0:1"), ("k_ao_?", "docs/parameters.md")),
        ((X, "level=0.4:0.2"), ("level", "LOW is 0.4", "below HIGH, 0.2")),
        ((X, "level=0.2:0.4:1"), ("level", "COUNT is 1", "2 or more")),
        ((X, "level=0.2:0.4:x"), ("level", "0.2:0.4:x", "integer")),
        ((X, "level"), ("'level'", "NAME=LOW:HIGH")),
        ((X, "level=0:2"), ("level is 2.0", "0 to 0.9")),
        (("latency.delay=0:9", Y), ("latency.delay is 9.0", "0 to")),
        (("latency.delay=0:0.1:4", Y), ("latency.delay is 0.03333", "whole steps of 0.01 s")),
        ((X, "observer_surfaces=0:1"), ("observer_surfaces", "one of commanded, modelled")),
        ((X, "dispersion.CL=0.9:1.1"), ("dispersion.CL", "drawn for every run")),
        ((X, "sensor.*.noise=0:1"), ("sensor.*.noise", "deg/s and", "parameters in")),
        ((X, "latency.*=0:0.1"), ("latency.*",)),
        ((X, X), ("both set latency.delay",)),
        (("sensor.Q.noise=0:1", Y), ("sensor.Q.noise and sensor.[PQR].noise", "both set")),
        ((X, Y, "--set", "latency.delay=0"), ("both set latency.delay",)),
        ((X, Y, "--set", "durations=5"), ("durations", "did you mean 'duration'")),
        ((X, Y, "--set", "duration"), ("'duration'", "NAME=VALUE")),
        ((X, Y, "--set", "level=0.2"), ("--level",)),
        ((X, Y, "--set", "duration=soon"), ("duration is 'soon'", "number")),
        ((X, "level=0:0.5", "--level", 0.2), ("--level", "axis")),
        ((X, Y, "--level", 2), ("level is 2.0", "0 to 0.9")),
        ((X, Y, "--hardware", "nope"), ("nope", "typical")),
    ],
)
def test_wrong_input_is_named(axes, words, tmp_path):
    x, y, *more = axes
    result = told("map", CASE, "--x", x, "--y", y, *more, "--runs", 1, cwd=tmp_path)
    assert_refused(result, words, tmp_path)


def test_the_command_keeps_table_assumptions_and_picture(flown, tmp_path):
    out = tmp_path / "map"
    command = ("map", CASE, "--x", X, "--y", Y, "--hardware", "typical", "--set", "duration=1")
    command = (*command, "--runs", RUNS, "--seed", 5, "--workers", 2, "--out", out)
    result = told(*command, "--json")
    assert result.returncode == 0, result.stderr
    content = json.loads(result.stdout)
    assert (content["case"], content["hardware"], content["set"]) == (
        CASE,
        "typical",
        {"duration": 1},
    )
    assert (content["level"], content["seed"], content["runs"]) == (0.3, 5, RUNS)
    assert content["y"] == {"name": "sensor.[PQR].noise", "unit": "deg/s", "values": [0.0, 0.2]}
    expected = [point._asdict() for point in flown[2]]
    assert content["points"] == expected
    assert json.loads((out / "map.json").read_text())["points"] == expected
    assert pq.read_table(out / "map.parquet").to_pylist() == expected
    with Image.open(out / "map.png") as picture:
        assert min(picture.size) > 300
        assert len(picture.convert("RGB").getcolors(100_000)) > 50
    again = told(*command)
    table = again.stdout.splitlines()
    assert "level 0.3" in table[0] and "typical hardware" in table[0]
    assert [line.split()[0] for line in table[3:5]] == ["0.2", "0"]
    assert table[5].split() == ["0.02", "0.04"]


def test_the_lines_of_a_picture_are_where_the_rates_are():
    x, y = read_axis("latency.delay=0:0.1:6"), read_axis("level=0:0.5:6")
    rates = np.tile(np.linspace(0.0, 1.0, 6), (6, 1))
    figure = draw_map(x, y, rates, "a slope along x")
    axes, scale = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("latency.delay [s]", "level [-]")
    assert scale.get_ylabel() == "success [%]"
    lines = axes.collections[-1]
    for percent, path in zip(CONTOURS, lines.get_paths(), strict=True):
        assert np.allclose(path.vertices[:, 0], percent / 100 * 0.1)
    flat = draw_map(x, y, np.ones((6, 6)), "no line")
    assert len(flat.axes[0].collections) == 1
