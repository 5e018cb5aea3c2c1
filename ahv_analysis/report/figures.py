# Copyright 2026 ahv developers, Apache-2.0
"""The report's figures, drawn from recorded flights."""

from collections.abc import Callable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Array
from ahv_analysis.interrupt import signals_wait
from ahv_analysis.quantities import Quantity, of_plate
from ahv_analysis.report.drawn import drawn, drawn_time
from ahv_plant.model.constants import DEGREES


class Panel(NamedTuple):
    """One axes of a figure."""

    quantity: Quantity
    unit: str  # of SCALES; empty: the one that people are shown elsewhere

    def values(self, record: FlightRecord) -> Array:
        """What is drawn, (N+1,), in the unit of the panel."""
        values = self.quantity.drawn(record, self.unit)
        assert values is not None, self.quantity.name
        return values

    def command(self, record: FlightRecord) -> Array | None:
        """What was commanded, (N+1,), in the unit of the panel; None if nothing was."""
        return self.quantity.drawn_reference(record, None, self.unit)

    @property
    def bound(self) -> float | None:
        """Bound at plus and minus that is always in view."""
        bounds = self.quantity.drawn_bounds(None)
        return bounds[1] if bounds and self.quantity.name in IN_VIEW else None


class Plate(NamedTuple):
    """One figure of the report."""

    number: str
    title: str
    panels: Sequence[Panel]


UNITS = {"h": "km", "mass": "t"}  # of the report's figures
IN_VIEW = {"alpha"}  # quantities whose bounds a figure of several flights shows


def _subject(title: str, plate: str) -> tuple[str, Sequence[Panel]]:
    return title, [Panel(one, UNITS.get(one.name, "")) for one in of_plate(plate)]


AIR = _subject("Mach number, angle of attack and sideslip angle", "air")
VELOCITY = _subject("Velocity components", "velocity")
PATH = _subject("Altitude, mass and flight path angle", "path")
ATTITUDE = _subject("Roll, pitch and yaw angle", "attitude")
RATES = _subject("Roll, pitch and yaw rate", "rates")
CONTROLS = _subject("Controls", "controls")
# Figures of hardware that is not ideal, which the report has none of.
HARDWARE = (
    Plate("H.1", *_subject("Surfaces as measured", "surfaces")),
    Plate("H.2", *_subject("Rates and attitude as measured", "measured")),
)
# Figures of a chapter, from its first number on; of single flights, then of campaigns.
CHAPTER_3 = tuple(
    Plate(f"3.{number}", *subject)
    for number, subject in enumerate((AIR, VELOCITY, PATH, ATTITUDE, RATES, CONTROLS), 2)
)
CHAPTER_4, CHAPTER_5 = (
    tuple(
        Plate(f"{chapter}.{number}", *subject)
        for number, subject in enumerate((AIR, PATH, ATTITUDE, RATES, CONTROLS), 1)
    )
    for chapter in (4, 5)
)

# Figures of a law of one's own: those of chapter 3 of the flight, and of the campaign.
OWN_LAW, CAMPAIGN_OWN_LAW = (
    tuple(
        Plate(f"{prefix}.{number}", *subject)
        for number, subject in enumerate((AIR, VELOCITY, PATH, ATTITUDE, RATES, CONTROLS), 1)
    )
    for prefix in ("L", "LC")
)

FLOWN, MEASURED, NOMINAL, ACTUAL, ADAPTIVE = (
    "flight",
    "measured",
    "nominal law, nominal vehicle",
    "nominal law, actual vehicle",
    "adaptive law, actual vehicle",
)
COLOURS = {FLOWN: "C0", MEASURED: "C0", NOMINAL: "0.55", ACTUAL: "C3", ADAPTIVE: "C0"}
COMMAND_STYLE = {"color": "C0", "alpha": 0.6, "linestyle": "--", "linewidth": 1.0}
BESIDE_MEASURED: Mapping[str, dict[str, Any]] = {
    "true": {"color": "k", "linewidth": 1.0},  # seen before the noise
    "command": {"color": "0.7", "linewidth": 1.0, "zorder": 1},  # noisier, and behind
}

CAMPAIGN_3, CAMPAIGN_4, CAMPAIGN_5 = (
    tuple(Plate(f"{chapter}.{number}", *subject) for number, subject in enumerate(subjects, first))
    for chapter, first, subjects in (
        (3, 8, (AIR, VELOCITY, PATH, ATTITUDE, RATES, CONTROLS)),
        (4, 6, (AIR, PATH, ATTITUDE, RATES, CONTROLS)),
        (5, 6, (AIR, PATH, ATTITUDE, RATES, CONTROLS)),
    )
)

TUMBLING = 20.0 / DEGREES  # [rad] angle of attack at which a vehicle is lost
RESOLUTION = 150  # [1/inch] of PNG files
STYLE = {
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "0.9",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.4,
}


def draw(plate: Plate, flights: Mapping[str, FlightRecord]) -> Figure:
    """One figure with a line per flight; the last one is the subject, and its commands are drawn.

    A flight is drawn until the vehicle is lost, with a cross there; of flights that were lost or
    ended early only the subject sets the scale.
    """
    subject = list(flights)[-1]
    longest = max(record.steps for record in flights.values())
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(plate.panels), 1, sharex=True, figsize=(6.4, 1.9 * len(plate.panels) + 0.8)
        )
        for panel, axis in zip(plate.panels, axes, strict=True):
            seen = []
            for label, record in flights.items():
                end = _flying(record)
                lost = end < len(record.stamps) or (record.steps < longest and label != subject)
                flown = record.time[:end]
                time, values = drawn_time(flown), drawn(flown, panel.values(record)[:end])
                axis.plot(time, values, color=COLOURS[label], label=label)
                if lost:
                    axis.plot(time[-1], values[-1], "x", color=COLOURS[label])
                if label == subject or not lost:
                    seen.append(values)
                commanded = panel.command(record) if label == subject else None
                if commanded is not None:
                    command = drawn(flown, commanded[:end])
                    words = panel.quantity.reference_words
                    style = BESIDE_MEASURED[words] if label == MEASURED else COMMAND_STYLE
                    axis.plot(time, command, label=words, **style)
                    seen.append(command)
            _scale(axis, np.concatenate(seen), panel.bound if len(flights) > 1 else None)
            if panel.bound is not None:
                low, high = axis.get_ylim()
                for bound in (-panel.bound, panel.bound):
                    if low < bound < high:
                        axis.axhline(bound, color="0.4", linestyle=":", linewidth=1.0)
            axis.set_ylabel(panel.quantity.label(panel.unit))
        axes[-1].set_xlabel("time [s]")
        axes[-1].margins(x=0)
        figure.align_ylabels(axes)
        _explain(figure, f"Figure {plate.number}: {plate.title}", axes)
    return figure


def _explain(figure: Figure, title: str, axes: Sequence[pyplot.Axes]) -> None:
    """Title and legend above the panels, one below the other, in as many rows as they need."""
    inch = 1.0 / float(figure.get_figheight())  # in shares of the height
    top = 1.0 - 0.05 * inch
    words = figure.suptitle(title, fontsize=10, x=0.02, y=top, ha="left", va="top")
    words.set_in_layout(False)  # its room is reckoned here
    top -= words.get_window_extent().height / figure.bbox.height + 0.03 * inch
    lines = {}  # of any panel: not every one has a command
    for axis in axes:
        for line, label in zip(*axis.get_legend_handles_labels(), strict=True):
            lines.setdefault(label, line)
    if len(lines) > 1:
        for columns in range(len(lines), 0, -1):
            legend = figure.legend(
                lines.values(),
                lines.keys(),
                loc="upper left",
                bbox_to_anchor=(0.01, top),
                borderaxespad=0.0,
                ncols=columns,
                frameon=False,
                fontsize=8,
            )
            extent = legend.get_window_extent()
            if extent.x1 <= figure.bbox.width or columns == 1:
                break
            legend.remove()
        top -= extent.height / figure.bbox.height
    figure.tight_layout(rect=(0, 0, 1, top))


def draw_campaign(plate: Plate, flights: Sequence[FlightRecord], failed: Sequence[bool]) -> Figure:
    """One figure with a thin line per run, the failed ones in red on top."""
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(plate.panels), 1, sharex=True, figsize=(6.4, 1.9 * len(plate.panels) + 0.6)
        )
        for panel, axis in zip(plate.panels, axes, strict=True):
            seen = []
            for record, lost in zip(flights, failed, strict=True):
                values = panel.values(record)
                shown = slice(_flying(record) if lost else None)
                colour, level = ("C3", 3) if lost else ("C0", 2)
                axis.plot(
                    record.time[shown],
                    values[shown],
                    color=colour,
                    lw=0.6,
                    alpha=0.7,
                    zorder=level,
                )
                if not lost:
                    seen.append(values)
            if seen:
                _scale(axis, np.concatenate(seen), panel.bound)
            if panel.bound is not None:
                for bound in (-panel.bound, panel.bound):
                    axis.axhline(bound, color="0.4", linestyle=":", linewidth=1.0)
            axis.set_ylabel(panel.quantity.label(panel.unit))
        axes[-1].set_xlabel("time [s]")
        axes[-1].margins(x=0)
        title = f"Figure {plate.number}: {plate.title}, {len(flights)} runs, {sum(failed)} failed"
        figure.suptitle(title, fontsize=10, x=0.02, ha="left")
        figure.align_ylabels(axes)
        figure.tight_layout()
    return figure


def _flying(record: FlightRecord) -> int:
    """Number of states until the vehicle tumbled."""
    tumbling = np.abs(record.air.alpha) > TUMBLING
    return int(np.argmax(tumbling)) + 1 if np.any(tumbling) else len(record.stamps)


def _scale(axis: pyplot.Axes, values: Array, bound: float | None) -> None:
    """Fit an axis to values, and to plus and minus a bound if there is one to be seen against.

    A quantity that is nothing but rounding is drawn as the zero that it is.
    """
    there = values[np.isfinite(values)]
    low, high = (float(np.min(there)), float(np.max(there))) if len(there) else (0.0, 0.0)
    if bound is not None:
        low, high = min(low, -1.3 * bound), max(high, 1.3 * bound)
    if high - low < 1e-6:
        low, high = low - 1.0, high + 1.0
    margin = 0.08 * (high - low)
    axis.set_ylim(low - margin, high + margin)


def figure_files(plate: Plate, folder: Path) -> list[Path]:
    """Files of a figure."""
    name = f"figure_{plate.number.replace('.', '_')}"
    return [folder / f"{name}.{kind}" for kind in ("png", "svg")]


def write_figure(figure: Figure, file: Path | StringIO, kind: str) -> None:
    """Write a figure as "png" or "svg", as it is: `savefig` would lay it out and draw it twice."""
    if kind == "png":
        figure.set_dpi(RESOLUTION)
        FigureCanvasAgg(figure).print_png(file)
    else:
        with pyplot.rc_context({"svg.hashsalt": "ahv"}):  # the same flight gives the same file
            FigureCanvasSVG(figure).print_svg(file, metadata={"Date": None})


def save_figures(
    plates: Sequence[Plate],
    draw_plate: Callable[[Plate], Figure],
    folder: Path,
    progress: Callable[[int], None] = lambda done: None,
) -> list[Path]:
    """Draw figures as PNG and SVG into `folder`; `progress(done)` after each."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for done, plate in enumerate(plates, 1):
        figure = draw_plate(plate)
        for path in figure_files(plate, folder):
            with signals_wait():
                write_figure(figure, path, path.suffix[1:])
            written.append(path)
        pyplot.close(figure)
        progress(done)
    return written
