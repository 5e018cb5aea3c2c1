# Copyright 2026 ahv developers, Apache-2.0
"""Pictures of searches: the worst vehicle, where losses begin, and how rare they are."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.rare import Rare
from ahv_analysis.campaign.vehicles import LOSS
from ahv_analysis.campaign.worst import Radius, Start
from ahv_analysis.report.figures import TUMBLING
from ahv_plant.dispersion import Dispersion
from ahv_plant.model.constants import DEGREES

WORST, NOMINAL, BOX = "#D55E00", "#0072B2", "0.88"
SEVERITY = "severity: max |alpha| [deg], beyond 5 lost"


def draw_worst(
    dispersion: Array,
    level: float,
    flights: dict[str, FlightRecord],
    starts: Sequence[Start],
    title: str,
) -> Figure:
    """Draw the vehicle in its box, its flight beside the nominal vehicle's, and the search."""
    figure = Figure(figsize=(11.0, 4.0), dpi=110, layout="constrained")
    box, flight, search = figure.subplots(1, 3, width_ratios=(2, 3, 3))
    _draw_box(box, dispersion, level)
    for (words, record), colour in zip(flights.items(), (NOMINAL, WORST), strict=True):
        alpha = record.air.alpha * DEGREES
        beyond = np.abs(alpha) > TUMBLING * DEGREES
        end = int(np.argmax(beyond)) + 1 if beyond.any() else len(alpha)
        flight.plot(record.time[:end], alpha[:end], color=colour, lw=1.3, label=words)
        if end < len(alpha):
            flight.plot(record.time[end - 1], alpha[end - 1], "x", color=colour)
    for bound in (-LOSS, LOSS):
        flight.axhline(bound, color="0.4", ls=":", lw=1.0)
    flight.set(xlabel="time [s]", ylabel="alpha [deg]", ylim=(-1.6 * LOSS, 1.6 * LOSS))
    flight.set_title("its flight; dotted: inlet unstart", fontsize=9)
    flight.legend(fontsize=8, frameon=False)
    for start in starts:
        search.plot(np.arange(1, len(start.best) + 1), start.best, "o-", ms=3, label=start.words)
    search.axhline(LOSS, color="0.4", ls=":", lw=1.0)
    search.set(xlabel="generation", ylabel=SEVERITY)
    search.set_title("the search", fontsize=9)
    search.legend(fontsize=8, frameon=False)
    figure.suptitle(title, fontsize=9)
    return figure


def _draw_box(axes: Axes, dispersion: Array, level: float) -> None:
    for place, (name, value) in enumerate(zip(Dispersion._fields, dispersion, strict=True)):
        axes.barh(-place, 2.0 * level, left=1.0 - level, color=BOX, height=0.7)
        axes.barh(-place, value - 1.0, left=1.0, color=WORST, height=0.4)
        axes.text(1.0 + 1.08 * level, -place, f"{value:.3f}", va="center", fontsize=8)
        axes.text(1.0 - 1.08 * level, -place, name, va="center", ha="right", fontsize=8)
    axes.axvline(1.0, color="black", lw=0.8)
    margin = max(1.6 * level, 1e-3)
    axes.set(yticks=[], xlim=(1.0 - margin, 1.0 + margin), xlabel="multiplier [-]")
    axes.set_title("the vehicle in its box", fontsize=9)


def draw_radius(found: Radius, name: str, title: str) -> Figure:
    """Draw what each search found, and where losses begin."""
    figure = Figure(figsize=(6.4, 4.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    for lost, colour, marker, words in (
        (False, NOMINAL, "o", "no loss found"),
        (True, WORST, "x", "a lost vehicle"),
    ):
        chosen = [probe for probe in found.probes if probe.lost == lost]
        if chosen:
            severities = [probe.severity for probe in chosen]
            values = [probe.value for probe in chosen]
            axes.plot(values, severities, marker, color=colour, label=words)
    if found.kept is not None and found.lost is not None:
        axes.axvspan(found.kept, found.lost, color="0.8", label="losses begin here")
    axes.axhline(LOSS, color="0.4", ls=":", lw=1.0)
    axes.set(xlabel=name, ylabel=SEVERITY)
    axes.legend(fontsize=8, frameon=False)
    axes.grid(color="0.9")
    figure.suptitle(title, fontsize=9)
    return figure


def draw_rare(found: Rare, title: str) -> Figure:
    """Draw the probability of passing each severity, a line a repetition."""
    figure = Figure(figsize=(6.4, 4.2), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    for number, one in enumerate(found.repetitions):
        reached = np.cumprod(one.shares)
        there = reached > 0.0
        axes.semilogy(
            np.array(one.thresholds)[there],
            reached[there],
            "o-",
            ms=3,
            lw=0.9,
            color="0.55",
            label="a repetition" if number == 0 else None,
        )
    if found.found:
        bars = [[found.probability - found.low], [found.high - found.probability]]
        axes.errorbar(LOSS, found.probability, bars, fmt="D", color=WORST, label="loss, 95 %")
    axes.axvline(LOSS, color="0.4", ls=":", lw=1.0)
    axes.set(xlabel=SEVERITY, ylabel="probability of more [-]")
    axes.legend(fontsize=8, frameon=False)
    axes.grid(color="0.9")
    figure.suptitle(title, fontsize=9)
    return figure
