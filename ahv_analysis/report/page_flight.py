# Copyright 2026 ahv developers, Apache-2.0
"""The flights of a report: what a bag tells of one, and the verdict on it."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ahv_analysis.bag.info import refused_facts
from ahv_analysis.bag.reader import flight_of, read
from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import Case, make_case
from ahv_analysis.flight.outcome import Cause
from ahv_analysis.quantities import Settings
from ahv_analysis.report.metrics import measure, why_ended_early
from ahv_analysis.report.summary import failure
from ahv_plant.model.constants import DEGREES

TUMBLING_RATE = 60.0 / DEGREES  # [rad/s] body rate at which a vehicle is lost
COMPARISON = "comparison"  # the name of no flight: that of the page that overlays them


class Verdict(NamedTuple):
    """How a flight went, and why that is said."""

    word: str  # success, failure or open
    reason: str


class Flight(NamedTuple):
    """One flight of a report."""

    name: str
    bag: Path
    record: FlightRecord
    notes: dict[str, Any]  # empty in a bag without notes
    case: Case | None  # likewise None
    metrics: dict[str, Any]
    ended_early: str  # why, empty if it did not
    cause: Cause | None  # of its failure, as in a campaign; None without a case
    refused: list[dict[str, Any]]  # messages of the bag that no receiver obeyed

    @property
    def settings(self) -> Settings:
        """Settings of the flight control, None where the bag does not tell them."""
        return None if self.case is None else self.case.control

    @property
    def verdict(self) -> Verdict:
        """Success is Table 5.1's: flown to its end with |alpha| <= 5 deg throughout."""
        unstart = self.metrics["margins"]["alpha"]["first_beyond_s"]
        lost = self.cause == Cause.SURFACES_LOST_THE_VEHICLE
        reasons = [
            "" if unstart is None else f"inlet unstart: |α| beyond 5° from {unstart:g} s",
            "the surfaces lost the vehicle" if lost else "",
            "the law gave no answer" if self.cause == Cause.LAW_FAILED else "",
            self.ended_early,
        ]
        if any(reasons):
            return Verdict("failure", "; ".join(filter(None, reasons)))
        if self.case is None:
            return Verdict(
                "open",
                "|α| ≤ 5° throughout, but the bag does not tell how long it should be flown",
            )
        return Verdict("success", "flown to its end with |α| ≤ 5° throughout")

    @property
    def lost_at(self) -> float | None:
        """Time [s] from which the vehicle tumbles; no scale of a plot should follow it there."""
        tumbling = np.any(np.abs(self.record.states[:, 3:6]) > TUMBLING_RATE, axis=1)
        return float(self.record.time[np.argmax(tumbling)]) if np.any(tumbling) else None


def read_flights(bags: Sequence[Path]) -> list[Flight]:
    """Read the flights of bags; BagError names a bag that cannot be read or is given twice."""
    for bag, count in Counter(bag.resolve() for bag in bags).items():
        if count > 1:
            raise BagError(f"{bag} is given {count} times")
    return [_read(bag, name) for bag, name in zip(bags, page_names(bags), strict=True)]


def _read(bag: Path, name: str) -> Flight:
    contents = read(bag)
    record, notes = flight_of(contents), contents.notes
    if record.steps < 1:
        raise BagError(f"{bag} holds no two steps with all their messages: there was no flight")
    case = make_case(notes.case, notes.parameters, to_fly=False) if notes else None
    metrics = measure(record, case.control if case else None)
    ended_early = why_ended_early(record, case) if case else ""
    cause = failure(record, ended_early) if case else None
    content = notes.content if notes else {}
    refused = refused_facts(contents)
    return Flight(name, bag, record, content, case, metrics, ended_early, cause, refused)


def page_names(bags: Sequence[Path]) -> list[str]:
    """Names of the flights in bags: as much of the end of each path as tells them apart.

    `ahv fly` puts its bags into folders `bag`; such a flight has the name of the folder above.
    """
    paths = [bag.resolve() for bag in bags]
    parts = [path.parts[1:-1] if path.name == "bag" else path.parts[1:] for path in paths]
    for depth in range(1, max(map(len, parts)) + 1):
        names = ["-".join(part[-depth:]) for part in parts]
        if len({*names, COMPARISON, ""}) == len(names) + 2:
            return names
    raise BagError(f"the bags {', '.join(map(str, bags))} cannot be told apart by their names")
