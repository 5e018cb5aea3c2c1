# Copyright 2026 ahv developers, Apache-2.0
"""The report's figures, drawn from recorded flights."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.figure import Figure

from ahv_analysis.bag.record import Array, FlightRecord
from ahv_analysis.interrupt import signals_wait
from ahv_analysis.report.drawn import drawn, drawn_time
from ahv_plant.model.constants import DEGREES, UNSTART_ALPHA


class Panel(NamedTuple):
    """One axes of a figure."""

    label: str
    values: Callable[[FlightRecord], Array]
    command: Callable[[FlightRecord], Array] | None = None
    bound: float | None = None  # drawn at plus and minus, where it comes into view


class Plate(NamedTuple):
    """One figure of the report."""

    number: str
    title: str
    panels: Sequence[Panel]


def _state(label: str, name: str, scale: float = 1.0) -> Panel:
    return Panel(label, lambda record: record.column(name) * scale)


def _angle(label: str, name: str, index: int) -> Panel:
    return Panel(
        label,
        lambda record: record.column(name) * DEGREES,
        lambda record: record.attitude_commands[:, index] * DEGREES,
    )


def _rate(label: str, name: str, index: int) -> Panel:
    return Panel(
        label,
        lambda record: record.column(name) * DEGREES,
        lambda record: record.rate_commands[:, index] * DEGREES,
    )


def _surface(label: str, index: int) -> Panel:
    return Panel(label, lambda record: record.surfaces[:, index] * DEGREES)


AIR = (
    "Mach number, angle of attack and sideslip angle",
    (
        Panel("$M$ [-]", lambda record: record.air.mach),
        Panel(
            r"$\alpha$ [deg]",
            lambda record: record.air.alpha * DEGREES,
            bound=UNSTART_ALPHA * DEGREES,
        ),
        Panel(r"$\beta$ [deg]", lambda record: record.air.beta * DEGREES),
    ),
)
VELOCITY = (
    "Velocity components",
    (_state("$u$ [m/s]", "u"), _state("$v$ [m/s]", "v"), _state("$w$ [m/s]", "w")),
)
PATH = (
    "Altitude, mass and flight path angle",
    (
        _state("$h$ [km]", "h", 1e-3),
        _state("$M_v$ [t]", "mass", 1e-3),
        Panel(r"$\gamma$ [deg]", lambda record: record.climb_angle * DEGREES),
    ),
)
ATTITUDE = (
    "Roll, pitch and yaw angle",
    (
        _angle(r"$\phi$ [deg]", "phi", 0),
        _angle(r"$\theta$ [deg]", "theta", 1),
        _angle(r"$\psi$ [deg]", "psi", 2),
    ),
)
RATES = (
    "Roll, pitch and yaw rate",
    (
        _rate("$P$ [deg/s]", "P", 0),
        _rate("$Q$ [deg/s]", "Q", 1),
        _rate("$R$ [deg/s]", "R", 2),
    ),
)
CONTROLS = (
    "Controls",
    (
        _surface(r"$\delta_e$ [deg]", 0),
        _surface(r"$\delta_a$ [deg]", 1),
        _surface(r"$\delta_r$ [deg]", 2),
        Panel(r"$\sigma_T$ [-]", lambda record: record.throttle),
    ),
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

FLOWN, NOMINAL, ACTUAL, ADAPTIVE = (
    "flight",
    "nominal law, nominal vehicle",
    "nominal law, actual vehicle",
    "adaptive law, actual vehicle",
)
COLOURS = {FLOWN: "C0", NOMINAL: "0.55", ACTUAL: "C3", ADAPTIVE: "C0"}
COMMAND_STYLE = {"color": "C0", "alpha": 0.6, "linestyle": "--", "linewidth": 1.0}

CAMPAIGN_3, CAMPAIGN_4, CAMPAIGN_5 = (
    tuple(Plate(f"{chapter}.{number}", *subject) for number, subject in enumerate(subjects, first))
    for chapter, first, subjects in (
        (3, 8, (AIR, VELOCITY, PATH, ATTITUDE, RATES, CONTROLS)),
        (4, 6, (AIR, PATH, ATTITUDE, RATES, CONTROLS)),
        (5, 6, (AIR, PATH, ATTITUDE, RATES, CONTROLS)),
    )
)

TUMBLING = 20.0 / DEGREES  # [rad] angle of attack at which a vehicle is lost
STYLE = {
    "font.size": 9,
    "axes.grid": True,
    "grid.color": "0.9",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.4,
    "svg.hashsalt": "ahv",  # the same flight gives the same file
}


def draw(plate: Plate, flights: Mapping[str, FlightRecord]) -> Figure:
    """One figure with a line per flight; the last one is the subject, and its commands are dashed.

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
                if panel.command is not None and label == subject:
                    command = drawn(flown, panel.command(record)[:end])
                    axis.plot(time, command, label="command", **COMMAND_STYLE)
                    seen.append(command)
            _scale(axis, np.concatenate(seen), panel.bound if len(flights) > 1 else None)
            if panel.bound is not None:
                low, high = axis.get_ylim()
                for bound in (-panel.bound, panel.bound):
                    if low < bound < high:
                        axis.axhline(bound, color="0.4", linestyle=":", linewidth=1.0)
            axis.set_ylabel(panel.label)
        axes[-1].set_xlabel("time [s]")
        axes[-1].margins(x=0)
        figure.suptitle(f"Figure {plate.number}: {plate.title}", fontsize=10, x=0.02, ha="left")
        figure.align_ylabels(axes)
        figure.tight_layout(rect=(0, 0, 1, 0.97 if len(flights) > 1 else 1))
        if len(flights) > 1 or any(panel.command for panel in plate.panels):
            figure.legend(
                *axes[0].get_legend_handles_labels(),
                loc="upper left",
                bbox_to_anchor=(0.01, 0.955 + 0.003 * len(plate.panels)),
                ncols=4,
                frameon=False,
                fontsize=8,
            )
    return figure


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
            axis.set_ylabel(panel.label)
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
            metadata = {"Date": None} if path.suffix == ".svg" else None
            with signals_wait():
                figure.savefig(path, dpi=150, metadata=metadata)
            written.append(path)
        pyplot.close(figure)
        progress(done)
    return written
