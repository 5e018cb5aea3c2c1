# Copyright 2026 ahv developers, Apache-2.0
"""The picture of a map: success rate as colours, with contour lines."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.axis import Axis

CONTOURS = (50.0, 90.0, 99.0)  # [%]
MOST_TICKS = 8  # that an axis has room for
NO_TRIM = "not flown: the nominal vehicle has no trim within its limits"


def draw_map(x: Axis, y: Axis, rates: Array, title: str) -> Figure:
    """Draw `rates` (y, x) [-] over two axes; hatched where there is none."""
    figure = Figure(figsize=(4.8, 4.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    percent = np.ma.masked_invalid(100.0 * rates)
    over = x.written.written, y.written.written
    mesh = axes.pcolormesh(*over, percent, shading="nearest", cmap="viridis", vmin=0.0, vmax=100.0)
    levels = [level for level in CONTOURS if percent.min() < level < percent.max()]
    if levels:
        lines = axes.contour(*over, percent, levels, colors="black", linewidths=1.0)
        axes.clabel(lines, fmt="%g %%", fontsize=8)
    figure.colorbar(mesh, label="success [%]")
    axes.set(xlabel=x.title, ylabel=y.title, xticks=_ticks(over[0]), yticks=_ticks(over[1]))
    if np.ma.is_masked(percent):
        axes.patch.set(hatch="///", facecolor="white", edgecolor="gray")
        empty = Patch(hatch="///", facecolor="white", edgecolor="gray", label=NO_TRIM)
        figure.legend(handles=[empty], loc="outside lower left", fontsize=8, frameon=False)
    figure.suptitle(title, fontsize=8)
    return figure


def _ticks(values: tuple[float, ...]) -> tuple[float, ...]:
    """Values to name: where points were flown, of many only some."""
    return values[:: -(-len(values) // MOST_TICKS)]
