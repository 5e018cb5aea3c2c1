"""The report's figures, drawn from recorded flights."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.figure import Figure

from ahv_analysis.record import Array, FlightRecord
from ahv_plant.constants import DEGREES, UNSTART_ALPHA


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


PLATES = (
    Plate(
        "3.2",
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
    ),
    Plate(
        "3.3",
        "Velocity components",
        (_state("$u$ [m/s]", "u"), _state("$v$ [m/s]", "v"), _state("$w$ [m/s]", "w")),
    ),
    Plate(
        "3.4",
        "Altitude, mass and flight path angle",
        (
            _state("$h$ [km]", "h", 1e-3),
            _state("$M_v$ [t]", "mass", 1e-3),
            Panel(r"$\gamma$ [deg]", lambda record: record.climb_angle * DEGREES),
        ),
    ),
    Plate(
        "3.5",
        "Roll, pitch and yaw angle",
        (
            _angle(r"$\phi$ [deg]", "phi", 0),
            _angle(r"$\theta$ [deg]", "theta", 1),
            _angle(r"$\psi$ [deg]", "psi", 2),
        ),
    ),
    Plate(
        "3.6",
        "Roll, pitch and yaw rate",
        (
            _rate("$P$ [deg/s]", "P", 0),
            _rate("$Q$ [deg/s]", "Q", 1),
            _rate("$R$ [deg/s]", "R", 2),
        ),
    ),
    Plate(
        "3.7",
        "Controls",
        (
            _surface(r"$\delta_e$ [deg]", 0),
            _surface(r"$\delta_a$ [deg]", 1),
            _surface(r"$\delta_r$ [deg]", 2),
            Panel(r"$\sigma_T$ [-]", lambda record: record.throttle),
        ),
    ),
)

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
    """One figure with a line per flight, its commands dashed."""
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(plate.panels), 1, sharex=True, figsize=(6.4, 1.9 * len(plate.panels) + 0.6)
        )
        for panel, axis in zip(plate.panels, axes, strict=True):
            for number, (label, record) in enumerate(flights.items()):
                axis.plot(record.time, panel.values(record), color=f"C{number}", label=label)
                if panel.command is not None:
                    axis.plot(
                        record.time,
                        panel.command(record),
                        color=f"C{number}",
                        alpha=0.6,
                        linestyle="--",
                        linewidth=1.0,
                        label="command" if number == 0 else None,
                    )
            _settle_scale(axis)
            if panel.bound is not None:
                low, high = axis.get_ylim()
                for bound in (-panel.bound, panel.bound):
                    if low < bound < high:
                        axis.axhline(bound, color="0.4", linestyle=":", linewidth=1.0)
            axis.set_ylabel(panel.label)
        axes[-1].set_xlabel("time [s]")
        axes[-1].margins(x=0)
        figure.suptitle(f"Figure {plate.number}: {plate.title}", fontsize=10, x=0.02, ha="left")
        if len(flights) > 1 or any(panel.command for panel in plate.panels):
            figure.legend(*axes[0].get_legend_handles_labels(), loc="upper right", frameon=False)
        figure.align_ylabels(axes)
        figure.tight_layout()
    return figure


def _settle_scale(axis: pyplot.Axes) -> None:
    """Widen an axis that shows nothing but rounding, so that zero looks like zero."""
    low, high = axis.get_ylim()
    if high - low < 1e-6:
        middle = 0.5 * (low + high)
        axis.set_ylim(middle - 1.0, middle + 1.0)


def save_figures(
    flights: Mapping[str, FlightRecord],
    folder: Path,
    progress: Callable[[int], None] = lambda done: None,
) -> list[Path]:
    """Draw every figure as PNG and SVG into `folder`; `progress(done)` after each."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for done, plate in enumerate(PLATES, 1):
        figure = draw(plate, flights)
        for kind in ("png", "svg"):
            path = folder / f"figure_{plate.number.replace('.', '_')}.{kind}"
            metadata = {"Date": None} if kind == "svg" else None
            figure.savefig(path, dpi=150, metadata=metadata)
            written.append(path)
        pyplot.close(figure)
        progress(done)
    return written
