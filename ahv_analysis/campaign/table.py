# Copyright 2026 ahv developers, Apache-2.0
"""Table 5.1 of the report, beside the same campaign flown here."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

from ahv_analysis.campaign.campaign import Campaign, fly_campaign
from ahv_analysis.campaign.summary import exact_interval, summarize_campaign
from ahv_analysis.flight.case import Case, load_case
from ahv_msgs_py.parameters import ParameterError


class Reported(NamedTuple):
    """A row of Table 5.1."""

    level: float
    trials: int
    successes: dict[str, int]  # by controller


REPORT = (
    Reported(0.1, 3697, {"neuro_adaptive_sc_gdi": 3697, "neuro_adaptive_di": 3697}),
    Reported(0.2, 3660, {"neuro_adaptive_sc_gdi": 3660, "neuro_adaptive_di": 3660}),
    Reported(0.3, 3602, {"neuro_adaptive_sc_gdi": 3594, "neuro_adaptive_di": 3580}),
    Reported(0.4, 3873, {"neuro_adaptive_sc_gdi": 3455, "neuro_adaptive_di": 3371}),
)
CONTROLLERS = ("neuro_adaptive_sc_gdi", "neuro_adaptive_di")


class Row(NamedTuple):
    """A cell of the table: the report's count and ours."""

    trials: int  # of the report
    reported: int | None  # successes of the report; None of a law that it does not have
    reported_interval: tuple[float, float] | None
    flown: dict[str, Any]  # summary of the campaign

    @property
    def verdict(self) -> str:
        """How our rate compares with the report's: apart if neither lies in the other's interval.

        A few trials, whose interval is wide, are never apart from the report. Of a law of one's
        own the report says nothing, and it is "-".
        """
        if self.reported is None or self.reported_interval is None:
            return "-"
        (low, high), (least, most) = self.reported_interval, self.flown["interval"]
        rate, reported = self.flown["success_rate"], self.reported / self.trials
        return (
            "below"
            if rate < low and most < reported
            else "above"
            if rate > high and least > reported
            else "within"
        )


def fly_table(
    folder: Path,
    executor: Executor,
    seed: int,
    runs: int | None,
    protected: bool,
    progress: Callable[[int], None],
    interrupted: Callable[[], bool] = lambda: False,
    *,
    hardware: str | None = None,
    profile: str | None = None,
    laws: Sequence[str] = (),
) -> list[Row]:
    """Fly every cell of the table; `runs` replaces the report's numbers of trials.

    The `laws` of one's own fly the same vehicles from the same start, in rows under the
    report's. Once `interrupted()` it ends, and the folder keeps what was flown.
    """
    rows = []
    before = 0
    for case in table_cases(protected, hardware, profile, laws):
        for reported in REPORT:
            campaign = Campaign(case, reported.level, runs or reported.trials, seed)
            fly_campaign(
                campaign,
                folder / case.name,
                executor,
                lambda done, before=before: progress(before + done),
                interrupted,
            )
            if interrupted():
                return rows
            before += campaign.runs
            successes = reported.successes.get(case.name.removesuffix("_protected"))
            rows.append(
                Row(
                    reported.trials,
                    successes,
                    None if successes is None else exact_interval(successes, reported.trials),
                    summarize_campaign(campaign, folder / case.name),
                )
            )
    return rows


def table_cases(
    protected: bool, hardware: str | None, profile: str | None, laws: Sequence[str] = ()
) -> list[Case]:
    """Cases of the table's rows: the report's, then laws of one's own from where these start."""
    names = [name + ("_protected" if protected else "") for name in CONTROLLERS]
    own = [load_case(names[0], hardware=hardware, profile=profile, law=law) for law in laws]
    named = [case.law.name for case in own if case.law is not None]
    for name in named:
        if named.count(name) > 1:
            raise ParameterError(f"two laws are called {name!r}: a row has to have its own name")
    return [
        *(load_case(name, hardware=hardware, profile=profile) for name in names),
        *(case._replace(name=name) for case, name in zip(own, named, strict=True)),
    ]


def total_runs(runs: int | None, laws: int = 0) -> int:
    """Number of flights of the table, with so many laws of one's own."""
    return (len(CONTROLLERS) + laws) * sum(runs or reported.trials for reported in REPORT)


def percent(interval: Sequence[float]) -> str:
    """Return an interval in words."""
    return f"[{100 * interval[0]:.2f}, {100 * interval[1]:.2f}]"


def _of_report(row: Row) -> str:
    if row.reported is None or row.reported_interval is None:
        return "- | -"
    return f"{100 * row.reported / row.trials:.2f} | {percent(row.reported_interval)}"


def markdown(rows: Sequence[Row]) -> str:
    """Return the table as Markdown."""
    lines = [
        "| controller | level | trials | report % | report's 95 % | here % | here 95 % "
        "| against the report | trim within 5 deg % | could be saved % |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        flown = row.flown
        lines.append(
            f"| {flown['controller']} | {100 * flown['level']:.0f} % | {flown['runs']} "
            f"| {_of_report(row)} "
            f"| {100 * flown['success_rate']:.2f} | {percent(flown['interval'])} | {row.verdict} "
            f"| {100 * flown['trim_within_5_deg'] / flown['runs']:.2f} "
            f"| {100 - 100 * flown['beyond_saving'] / flown['runs']:.2f} |"
        )
    return "\n".join(lines) + "\n"
