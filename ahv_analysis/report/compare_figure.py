# Copyright 2026 ahv developers, Apache-2.0
"""Pictures of comparisons: two campaigns run by run, two flights line by line."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.campaign.columns import label
from ahv_analysis.campaign.compare import Comparison
from ahv_analysis.quantities import BY_NAME
from ahv_analysis.report.drawn import drawn, drawn_time
from ahv_analysis.report.flight_difference import FlightDifference, QuantityDifference
from ahv_plant.model.constants import DEGREES, UNSTART_ALPHA

# Kept by both, by one alone, by none; told apart by every eye (Okabe, Ito).
BOTH, ONLY_A, ONLY_B, NONE = "0.7", "#D55E00", "#0072B2", "black"
MOST_LINES = 6  # quantities of two flights that are drawn


def draw_comparison(found: Comparison, names: tuple[str, str], title: str) -> Figure:
    """Draw who saves whom, the largest angles of attack, and what differs of those kept."""
    figure = Figure(figsize=(11.0, 4.6), dpi=110, layout="constrained")
    verdicts, alphas, metrics = figure.subplots(1, 3, width_ratios=(2, 3, 3))
    _draw_verdicts(verdicts, found, names)
    _draw_alphas(alphas, found, names)
    _draw_metrics(metrics, found, names)
    figure.suptitle(title, fontsize=9)
    return figure


def _draw_verdicts(axes: Axes, found: Comparison, names: tuple[str, str]) -> None:
    neither = found.runs - found.kept_by_both - len(found.only_a) - len(found.only_b)
    bars = (
        ("kept by both", found.kept_by_both, BOTH),
        (f"only by A, {names[0]}", len(found.only_a), ONLY_A),
        (f"only by B, {names[1]}", len(found.only_b), ONLY_B),
        ("lost by both", neither, NONE),
    )
    for place, (words, count, colour) in enumerate(bars):
        axes.barh(-place, count, color=colour, height=0.35)
        axes.text(0, 0.32 - place, f"{words}: {count}", fontsize=8)
    axes.set(yticks=[], ylim=(-3.5, 0.7), xlabel="runs")
    axes.set_title(f"who saves whom (McNemar p = {found.p_value:.2g})", fontsize=9)


def _draw_alphas(axes: Axes, found: Comparison, names: tuple[str, str]) -> None:
    bound = UNSTART_ALPHA * DEGREES
    (a, b), (lost_a, lost_b) = found.largest_alphas, found.lost
    groups = (
        (~lost_a & ~lost_b, BOTH, "kept by both", "o"),
        (lost_a & lost_b, NONE, "lost by both", "x"),
        (~lost_a & lost_b, ONLY_A, "only by A", "^"),
        (lost_a & ~lost_b, ONLY_B, "only by B", "v"),
    )
    for where, colour, words, marker in groups:
        if where.any():
            style = {"ms": 4, "color": colour, "label": words, "rasterized": True}
            axes.plot(a[where], (b - a)[where], marker, **style)
    axes.axhline(0.0, color="0.4", lw=0.8)
    axes.axvline(bound, color="0.4", ls=":", lw=1.0)
    axes.set(xlabel=f"A, {names[0]}: max |alpha| [deg]", ylabel="B less A [deg]")
    axes.set_title("largest angle of attack; dotted: unstart", fontsize=9)
    axes.legend(fontsize=7, frameon=False)


def _draw_metrics(axes: Axes, found: Comparison, names: tuple[str, str]) -> None:
    """Draw mean differences in the unit of their interval's half width: beyond 1, they differ."""
    shown = [one for one in found.metrics if one.tells]
    for place, one in enumerate(shown):
        half = max((one.high - one.low) / 2.0, 1e-300)
        apart = one.low > 0.0 or one.high < 0.0
        size = float(np.clip(one.mean / half, -9.0, 9.0))
        colour = (ONLY_B if one.mean > 0.0 else ONLY_A) if apart else "0.5"
        axes.plot((size - 1.0, size + 1.0), (-place, -place), color=colour, lw=2.0)
        axes.plot(size, -place, "o", color=colour, ms=4)
        words = f"{label(one.name)}: {one.mean:+.3g} ({one.low:+.3g} to {one.high:+.3g})"
        axes.text(-10.0, 0.28 - place, words, fontsize=7)
    if not shown:
        words = "no value of any run that both keep differs" if found.kept_by_both else "none"
        axes.text(0.5, 0.5, words, ha="center", transform=axes.transAxes, fontsize=8)
    axes.axvline(0.0, color="0.4", lw=0.8)
    axes.set(yticks=[], xlim=(-10.5, 10.5), ylim=(-max(len(shown), 1) + 0.5, 0.8))
    axes.set_xlabel("mean difference / half its 95 % interval")
    axes.set_title("B less A, over runs that both keep", fontsize=9)


def draw_flights(
    found: FlightDifference,
    records: tuple[FlightRecord, FlightRecord],
    names: tuple[str, str],
    title: str,
) -> Figure:
    """Draw the quantities that differ most against their tolerance: both lines, and B less A."""
    shown = most_different(found.quantities)
    figure = Figure(figsize=(9.6, 1.0 + 1.8 * max(len(shown), 1)), dpi=110, layout="constrained")
    figure.suptitle(title, fontsize=9)
    if not shown:
        words = "no value of any quantity differs, to the last bit"
        figure.text(0.5, 0.4, words, ha="center")
        return figure
    panels = figure.subplots(len(shown), 2, sharex=True, squeeze=False, width_ratios=(3, 2))
    stamps = records[0].stamps, records[1].stamps
    _, here, there = np.intersect1d(*stamps, return_indices=True)
    common = records[0].time[here]
    for (both, between), one in zip(panels, shown, strict=True):
        quantity = BY_NAME[one.name]
        lines = [quantity.drawn(record) for record in records]
        assert lines[0] is not None and lines[1] is not None
        for line, record, name, style in zip(
            lines, records, names, (("C0", "-"), ("C3", "--")), strict=True
        ):
            time = drawn_time(record.time)
            values = drawn(record.time, line)
            both.plot(time, values, color=style[0], ls=style[1], lw=1.2, label=name)
        less = lines[1][there] - lines[0][here]
        between.plot(drawn_time(common), drawn(common, less), color="black", lw=1.0)
        if one.tolerance > 0.0:
            for bound in (-one.tolerance, one.tolerance):
                between.axhline(bound, color="C3", ls=":", lw=1.0)
        both.set_ylabel(quantity.label())
        for axes in (both, between):
            axes.grid(color="0.9")
    panels[0, 0].legend(fontsize=8, frameon=False)
    panels[0, 1].set_title("B less A; dotted: tolerance", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    return figure


def most_different(quantities: Sequence[QuantityDifference]) -> list[QuantityDifference]:
    """Those that differ, those beyond their tolerance first, and then the largest against it."""

    def size(one: QuantityDifference) -> tuple[bool, float]:
        largest = np.inf if one.largest is None else abs(one.largest)
        return not one.beyond, -largest / (one.tolerance or 1.0)

    return sorted((one for one in quantities if one.differ), key=size)[:MOST_LINES]
