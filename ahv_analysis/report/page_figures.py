# Copyright 2026 ahv developers, Apache-2.0
"""Which figures of the report a bag or a campaign is for, and the flights that they show."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from ahv_analysis.bag.reader import flight_of, read
from ahv_analysis.bag.record import FlightRecord, record_of
from ahv_analysis.campaign.batch import fly_trajectory
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.flight.case import Case, make_case
from ahv_analysis.flight.library import fly
from ahv_analysis.report.figures import (
    ACTUAL,
    ADAPTIVE,
    CAMPAIGN_3,
    CAMPAIGN_4,
    CAMPAIGN_5,
    CAMPAIGN_OWN_LAW,
    CHAPTER_3,
    CHAPTER_4,
    CHAPTER_5,
    FLOWN,
    HARDWARE,
    MEASURED,
    NOMINAL,
    OWN_LAW,
    Plate,
    draw,
    draw_campaign,
)
from ahv_control.own_law import OwnLaw
from ahv_plant.dispersion import Truth

DRAWN_EVERY = 10  # steps between the points of a campaign's lines


def bag_figures(bag: Path) -> tuple[Sequence[Plate], Callable[[Plate], Figure]]:
    """Which figures of the report a bag is for, and how to draw one."""
    contents = read(bag)
    case = None
    if contents.notes is not None:
        case = make_case(contents.notes.case, contents.notes.parameters, to_fly=False)
    return flight_figures(flight_of(contents), case)


def flight_figures(
    flown: FlightRecord, case: Case | None
) -> tuple[Sequence[Plate], Callable[[Plate], Figure]]:
    """Which figures of the report a flight is for, and how to draw one.

    For an adaptive flight the nominal law is flown from the same start, on the nominal vehicle and
    on the actual one, with the parameters of its case. Figures of hardware show the flight alone.
    """
    own = () if flown.positions is None else HARDWARE
    if case is not None and isinstance(case.control, OwnLaw):
        return OWN_LAW + own, partial(draw, flights={FLOWN: flown})
    if case is None or flown.learner is None:
        return CHAPTER_3 + own, partial(_draw_one, own, flown, {FLOWN: flown})
    nominal = case._replace(control=case.control._replace(learner=None))
    ideal = nominal._replace(plant=case.plant._replace(truth=Truth(case.plant.truth.geometric)))
    plates = CHAPTER_4 if case.control.inner.tracking.exponent == 1.0 else CHAPTER_5
    flights = {NOMINAL: _fly(ideal), ACTUAL: _fly(nominal), ADAPTIVE: flown}
    return plates + own, partial(_draw_one, own, flown, flights)


def _draw_one(
    own: Sequence[Plate], flown: FlightRecord, flights: Mapping[str, FlightRecord], plate: Plate
) -> Figure:
    """Figures of the flight's `own` hardware show what it measured, the others all flights."""
    return draw(plate, {MEASURED: flown} if plate in own else flights)


def _fly(case: Case) -> FlightRecord:
    return record_of(fly(case), case.plant.truth.geometric)


def campaign_figures(
    campaign: Campaign, causes: Mapping[int, int]
) -> tuple[Sequence[Plate], Callable[[Plate], Figure]]:
    """Which figures a campaign is for, and how to draw one with some of its runs.

    `causes` has the cause of failure of each run to draw, zero for success. The runs are flown
    again, so that a campaign of any size keeps no trajectory.
    """
    flights = [fly_trajectory(campaign.case_of(run), DRAWN_EVERY) for run in causes]
    failed = [cause != 0 for cause in causes.values()]
    control = campaign.case.control
    if isinstance(control, OwnLaw):
        plates = CAMPAIGN_OWN_LAW
    elif control.learner is None:
        plates = CAMPAIGN_3
    else:
        plates = CAMPAIGN_4 if control.inner.tracking.exponent == 1.0 else CAMPAIGN_5
    return plates, partial(draw_campaign, flights=flights, failed=failed)
