# Copyright 2026 ahv developers, Apache-2.0
"""The view in three dimensions of a report page: what it shows, and one time for all."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly_library
from ahv_analysis.report.page import render
from ahv_analysis.report.page_flight import read_flights
from ahv_analysis.report.page_scene import scene_channels
from ahv_plant.model.aerodynamics import aerodynamic_coefficients, air_data
from ahv_plant.model.constants import GRAVITY, WING_AREA
from ahv_plant.model.vectors import State, Surfaces
from test.browsing import wait_for

NOSE = (
    "new THREE.Vector3(1, 0, 0).applyQuaternion(stage.view.vehicles[0].group.quaternion).toArray()"
)
DRAWN = "stage.drawn === cursor.time && !stage.waiting"


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """Three seconds of the nominal flight, which begins with turn rates, and a lost one."""
    folder = tmp_path_factory.mktemp("scene")
    fly_library(load_case("nominal_di", {"duration": 3.0}), folder / "short" / "bag")
    fly_library(load_case("nominal_di_dispersed"), folder / "lost" / "bag")
    return read_flights([folder / "short" / "bag", folder / "lost" / "bag"])


@pytest.fixture(scope="module")
def pages(flights, tmp_path_factory):
    """Pages of both without the report's figures, and one that overlays them."""
    folder = tmp_path_factory.mktemp("pages")
    for name, shown in (("short", flights[:1]), ("lost", flights[1:]), ("both", flights)):
        (folder / f"{name}.html").write_text(render(shown), encoding="utf-8")
    return folder


def forward(record, step):
    """Unit vector (3,) of the nose in axes north, up and east."""
    phi, theta, psi = record.states[step, 6:9]
    north, east, down = Rotation.from_euler("ZYX", (psi, theta, phi)).apply((1.0, 0.0, 0.0))
    return north, -down, east


def test_a_scrub_moves_vehicle_surfaces_readings_and_every_plot(flights, pages, visit):
    page, requests, complaints = visit(pages / "short.html")
    wait_for(page, DRAWN)
    page.locator("#flight input").fill("1.5")
    wait_for(page, f"cursor.time === 1.5 && {DRAWN}")
    record = flights[0].record
    nose = page.evaluate(NOSE)
    assert nose == pytest.approx(forward(record, 150), abs=1e-6)
    turned = page.evaluate(
        "stage.view.vehicles[0].surfaces.map(({mesh, axis}) => 2 * Math.atan2("
        "new THREE.Vector3(mesh.quaternion.x, mesh.quaternion.y, mesh.quaternion.z).dot(axis),"
        " mesh.quaternion.w))"
    )
    assert turned == pytest.approx(record.surfaces[150], abs=1e-6)
    assert record.surfaces[150] != pytest.approx(record.surfaces[0], abs=1e-3)
    shown = page.locator('[data-reading="h"]').inner_text()
    assert shown == f"{record.states[150, 11] / 1000:.3f} km"
    assert set(page.evaluate("charts.map((chart) => chart.cursor.idx)")) == {150}
    assert page.locator("#cursor").inner_text() == "t = 1.50 s"
    assert complaints == [] and len([one for one in requests if one.startswith("file:")]) == 1


def test_a_mouse_over_a_plot_moves_the_vehicle(pages, visit):
    page, _, _ = visit(pages / "short.html", viewport={"width": 1400, "height": 900})
    plot = page.locator(".plot .u-over").nth(3)
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 3, box["y"] + 40)
    wait_for(page, f"Math.abs(cursor.time - 1) < 0.05 && {DRAWN}")
    assert float(page.locator("#flight input").input_value()) == pytest.approx(1.0, abs=0.05)


def test_play_goes_to_the_end_at_the_speed_that_is_set_and_pauses_where_it_is(pages, visit):
    page, _, complaints = visit(pages / "short.html")
    button = page.locator("#flight .play")
    page.locator("#flight select").select_option("20")
    began = page.evaluate("performance.now()")
    button.click()
    wait_for(page, "cursor.time === 3 && !cursor.playing")
    assert page.evaluate("performance.now()") - began > 1e3 * 3.0 / 20.0  # [ms]
    assert button.inner_text() == "Play"
    page.locator("#flight select").select_option("0.1")
    button.click()  # from the start again
    wait_for(page, "cursor.playing && cursor.time > 0 && cursor.time < 3")
    assert button.inner_text() == "Pause"
    button.click()
    paused = page.evaluate("cursor.time")
    page.evaluate(
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    )
    assert page.evaluate("cursor.time") == paused
    assert complaints == []


def test_the_camera_turns_by_mouse_and_keys_and_comes_back(pages, visit):
    page, _, _ = visit(pages / "short.html")
    canvas = page.locator("#flight canvas")
    box = canvas.bounding_box()
    start = page.evaluate("stage.view.camera.azimuth")
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 200, box["y"] + 100)
    page.mouse.up()
    assert page.evaluate("stage.view.camera.azimuth") > start + 0.5
    page.locator("#flight .camera").click()
    canvas.press("ArrowRight")
    assert page.evaluate("stage.view.camera.azimuth") == pytest.approx(start + 0.1)
    page.locator('[data-view="path"]').click()
    wait_for(page, "stage.view === stage.views.path && !stage.waiting")
    assert "Heights" in page.locator(".view-note").inner_text()


def test_commands_are_held_and_signals_are_not(pages, visit):
    page, _, _ = visit(pages / "short.html")
    held = {
        name: page.evaluate(
            f"String(charts[{index}].series[1].paths) === String(uPlot.paths.stepped({{}}))"
        )
        for index, name in enumerate(page.evaluate("drawings.map((drawing) => drawing.name)"))
    }
    assert {name for name, stepped in held.items() if stepped} == {
        *("right elevon", "left elevon", "rudder", "throttle")
    }


def test_a_lost_vehicle_is_called_lost_from_where_it_tumbles(flights, pages, visit):
    page, _, complaints = visit(pages / "lost.html")
    record = flights[1].record
    beyond = np.any(np.abs(np.degrees(record.states[:, 3:6])) > 60.0, axis=1)
    time = record.time[np.argmax(beyond)]
    state = page.locator("#flight [data-state]")
    page.evaluate(f"seek({time - 0.01})")
    assert state.inner_text() == "in flight"
    page.evaluate(f"seek({time})")
    assert state.inner_text() == f"lost at {time:.2f} s"
    page.evaluate("seek(whole.max)")
    wait_for(page, DRAWN)
    assert complaints == []


def test_two_flights_are_overlaid_each_until_its_own_end(flights, pages, visit):
    page, _, _ = visit(pages / "both.html")
    assert page.evaluate("Object.values(stage.views).map((view) => view.vehicles.length)") == [
        2,
        2,
    ]
    page.evaluate("seek(10)")
    wait_for(page, DRAWN)
    assert page.locator("#flight [data-state]").all_inner_texts() == ["ended", "in flight"]
    nose = page.evaluate(NOSE)
    assert nose == pytest.approx(forward(flights[0].record, -1), abs=1e-6)


def test_without_webgl_a_sentence_stands_there_and_the_plots_work(pages, visit):
    none = (
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...rest)"
        "{ return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest); };"
    )
    page, _, complaints = visit(pages / "short.html", none)
    assert (
        page.locator(".no-scene").is_visible() and not page.locator("#flight canvas").is_visible()
    )
    assert "no WebGL" in page.locator(".no-scene").inner_text()
    page.evaluate("seek(1)")
    assert set(page.evaluate("charts.map((chart) => chart.cursor.idx)")) == {100}
    assert complaints == []


def test_the_lift_that_is_drawn_is_that_of_the_vehicle_that_flew(flights):
    flight = flights[1]
    found, record = scene_channels(flight)["lift"], flight.record
    by = flight.case.plant.truth.dispersion.CL
    assert by != 1.0
    for step in (0, 100, 900):
        state = State(*record.states[step])
        air = air_data(state, False)
        coefficient = (
            by * aerodynamic_coefficients(air, state, Surfaces(*record.surfaces[step])).CL
        )
        weight = state.mass * GRAVITY
        assert found[step] == pytest.approx(
            air.dynamic_pressure * WING_AREA * coefficient / weight, rel=1e-5
        )


def test_what_is_shown_of_a_lost_flight_are_numbers(flights):
    channels = scene_channels(flights[1])
    assert {len(values) for values in channels.values()} == {len(channels["time"])}
    assert all(np.all(np.isfinite(values)) for values in channels.values())
    assert channels["time"][-1] > 18.0
