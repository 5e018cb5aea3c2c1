# Copyright 2026 ahv developers, Apache-2.0
"""The picture of a map: success rate as colours, with contour lines."""

from pathlib import Path

from matplotlib.figure import Figure

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.map import Axis

CONTOURS = (50.0, 90.0, 99.0)  # [%]
MOST_TICKS = 8  # that an axis has room for


def draw_map(x: Axis, y: Axis, rates: Array, title: str) -> Figure:
    """Draw `rates` (y, x) [-] over two axes."""
    figure = Figure(figsize=(4.8, 4.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    percent = 100.0 * rates
    mesh = axes.pcolormesh(
        x.values, y.values, percent, shading="nearest", cmap="viridis", vmin=0.0, vmax=100.0
    )
    levels = [level for level in CONTOURS if percent.min() < level < percent.max()]
    if levels:
        lines = axes.contour(x.values, y.values, percent, levels, colors="black", linewidths=1.0)
        axes.clabel(lines, fmt="%g %%", fontsize=8)
    figure.colorbar(mesh, label="success [%]")
    axes.set(xlabel=x.title, ylabel=y.title, xticks=_ticks(x), yticks=_ticks(y))
    figure.suptitle(title, fontsize=8)
    return figure


def _ticks(axis: Axis) -> tuple[float, ...]:
    """Values to name: where points were flown, of many only some."""
    return axis.values[:: -(-len(axis.values) // MOST_TICKS)]


def save_map(figure: Figure, path: Path) -> None:
    """Write the picture, the same each time."""
    figure.savefig(path, metadata={"Software": None})
