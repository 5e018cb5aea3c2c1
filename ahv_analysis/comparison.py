"""The three curves of the report's figures 4.1-4.5 and 5.1-5.5, from one recorded flight."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from ahv_analysis.bag_reader import read_bag, read_notes
from ahv_analysis.case import Case, make_case
from ahv_analysis.figures import (
    ACTUAL,
    ADAPTIVE,
    CHAPTER_3,
    CHAPTER_4,
    CHAPTER_5,
    FLOWN,
    NOMINAL,
    Plate,
)
from ahv_analysis.flight import fly
from ahv_analysis.record import FlightRecord, record
from ahv_plant.dispersion import Truth


def report_figures(bag: Path) -> tuple[Sequence[Plate], Mapping[str, FlightRecord]]:
    """Which figures of the report a bag is for, and the flights that they show.

    For an adaptive flight the nominal law is flown from the same start, on the nominal vehicle and
    on the actual one, with the parameters that the bag holds.
    """
    flown = read_bag(bag)
    notes = read_notes(bag)
    if notes is None or flown.learner is None:
        return CHAPTER_3, {FLOWN: flown}
    case = make_case(notes["case"], notes["parameters"])
    nominal = case._replace(control=case.control._replace(learner=None))
    ideal = nominal._replace(plant=case.plant._replace(truth=Truth(case.plant.truth.geometric)))
    plates = CHAPTER_4 if case.control.inner.tracking.exponent == 1.0 else CHAPTER_5
    return plates, {NOMINAL: _fly(ideal), ACTUAL: _fly(nominal), ADAPTIVE: flown}


def _fly(case: Case) -> FlightRecord:
    return record(fly(case), case.plant.truth.geometric)
