# Copyright 2026 ahv developers, Apache-2.0
"""Report pages for everybody: what axe-core finds, and keys in place of a mouse."""

import pytest
from axe_playwright_python.sync_playwright import Axe

from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly_library
from ahv_analysis.report.page import draw_figures, render
from ahv_analysis.report.page_flight import read_flights
from test.browsing import wait_for


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Pages of a short flight with its figures, and of it beside a lost one."""
    folder = tmp_path_factory.mktemp("access")
    fly_library(load_case("nominal_di", {"duration": 3.0}), folder / "short" / "bag")
    fly_library(load_case("nominal_di_dispersed"), folder / "lost" / "bag")
    flights = read_flights([folder / "short" / "bag", folder / "lost" / "bag"])
    alone = render(flights[:1], draw_figures(flights[0])[:1])
    (folder / "alone.html").write_text(alone, encoding="utf-8")
    (folder / "both.html").write_text(render(flights), encoding="utf-8")
    return folder


def findings(page):
    """What axe-core calls serious or critical, and where."""
    found = Axe().run(page).response["violations"]
    return [
        (one["id"], [node["html"] for node in one["nodes"]])
        for one in found
        if one["impact"] in ("serious", "critical")
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["alone", "both"])
def test_axe_finds_nothing_serious(pages, visit, name, scheme):
    page, _, _ = visit(pages / f"{name}.html", color_scheme=scheme)
    assert findings(page) == []


def test_axe_would_find_a_picture_without_words_and_faint_ones(pages, visit):
    page, _, _ = visit(pages / "alone.html")
    page.evaluate(
        "document.querySelector('.figures img').removeAttribute('alt');"
        "document.querySelector('.note').style.color = '#ccc'"
    )
    assert {name for name, _ in findings(page)} == {"color-contrast", "image-alt"}


def test_keys_on_a_plot_move_the_cursor_and_zoom(pages, visit):
    page, _, _ = visit(pages / "alone.html")
    plot = page.locator(".plot").nth(2)
    plot.focus()
    page.keyboard.press("End")
    assert page.evaluate("cursor.time") == 3
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("cursor.time") == pytest.approx(3 - 3 / 200)
    page.keyboard.press("+")
    wait_for(page, "charts.every((chart) => Math.abs(chart.scales.x.min - 1.5) < 0.01)")
    page.keyboard.press("0")
    wait_for(page, "charts.every((chart) => chart.scales.x.min === 0 && chart.scales.x.max === 3)")
    page.keyboard.press("Home")
    assert page.evaluate("cursor.time") == 0


def test_every_table_head_says_what_it_heads(pages, visit):
    for name in ("alone", "both"):
        page, _, _ = visit(pages / f"{name}.html")
        heads = "main th:not([scope]):not(.u-legend th)"
        assert page.locator(heads).count() == 0
