# Copyright 2026 ahv developers, Apache-2.0
"""Figures show what can be read off them."""

from io import StringIO

import numpy as np
import pytest
from matplotlib import pyplot

from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.report.figures import CHAPTER_3, FLOWN, TUMBLING, draw, write_figure

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


def test_the_same_flight_gives_the_same_file():
    flight = record_of(fly(load_case("nominal_di", {"duration": 0.1})), False)
    files = []
    for _ in range(2):
        figure, file = draw(CHAPTER_3[0], {FLOWN: flight}), StringIO()
        write_figure(figure, file, "svg")
        pyplot.close(figure)
        files.append(file.getvalue())
    assert files[0] == files[1]
