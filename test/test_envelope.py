# Copyright 2026 ahv developers, Apache-2.0
"""The envelope of level flight: which limit ends it where, and how far all others are."""

import json
from math import cos, inf, radians

import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image

from ahv_analysis.command.envelope import _row
from ahv_analysis.ranges import read_number, read_values
from ahv_analysis.report.envelope_figure import Grid, draw_envelope
from ahv_msgs_py.parameters import ParameterError
from ahv_plant import envelope
from ahv_plant.envelope import envelope_point
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import DEGREES, INITIAL_MASS
from ahv_plant.model.flight_condition import CRUISE_SPEED
from ahv_plant.model.limits import NOT_FOUND
from ahv_plant.trim import trim
from test.test_command import assert_refused, told

OWN_MACH = CRUISE_SPEED / atmosphere(24000.0, False).sound_speed


@pytest.mark.unit
def test_margins_of_the_reports_trim():
    """2.9442 deg, -7.2163 deg and 0.19417 (section 3.5.1) against 5 deg, -40 deg and 0.1."""
    point = envelope_point(24000.0, OWN_MACH, INITIAL_MASS)
    assert point.within_limits and point.why_not == ""
    assert point.alpha_margin_deg == pytest.approx(5.0 - 2.9442, abs=5e-5)
    assert point.elevon_margin_deg == pytest.approx(40.0 - 7.2163, abs=5e-5)
    assert point.throttle_margin == pytest.approx(0.09417, abs=5e-6)
    assert point.nearest_limit == "throttle"
    assert point.relative_margin == pytest.approx(0.09417 / 0.4, abs=2e-5)


@pytest.mark.unit
def test_dynamic_pressure_is_that_of_the_standard_atmosphere():
    """q = 0.7 p M^2, with p of ISO 2533 in the layer of 1 K/km above 20 km."""
    point = envelope_point(26000.0, 7.0, 120e3)
    pressure = 5474.889 * (222.65 / 216.65) ** (-9.80665 / (287.05287 * 0.001))
    mach = 7.0 / cos(radians(point.alpha_deg))
    assert point.dynamic_pressure_pa == pytest.approx(0.7 * pressure * mach**2, rel=1e-4)


@pytest.mark.unit
@pytest.mark.parametrize(
    "altitude, mach, mass, words",
    [
        (28e3, 5.0, 140e3, "alpha above 5 deg"),
        (12e3, 10.0, 100e3, "throttle above 0.9"),
        (34e3, 8.0, 60e3, "throttle below 0.1"),
        (47e3, 19.0, 60e3, "elevons below -40 deg"),
        (33e3, 4.0, 140e3, "alpha above 5 deg, elevons above 30 deg, throttle above 0.9"),
    ],
)
def test_the_limit_that_is_passed_is_named(altitude, mach, mass, words):
    point = envelope_point(altitude, mach, mass)
    assert point.why_not == words
    assert not point.within_limits and point.relative_margin < 0.0
    assert min(point.alpha_margin_deg, point.elevon_margin_deg, point.throttle_margin) < 0.0


@pytest.mark.compiled
def test_a_point_is_inside_where_no_margin_is_negative():
    for altitude in np.arange(10e3, 47e3, 4e3).tolist():
        for mach in np.arange(4.0, 24.0, 2.0).tolist():
            point = envelope_point(altitude, mach, 90e3)
            margins = point.alpha_margin_deg, point.elevon_margin_deg, point.throttle_margin
            assert point.within_limits == (min(margins) >= 0.0) == (point.why_not == "")
            assert point.within_limits == (point.relative_margin >= 0.0)


@pytest.mark.unit
def test_where_the_solver_fails_there_are_no_numbers(monkeypatch):
    lost = trim()._replace(converged=False, residual=inf)
    monkeypatch.setattr(envelope, "trim", lambda *condition: lost)
    point = envelope_point(24000.0, 6.0, 100e3)
    assert (point.within_limits, point.why_not) == (False, NOT_FOUND)
    row = _row(point)
    assert row["alpha_deg"] is row["throttle_margin"] is row["residual"] is None
    assert json.dumps(row, allow_nan=False)


def grid_of(points=9):
    return Grid(
        read_values("--altitude", f"22:32km:{points}", "m", 2),
        read_values("--mach", f"5:9:{points}", "", 2),
        read_values("--mass", "110,136.0776t", "kg", 2),
    )


def points_of(grid):
    return [
        envelope_point(altitude, mach, mass)
        for mass in grid.masses.numbers
        for altitude in grid.altitudes.numbers
        for mach in grid.machs.numbers
    ]


def test_the_line_of_the_picture_is_where_alpha_is_5_deg():
    grid = grid_of(25)
    figure = draw_envelope(points_of(grid), grid, "envelope")
    for column, mass in enumerate(grid.masses.numbers):
        axes = figure.axes[column]
        assert axes.get_title() == f"{mass / 1000:g} t"
        line = axes.collections[-1].get_paths()[0].vertices
        assert len(line) > 10
        for mach, height in line:
            speed = mach * atmosphere(1000 * height, False).sound_speed
            assert trim(1000 * height, speed, mass).alpha * DEGREES == pytest.approx(5.0, abs=0.02)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "no trim: alpha not within -5 to 5 deg" in labels
    assert not any("no trim found" in label for label in labels)


def test_the_picture_shows_where_there_is_no_trim_at_all():
    grid = grid_of(5)
    points = points_of(grid)
    nothing = float("nan")
    numbers = ("alpha_deg", "elevon_deg", "throttle", "dynamic_pressure_pa")
    points[0] = points[0]._replace(within_limits=False, **dict.fromkeys(numbers, nothing))
    figure = draw_envelope(points, grid, "with a hole")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "no trim found" in labels


def test_the_command_keeps_table_and_picture(tmp_path):
    grid = ("--altitude", "24:28km:3", "--mach", "5,6,7", "--mass", "110,136.0776t")
    result = told("trim", "--map", *grid, "--out", tmp_path, "--json")
    assert result.returncode == 0, result.stderr
    content = json.loads(result.stdout)
    assert content["altitude"] == {"unit": "m", "values": [24e3, 26e3, 28e3]}
    assert content["mass"] == {"unit": "kg", "values": [110e3, 136077.6]}
    assert content["limits"]["throttle"] == {
        "name": "throttle", "low": 0.1, "high": 0.9, "unit": ""
    }  # fmt: skip
    points = content["points"]
    assert len(points) == 18
    assert pq.read_table(tmp_path / "trim.parquet").to_pylist() == points
    assert json.loads((tmp_path / "trim.json").read_text())["points"] == points
    one = next(p for p in points if (p["altitude_m"], p["mach"], p["mass_kg"]) == (26e3, 6, 110e3))
    alone = json.loads(
        told("trim", "--altitude", "26km", "--mach", 6, "--mass", "110t", "--json").stdout
    )
    assert one["alpha_deg"] == pytest.approx(alone["alpha_deg"], abs=1e-9)
    assert one["throttle"] == pytest.approx(alone["throttle"], abs=1e-9)
    with Image.open(tmp_path / "trim.png") as picture:
        assert min(picture.size) > 600
    text = told("trim", "--map", *grid, "--out", tmp_path).stdout
    rows = {line.split()[0]: line.split(maxsplit=1)[1] for line in text.splitlines()[5:8]}
    assert rows["24"].split("  ")[0] == "5 to 7"
    assert rows["28"].startswith("(alpha) 6 to 7")
    assert "of 18 points have a trim" in text


def test_a_map_without_a_trim_says_so(tmp_path):
    result = told("trim", "--map", "--altitude", "1:2km:2", "--mach", "9,10", "--out", tmp_path)
    assert result.returncode == 1
    assert result.stderr == "ahv: no point has a trim within the limits\n"
    assert "none (throttle)" in result.stdout
    assert (tmp_path / "trim.png").exists()


def test_a_single_trim_says_where_the_inlet_would_unstart():
    result = told("trim", "--altitude", "30km")
    assert result.returncode == 0
    assert result.stderr == "ahv: the inlet unstarts there: alpha 8.055 deg (-5 to 5)\n"
    assert told("trim").stderr == ""


@pytest.mark.unit
@pytest.mark.parametrize("text, value", [("24000", 24e3), ("24000m", 24e3), ("24.3km", 24.3e3)])
def test_a_number_may_have_its_unit(text, value):
    assert read_number("altitude", text, "m") == value


@pytest.mark.unit
@pytest.mark.parametrize("text", ["", "km", "24 mi", "24t", "0x10", "1:2"])
def test_what_is_no_number_is_refused(text):
    with pytest.raises(ParameterError, match=r"altitude: .* is not a number, in m or km"):
        read_number("altitude", text, "m")


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("--altitude", "20:34km"), ("--altitude", "one number without --map")),
        (("--mass", "80,110t"), ("--mass", "one number without --map")),
        (("--mach", 6, "--speed", 1800), ("--speed and --mach",)),
        (("--mach", 3), ("speed 893", "Mach 4 to 24")),
        (("--out", "x"), ("--out", "--map")),
        (("--map", "--speed", 1800), ("--speed", "--mach")),
        (("--map", "--altitude", "20:50km"), ("altitude", "0 to 47000 m")),
        (("--map", "--altitude", "24km"), ("--altitude", "LOW:HIGH")),
        (("--map", "--altitude", "20:34mi"), ("--altitude", "'34mi'", "m or km")),
        (("--map", "--altitude", "34:20km"), ("--altitude", "LOW is 34")),
        (("--map", "--mach", "3:10"), ("--mach is 3", "4 to 24")),
        (("--map", "--mach", "4:10:1"), ("--mach", "COUNT is 1")),
        (("--map", "--mach", "4:10:100000000"), ("--mach", "COUNT is 100000000", "1000 or less")),
        (
            ("--map", "--mach", "4:10:1000", "--altitude", "20:34km:90"),
            ("270000 points", "200000"),
        ),
        (("--map", "--mach", "4:nan"), ("--mach", "finite")),
        (("--map", "--out", "/dev/null/x"), ("/dev/null/x", "cannot hold a map")),
        (("--map", "--mass", "50,80t"), ("mass 50000 kg", "60000 to 140000 kg")),
        (("--map", "--mass", "110,80t"), ("--mass", "from low to high")),
        (("--map", "--mass", "60:140t:9"), ("--mass has 9 values", "room for 6")),
        (("--map", "--mass", ""), ("--mass", "not a number")),
    ],
)
def test_wrong_input_is_named(arguments, words, tmp_path):
    result = told("trim", *arguments, cwd=tmp_path)
    assert_refused(result, words, tmp_path)
