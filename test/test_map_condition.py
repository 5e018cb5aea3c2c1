# Copyright 2026 ahv developers, Apache-2.0
"""A map over altitude, Mach number and mass flies each case as it is, somewhere else."""

import json
from math import atan, sqrt

import numpy as np
import pyarrow.parquet as pq
import pytest

from ahv_analysis.campaign.axis import places_of, read_axis, with_value
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.campaign.condition import at_condition
from ahv_analysis.campaign.map import Map
from ahv_analysis.flight.case import load_case, make_case, read_case
from ahv_analysis.flight.library import fly
from ahv_analysis.report.map_figure import draw_map
from ahv_msgs_py.case_file import case_names
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import Dispersion
from ahv_plant.model.constants import DEGREES
from ahv_plant.trim import trim
from test.test_command import assert_refused, told

CASE = "neuro_adaptive_di"
ALTITUDE, MACH = "altitude=22:30km:2", "mach=5:9:2"
BEYOND = {(30000.0, 5.0): "alpha above 5 deg"}  # heavy, slow and high


def tiny(x=ALTITUDE, y=MACH):
    return Map(CASE, read_case(CASE)[1], read_axis(x), read_axis(y), 0.2, 1, 5)


@pytest.mark.parametrize("name", case_names())
def test_the_point_at_its_own_commands_is_the_case(name):
    map_ = Map(
        name, read_case(name)[1], read_axis("altitude=24:25km:2"), read_axis("mass=136.0776,137t"),
        0.2, 3, 7,
    )  # fmt: skip
    own = map_.campaigns[24000.0, 136077.6]
    assert own.describe() == Campaign(load_case(name), 0.2, 3, 7).describe()
    assert map_.campaigns[25000.0, 137000.0].describe() != own.describe()


def test_mach_sets_the_speed_command_by_the_speed_of_sound_at_the_commanded_altitude():
    """ISO 2533: 220.65 K at 24 km, 1 K/km more above. The report's 1786.4 m/s is Mach 5.99904."""
    for altitude, temperature in ((24000.0, 220.65), (22000.0, 218.65)):
        sound = sqrt(1.4 * 287.05287 * temperature)
        given, why = at_condition(CASE, read_case(CASE)[1], {"altitude": altitude, "mach": 6.0})
        case = make_case(CASE, given)
        assert not why
        assert case.control.velocity.speed == pytest.approx(6.0 * sound, abs=1e-6)
        assert case.control.outer.altitude == altitude
    assert load_case(CASE).control.velocity.speed == pytest.approx(
        5.99904 * sqrt(1.4 * 287.05287 * 220.65), abs=1e-3
    )


@pytest.mark.parametrize(
    "condition",
    [
        {"altitude": 22000.0, "mach": 5.0},
        {"altitude": 30000.0, "mach": 9.0},
        {"altitude": 28000.0, "mach": 8.0, "mass": 90000.0},
        {"mass": 100000.0},
    ],
)
def test_every_point_starts_as_far_from_its_trim_as_the_case_does(condition):
    given, why = at_condition(CASE, read_case(CASE)[1], condition)
    case, own = make_case(CASE, given), load_case(CASE)
    start, first = case.plant.initial, own.plant.initial
    speed, mass = case.control.velocity.speed, condition.get("mass", first.mass)
    found = trim(case.control.outer.altitude, speed, mass)
    assert not why and start.mass == mass
    assert start.h == case.control.outer.altitude
    assert start.u - speed == pytest.approx(first.u - 1786.4, abs=1e-9)
    assert start.theta - found.alpha == pytest.approx(first.theta - trim().alpha, abs=1e-9)
    assert atan(start.w / start.u) * DEGREES == pytest.approx(found.alpha * DEGREES, abs=0.01)


@pytest.mark.parametrize("altitude, mach, mass", [(22e3, 5.0, 1e5), (30e3, 9.0, 136e3)])
def test_a_nominal_vehicle_flies_on_level_from_there(altitude, mach, mass):
    _, given = read_case("neuro_adaptive_di")
    conditions = {"altitude": altitude, "mach": mach, "mass": mass}
    given, _ = at_condition(CASE, given, conditions)
    nominal = {f"dispersion.{name}": 1.0 for name in Dispersion._fields}
    given["plant"] |= {**nominal, "duration": 5.0}
    states = [step.state for step in fly(make_case(CASE, given))]
    alpha = [atan(state.w / state.u) * DEGREES for state in states]
    assert max(alpha) - min(alpha) < 0.05
    assert max(abs(state.h - altitude) for state in states) < 1.0


def test_points_without_a_trim_are_named_and_not_flown():
    map_ = tiny()
    assert map_.without_trim == BEYOND
    assert list(map_.campaigns) == [(22000.0, 5.0), (22000.0, 9.0), (30000.0, 9.0)]
    with pytest.raises(ParameterError, match=r"no point of the map has a trim.*alpha above 5 deg"):
        _ = tiny("altitude=33:34km:2", "mach=4,5").campaigns


def test_what_no_axis_sets_stays():
    map_ = tiny("altitude=23:26km:2", "latency.delay=0,0.02")
    case = map_.campaigns[26000.0, 0.02].case
    assert case.control.velocity.speed == 1786.4
    assert case.plant.initial.mass == 136077.6
    assert case.parameters["plant"]["latency.delay"] == 0.02
    own = load_case(CASE).parameters
    assert case.parameters["inner_loop"] == own["inner_loop"]
    assert case.parameters["plant"]["dispersion.CL"] == own["plant"]["dispersion.CL"]


def test_the_command_alone_is_set_by_the_name_with_its_node():
    (place,) = places_of("outer_intermediate.altitude")
    assert (place[0], place[1].name) == ("outer_intermediate", "altitude")
    case = make_case(CASE, with_value(read_case(CASE)[1], (place,), 24500.0))
    assert (case.control.outer.altitude, case.plant.initial.h) == (24500.0, 24000.0)


def test_units_and_lists():
    assert read_axis("altitude=22:32km:3").values == (22000.0, 27000.0, 32000.0)
    assert read_axis("altitude=22:32km:3").title == "altitude [km]"
    assert read_axis("altitude=22000:32000:3").values == (22000.0, 27000.0, 32000.0)
    assert read_axis("altitude=22.1,22.7km").values == (22100.0, 22700.0)
    assert read_axis("mass=80,110,136.0776t").values == (80e3, 110e3, 136077.6)
    assert read_axis("mass=80t:110t:2").values == (80e3, 110e3)
    assert read_axis("initial.h=23:25km:3").values == (23000.0, 24000.0, 25000.0)


def test_the_picture_is_hatched_where_nothing_was_flown():
    x, y = read_axis(ALTITUDE), read_axis(MACH)
    figure = draw_map(x, y, np.array([[0.5, np.nan], [1.0, 0.9]]), "with a hole")
    axes = figure.axes[0]
    assert axes.get_xlabel() == "altitude [km]"
    assert list(axes.get_xticks()) == [22.0, 30.0]
    assert axes.patch.get_hatch()
    assert np.ma.getmaskarray(axes.collections[0].get_array()).sum() == 1
    assert "no trim" in figure.legends[0].get_texts()[0].get_text()
    assert not draw_map(x, y, np.ones((2, 2)), "whole").legends


def test_the_command_names_what_it_did_not_fly(tmp_path):
    command = ("map", CASE, "--x", ALTITUDE, "--y", MACH, "--level", 0.2, "--set", "duration=1")
    command = (*command, "--runs", 2, "--workers", 2, "--out", tmp_path)
    result = told(*command, "--json")
    assert result.returncode == 0, result.stderr
    content = json.loads(result.stdout)
    missing = [{"x": 30000.0, "y": 5.0, "why": "alpha above 5 deg"}]
    assert content["without_trim"] == missing
    assert json.loads((tmp_path / "map.json").read_text())["without_trim"] == missing
    flown = pq.read_table(tmp_path / "map.parquet").to_pylist()
    assert [(row["x"], row["y"]) for row in flown] == [(22e3, 5.0), (22e3, 9.0), (30e3, 9.0)]
    assert content["x"] == {"name": "altitude", "unit": "m", "values": [22e3, 30e3]}
    table = told(*command).stdout
    assert "altitude [km] to the right" in table
    assert "-: not flown, for there is no trim: alpha above 5 deg" in table


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("altitude=22:50km", MACH), ("altitude is 50000.0", "0 to 47000 m")),
        ((ALTITUDE, "mach=3:9"), ("mach is 3.0", "4 to 24")),
        ((ALTITUDE, "mass=50,80t"), ("mass is 50000.0", "60000 to 140000 kg")),
        (("altitude=22:32kg", MACH), ("altitude", "'32kg' is not a number, in m or km")),
        (("altitude=22m:32km", MACH), ("altitude", "one unit")),
        (("altitude=32:22km", MACH), ("LOW is 32", "below HIGH, 22km")),
        ((ALTITUDE, "mass=110,80t"), ("mass", "from low to high")),
        ((ALTITUDE, "mass=110t"), ("mass", "2 values")),
        ((ALTITUDE, "mach=4:9km"), ("mach", "'9km' is not a number")),
        ((ALTITUDE, "mach=4:inf"), ("mach", "finite")),
        ((ALTITUDE, "mach=4:5:6:7"), ("mach", "LOW:HIGH")),
        ((ALTITUDE, "altitude=23:25km"), ("both set altitude",)),
        ((ALTITUDE, "initial.theta=1:3"), ("flight condition and initial.theta",)),
        ((ALTITUDE, MACH, "--set", "altitude=25000"), ("both set altitude",)),
        ((ALTITUDE, MACH, "--set", "velocity.speed=1800"), ("both set speed",)),
        ((ALTITUDE, MACH, "--set", "mass=80000"), ("mass", "axis", "initial.mass")),
        ((ALTITUDE, "match=5:9"), ("match", "did you mean 'mach'")),
        (("altitude=33:34km", "mach=4:5"), ("no point of the map has a trim", "alpha above")),
        ((ALTITUDE, "mass=80,90t", "--set", "velocity.speed=1000"), ("speed 1000", "Mach 4 to")),
    ],
)
def test_wrong_input_is_named(arguments, words, tmp_path):
    x, y, *more = arguments
    result = told("map", CASE, "--x", x, "--y", y, *more, "--runs", 1, cwd=tmp_path)
    assert_refused(result, words, tmp_path)
