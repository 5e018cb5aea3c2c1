# Copyright 2026 ahv developers, Apache-2.0
"""Figures show what can be read off them."""

from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from matplotlib import pyplot

from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.report.figures import (
    ACTUAL,
    ADAPTIVE,
    CHAPTER_3,
    CHAPTER_5,
    FLOWN,
    HARDWARE,
    MEASURED,
    NOMINAL,
    TUMBLING,
    draw,
    write_figure,
)

pytestmark = pytest.mark.unit


def test_a_flight_that_is_lost_is_drawn_until_it_tumbles():
    """What its numbers come to afterwards, 1e19 here, would hide all that went before."""
    flight = record_of(fly(load_case("nominal_di_dispersed")), False)
    assert np.max(np.abs(flight.states)) > 1e15
    figure = draw(CHAPTER_3[0], {FLOWN: flight})
    for axis in figure.axes:
        line, cross = axis.lines[:2]
        last = line.get_xdata()[-1]
        assert cross.get_marker() == "x" and cross.get_xdata() == [last]
        assert 0.0 < last < flight.time[-1]
        assert np.all(np.abs(flight.air.alpha[flight.time < last]) <= TUMBLING)
        assert max(np.abs(axis.get_ylim())) < 100.0
    pyplot.close(figure)


@pytest.mark.parametrize("chapter", ["3", "5", "H"])
def test_a_legend_explains_every_line_and_covers_nothing(chapter):
    """It lies within the figure, above all panels and below the title; a command may be lower."""
    plain = record_of(fly(load_case("nominal_di", {"duration": 0.1})), False)
    # what hardware adds is what is measured, here without an error
    flight = replace(plain, measured=plain.states, positions=plain.surfaces)
    plates, flights = {
        "3": (CHAPTER_3[3:5], {FLOWN: plain}),
        "5": (CHAPTER_5[1:3], {NOMINAL: plain, ACTUAL: plain, ADAPTIVE: plain}),
        "H": (HARDWARE, {MEASURED: flight}),
    }[chapter]
    for plate in plates:
        figure = draw(plate, flights)
        figure.canvas.draw()
        title = figure._suptitle.get_window_extent()
        assert figure.bbox.y0 < title.y0 and title.y1 <= figure.bbox.y1
        drawn = {
            line.get_label()
            for axis in figure.axes
            for line in axis.lines
            if not line.get_label().startswith("_")
        }
        legends = figure.legends
        assert len(legends) == (len(drawn) > 1), plate.number
        for legend in legends:
            assert {text.get_text() for text in legend.get_texts()} == drawn, plate.number
            box = legend.get_window_extent()
            assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1, plate.number
            assert box.y1 <= title.y0, plate.number
            panels = [axis.get_tightbbox() for axis in figure.axes]
            assert not any(box.overlaps(panel) for panel in panels), plate.number
            assert all(panel.y1 <= box.y0 for panel in panels), plate.number
        pyplot.close(figure)


def test_the_same_flight_gives_the_same_file():
    flight = record_of(fly(load_case("nominal_di", {"duration": 0.1})), False)
    files = []
    for _ in range(2):
        figure, file = draw(CHAPTER_3[0], {FLOWN: flight}), StringIO()
        write_figure(figure, file, "svg")
        pyplot.close(figure)
        files.append(file.getvalue())
    assert files[0] == files[1]
