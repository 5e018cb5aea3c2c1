# Copyright 2026 ahv developers, Apache-2.0
"""A quantity is written down once, and what is written down is everywhere."""

import numpy as np
import pytest

from ahv_analysis import quantities
from ahv_analysis.bag.dataset import flight_dataset
from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.quantities import BY_NAME, QUANTITIES, SCALES, Quantity
from ahv_analysis.report.figures import CHAPTER_3
from ahv_analysis.report.metrics import measure
from ahv_analysis.report.page import GROUPS
from ahv_plant.model.constants import DEGREES

# One line: what CONTRIBUTING.md tells a newcomer to add.
LOAD = Quantity(
    "load",
    "load factor",
    "n_z",
    "1",
    "",
    None,
    lambda record: record.air.dynamic_pressure / 9.8,
    plate="air",
    group="Air and mass",
    reference=lambda record, settings: np.ones(len(record.stamps)),
    band=0.1,
)


@pytest.fixture(scope="module")
def flight():
    case = load_case("neuro_adaptive_di", {"duration": 0.1})
    return record_of(fly(case), False), case


def test_names_are_told_apart_and_units_are_known():
    assert len(BY_NAME) == len(QUANTITIES)
    for one in QUANTITIES:
        assert one.unit and one.words, one.name
        assert not one.shown or one.shown in SCALES, one.name
        assert not one.group or one.group in GROUPS, one.name


def test_one_line_brings_a_quantity_to_export_figures_page_and_metrics(flight, monkeypatch):
    flown, case = flight
    for name, wanted in (("QUANTITIES", (*QUANTITIES, LOAD)), ("TRACKED", (LOAD,))):
        monkeypatch.setattr(quantities, name, wanted)
    monkeypatch.setattr("ahv_analysis.bag.dataset.QUANTITIES", quantities.QUANTITIES)
    monkeypatch.setattr("ahv_analysis.report.metrics.TRACKED", quantities.TRACKED)
    assert flight_dataset(flown, None)["load"].attrs["long_name"] == "load factor"
    assert LOAD in quantities.of_plate("air")
    assert LOAD in quantities.of_group("Air and mass")
    assert set(measure(flown, case.control)["tracking"]) == {"load factor"}


def test_people_are_shown_degrees_and_files_keep_radians(flight):
    flown, _ = flight
    alpha = BY_NAME["alpha"]
    assert np.array_equal(alpha.drawn(flown), flown.air.alpha * DEGREES)
    assert np.array_equal(flight_dataset(flown, None)["alpha"].values, flown.air.alpha)
    assert alpha.label() == "$α$ [deg]"
    assert BY_NAME["h"].label("km") == "$h$ [km]"


def test_the_report_has_its_panels_in_its_order():
    names = [[panel.quantity.name for panel in plate.panels] for plate in CHAPTER_3]
    assert names == [
        ["mach", "alpha", "beta"],
        ["u", "v", "w"],
        ["h", "mass", "gamma"],
        ["phi", "theta", "psi"],
        ["P", "Q", "R"],
        ["right_elevon", "left_elevon", "rudder", "throttle"],
    ]
