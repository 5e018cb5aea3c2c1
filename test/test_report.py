# Copyright 2026 ahv developers, Apache-2.0
"""`ahv report`: metrics against closed forms, and pages as a browser sees them."""

import json
import re
import shutil
from functools import partial
from math import exp, log, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.command.app import app
from ahv_analysis.flight.case import Draw, load_case
from ahv_analysis.flight.library import fly, fly_library, write_step
from ahv_analysis.report.metrics import (
    integral,
    margin,
    margins,
    measure,
    overshoot,
    rms,
    settling_time,
    tracking,
    use,
    why_ended_early,
)
from ahv_analysis.report.page import number, render
from ahv_analysis.report.page_flight import page_names, read_flights
from ahv_analysis.report.summary import summarize
from ahv_plant.model.constants import RADIANS
from test.browsing import wait_for
from test.waiting import wait_until

TIME = np.arange(10001) * 0.01  # [s] to 100 s
EVERY = slice(None, -1)  # sample but the last: whole periods


def test_rms_of_a_sine_is_its_amplitude_over_root_two():
    assert rms(3.0 * np.sin(2 * pi * TIME[EVERY] / 10.0)) == pytest.approx(3.0 / sqrt(2.0), 1e-12)


def test_an_exponential_settles_when_it_enters_the_band():
    error = 8.0 * np.exp(-TIME / 5.0)
    exact = 5.0 * log(8.0 / 0.5)
    assert exact <= settling_time(TIME, error, 0.5) < exact + 0.01
    assert settling_time(TIME + 7.0, error, 0.5) == pytest.approx(
        settling_time(TIME, error, 0.5), abs=1e-9
    )


def test_what_leaves_the_band_again_is_not_settled_before():
    error = np.where((TIME >= 60.0) & (TIME < 70.0), 1.0, 0.0)
    assert settling_time(TIME, error, 0.5) == pytest.approx(70.0)


def test_what_never_leaves_is_settled_at_once_and_what_ends_outside_is_not():
    assert settling_time(TIME, np.full_like(TIME, 0.5), 0.5) == 0.0
    assert settling_time(TIME, TIME, 0.5) is None


@pytest.mark.parametrize("start", [4.0, -4.0])
@pytest.mark.parametrize("damping", [0.2, 0.5])
def test_overshoot_of_an_oscillator_is_that_of_the_textbook(damping, start):
    rate = 0.3 * sqrt(1.0 - damping**2)
    decay = np.exp(-damping * 0.3 * TIME)
    error = start * decay * (np.cos(rate * TIME) + damping * 0.3 / rate * np.sin(rate * TIME))
    exact = 4.0 * exp(-pi * damping / sqrt(1.0 - damping**2))
    assert overshoot(error) == pytest.approx(exact, rel=1e-5)
    assert overshoot(start * decay) == 0.0


def test_what_begins_within_the_band_has_no_overshoot_to_speak_of():
    found = tracking(TIME, np.sin(TIME), 0.5)
    assert found.overshoot is None and found.largest == pytest.approx(1.0, abs=1e-4)
    assert (found.initial, found.final) == (0.0, np.sin(100.0))


def test_effort_and_travel_of_a_triangle():
    triangle = 2.0 * np.abs(TIME % 20.0 - 10.0) - 10.0  # five periods between -10 and 10
    found = use(TIME, triangle, (-20.0, 20.0))
    assert found.effort == pytest.approx(100.0 * 10.0**2 / 3.0, rel=1e-5)
    assert found.travel == pytest.approx(5 * 2 * 20.0)
    assert (found.lowest, found.highest, found.saturated_s) == (-10.0, 10.0, 0.0)


def test_a_command_counts_until_the_next_one_and_the_last_not_at_all():
    time, command = np.array([0.0, 1.0, 3.0, 3.5]), np.array([0.9, 0.1, 0.5, 0.9])
    assert use(time, command, (0.1, 0.9)).saturated_s == 1.0 + 2.0
    assert integral(time, command) == pytest.approx(0.9 + 2 * 0.1 + 0.5 * 0.5)


def test_margin_of_a_ramp():
    found = margin(TIME, TIME * 0.1 * RADIANS, 5.0 * RADIANS)
    assert found.largest_deg == pytest.approx(10.0) and found.largest_at_s == 100.0
    assert found.margin_deg == pytest.approx(-5.0)
    assert found.first_beyond_s == pytest.approx(50.01)
    assert found.beyond_s == pytest.approx(49.99)


def short(name, **plant):
    return load_case(name, {"duration": 2.0} | plant)


def test_the_actual_disturbance_is_the_one_that_was_flown():
    quiet = {f"initial.{rate}": 0.0 for rate in "PQR"}
    case = short("nominal_di", **quiet, **{"disturbance.Q.constant": 2.0})
    found = record_of(fly(case), False).actual_disturbance / RADIANS
    # within a step of 0.01 s the law turns a fiftieth of the disturbance away
    assert found[:, 1] == pytest.approx(2.0, abs=0.05)
    assert found[:, [0, 2]] == pytest.approx(0.0, abs=0.01)


def test_a_learner_that_learned_misses_less_than_it_did_at_first():
    flown = record_of(fly(short("neuro_adaptive_di")), False)
    learned = measure(flown, short("neuro_adaptive_di").control)["learner"]["pitch"]
    assert abs(learned["estimate_final_dps2"]) < learned["estimate_rms_dps2"] / 3
    assert learned["observer_largest_dps"] < 0.7  # k_b


def test_summary_and_report_have_one_definition():
    case = short("nominal_di")
    flown = record_of(fly(case), False)
    summary, metrics = summarize(flown, ""), measure(flown, case.control)
    assert summary["fuel_kg"] == metrics["fuel_kg"] > 0
    assert summary["max_abs_alpha_deg"] == metrics["margins"]["alpha"]["largest_deg"]
    assert summary["success"] is (margins(flown)["alpha"].first_beyond_s is None)


def test_why_a_flight_ended_early_is_found_from_the_bag_as_the_engine_said(tmp_path):
    case = load_case("nominal_di_dispersed")
    said, _ = fly_library(case, tmp_path / "bag")
    assert said and why_ended_early(read_bag(tmp_path / "bag"), case) == said
    whole = short("nominal_di")
    assert why_ended_early(record_of(fly(whole), False), whole) == ""


def test_an_interrupted_recording_is_not_taken_for_a_termination(tmp_path):
    case = short("nominal_di")
    bag = BagWriter(tmp_path / "bag")
    for step, _ in zip(fly(case), range(51), strict=False):
        write_step(bag, step)
    bag.close()
    assert (
        why_ended_early(read_bag(tmp_path / "bag"), case) == "the recording stops at 0.5 s of 2 s"
    )


def test_numbers_are_written_to_be_read():
    assert [number(value) for value in (None, 0.0, -3e-9, 0.5, -14.9597, 21398.3, 4.5e38)] == [
        *("–", "0", "0", "0.5000", "−14.96", "21\u202f398", "4.50e+38")
    ]


def test_names_tell_flights_apart(tmp_path):
    assert page_names([Path("/a/one/bag"), Path("/b/two")]) == ["one", "two"]
    assert page_names([Path("/a/one/bag"), Path("/b/one")]) == ["a-one", "b-one"]
    assert page_names([Path("/a/comparison/bag")]) == ["a-comparison"]


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """An adaptive flight of 150 s of a drawn vehicle, and a lost one."""
    folder = tmp_path_factory.mktemp("bags")
    adaptive = load_case("neuro_adaptive_sc_gdi", draw=Draw(0.4, 3, 17))
    fly_library(adaptive, folder / "adaptive" / "bag")
    fly_library(load_case("nominal_di_dispersed"), folder / "lost" / "bag")
    return folder


def ahv(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def pages(bags):
    result = ahv("report", bags / "adaptive/bag", bags / "lost/bag", "--out", bags / "p", "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def windows(page):
    """Range of time that each plot of a page shows."""
    return page.evaluate("charts.map((chart) => [chart.scales.x.min, chart.scales.x.max])")


def test_there_is_a_page_for_each_flight_and_one_for_both(pages):
    assert [Path(page).name for page in pages["pages"]] == [
        *("adaptive.html", "lost.html", "comparison.html")
    ]
    assert [flight["verdict"] for flight in pages["flights"]] == ["success", "failure"]
    assert "inlet unstart" in pages["flights"][1]["reason"]
    assert "state is not finite" in pages["flights"][1]["reason"]


def test_every_page_is_quiet_and_asks_for_nothing(pages, visit):
    for file in pages["pages"]:
        page, requests, complaints = visit(file)
        assert complaints == []
        assert [url for url in requests if not url.startswith("data:")] == [Path(file).as_uri()]
        page.evaluate("fetch('https://example.org/').catch(() => null)")
        look = partial(page.wait_for_timeout, 20)
        wait_until(complaints.copy, "its own policy forbids it, and the browser says so", look)
        assert all("Content Security Policy" in complaint for complaint in complaints)


def test_a_zoom_on_one_plot_moves_all(pages, visit):
    page, _, _ = visit(pages["pages"][0], viewport={"width": 1400, "height": 900})
    assert len(windows(page)) == 25 and set(map(tuple, windows(page))) == {(0, 150)}
    plot = page.locator(".plot .u-over").nth(3)
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.2, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.6, box["y"] + 60, steps=5)
    page.mouse.up()
    wait_for(page, "charts.every((chart) => chart.scales.x.max < 150)")
    (low, high), *others = {tuple(window) for window in windows(page)}
    assert others == []
    assert low == pytest.approx(30.0, abs=1.0) and high == pytest.approx(90.0, abs=1.0)
    assert "t = " in page.locator("#cursor").inner_text()
    page.mouse.dblclick(box["x"] + 50, box["y"] + 50)
    wait_for(page, "charts.every((chart) => chart.scales.x.max === 150)")


def test_a_plot_holds_every_step(pages, visit):
    page, _, _ = visit(pages["pages"][0])
    assert page.evaluate("charts.map((chart) => chart.data[0].length)") == [15001] * 25


def test_pages_fit_a_desk_and_when_it_is_made_narrow_a_phone(pages, visit):
    for file in (pages["pages"][0], pages["pages"][-1]):
        page, _, _ = visit(file, viewport={"width": 1400, "height": 844})
        for width, plot in ((1400, 200), (390, 250)):
            page.set_viewport_size({"width": width, "height": 844})
            wait_for(page, "charts.every((chart) => chart.root.clientWidth <= innerWidth)")
            assert page.evaluate("document.documentElement.scrollWidth") == width
            assert page.evaluate("Math.min(...charts.map((one) => one.over.clientWidth))") > plot


def test_a_page_tells_what_flew(pages):
    page = Path(pages["pages"][0]).read_text()
    assert len(page) < 10e6
    for words in ("neuro_adaptive_sc_gdi", "level 0.4, seed 3, run 17", "numba", "Source hash"):
        assert words in page
    assert len(re.findall("data:image/svg", page)) == 5  # figures 5.1 to 5.5
    # the licences go with uPlot and three.js
    assert page.count("Permission is hereby granted") == 2 and "three.js authors" in page


def test_a_bag_without_notes_has_a_page_that_says_so(tmp_path):
    bag = BagWriter(tmp_path / "bag")
    for step in fly(short("nominal_di")):
        write_step(bag, step)
    bag.close()
    (flight,) = read_flights([tmp_path / "bag"])
    assert flight.verdict.word == "open"
    assert "altitude" not in flight.metrics["tracking"]
    assert "the bag has no notes" in render([flight])


def a_single_step(folder):
    bag = BagWriter(folder / "single")
    write_step(bag, next(fly(short("neuro_adaptive_di"))))
    bag.close()
    return folder / "single"


def cut(bag, folder):
    shutil.copytree(bag, folder / "cut")
    file = next((folder / "cut").glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:5000])
    return folder / "cut"


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda bag, tmp: [tmp / "none", "--out", tmp / "o"], "none is not a bag"),
        (lambda bag, tmp: [cut(bag, tmp), "--out", tmp / "o"], "cut is not whole"),
        (lambda bag, tmp: [a_single_step(tmp), "--out", tmp / "o"], "holds no two steps"),
        (lambda bag, tmp: [bag, bag, "--out", tmp / "o"], "is given 2 times"),
        (lambda bag, tmp: [bag, "--out", bag / "metadata.yaml"], "cannot write pages to"),
        (lambda bag, tmp: [bag, "--out", bag.parent.parent / "p"], "lost.html exists already"),
    ],
)
def test_wrong_input_is_one_sentence(bags, pages, tmp_path, make, words):
    arguments = make(bags / "lost" / "bag", tmp_path)
    result = ahv("report", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr and result.stderr.count("\n") == 1
    assert not (tmp_path / "o").exists()
