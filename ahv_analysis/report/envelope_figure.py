# Copyright 2026 ahv developers, Apache-2.0
"""The picture of the envelope of level flight: a row a quantity, a column a mass."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from ahv_analysis.bag.rows import Array
from ahv_analysis.ranges import Values
from ahv_plant.envelope import EnvelopePoint
from ahv_plant.model.limits import LIMITS, Limit

QUANTITIES = (  # field of a point, factor to what is shown, label
    ("alpha_deg", 1.0, "alpha [deg]"),
    ("elevon_deg", 1.0, "elevons [deg]"),
    ("throttle", 1.0, "throttle [-]"),
    ("dynamic_pressure_pa", 1e-3, "dynamic pressure [kPa]"),
)
LIMITED = ("alpha_deg", "elevon_deg", "throttle")  # what LIMITS limit
COLOURS = ("#56B4E9", "#E69F00", "#CC79A7")  # of LIMITS; told apart by every eye (Okabe, Ito)
HATCHES = ("////", "....", "\\\\\\\\")  # where each of LIMITS is passed
NOWHERE = "xxxx"  # where no trim was found
FAR = 1e9  # beyond any margin
LINES = 8  # of a panel, at most
FINER = 8  # times, between points
LABEL, COVER = 2.3, 2.4  # drawn in this order, below the frame
MARGINS = (20.0, 40.0, 60.0, 80.0)  # [%]


class Grid(NamedTuple):
    """Values of the axes, as they were asked for."""

    altitudes: Values
    machs: Values
    masses: Values

    def planes(self, numbers: Sequence[float]) -> Array:
        """Numbers of the points as an array (mass, altitude, Mach number)."""
        shape = [len(axis.numbers) for axis in (self.masses, self.altitudes, self.machs)]
        return np.array(numbers, dtype=float).reshape(shape)


def draw_envelope(points: Sequence[EnvelopePoint], grid: Grid, title: str) -> Figure:
    """Draw trims over Mach number and altitude; hatched where a limit is passed.

    `points` are mass by mass, in each altitude by altitude, in each from low to high Mach number.
    """
    rows, columns = len(QUANTITIES) + 1, len(grid.masses.numbers)
    figure = Figure(figsize=(1.8 + 2.6 * columns, 2.1 * rows), dpi=110, layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    inside = grid.planes([point.within_limits for point in points]) == 1.0
    shares = [
        np.ma.masked_invalid(
            grid.planes([limit.relative_margin(getattr(point, field)) for point in points])
        )
        for limit, field in zip(LIMITS, LIMITED, strict=True)
    ]
    for row, (field, factor, label) in zip(panels, QUANTITIES, strict=False):
        values = factor * grid.planes([getattr(point, field) for point in points])
        _draw_quantity(figure, row, np.ma.masked_invalid(values), inside, grid, label)
    for column, axes in enumerate(panels[-1]):
        _draw_nearest(axes, [share[column] for share in shares], grid)
    side = panels[-1, -1]
    said = side.text(
        1.1, 0.5, "nearest limit,\nmargin [%]", rotation=90, va="center", transform=side.transAxes
    )
    said.set_in_layout(False)  # there is room where the colour bars are
    for row in panels:
        for column, axes in enumerate(row):
            _hatch(axes, [share[column] for share in shares], grid)
    for axes, mass in zip(panels[0], grid.masses.written, strict=True):
        axes.set_title(f"{mass:g} {grid.masses.unit}", fontsize=10)
    for axes in panels[-1]:
        axes.set_xlabel("Mach number [-]")
    for axes in panels[:, 0]:
        axes.set_ylabel(f"altitude [{grid.altitudes.unit}]")
    figure.legend(
        handles=_legend(shares), loc="outside lower center", ncols=2, fontsize=8, frameon=False
    )
    figure.suptitle(title, fontsize=9)
    return figure


def _draw_quantity(
    figure: Figure, row: Sequence[Axes], values: Array, inside: Array, grid: Grid, label: str
) -> None:
    """Draw a quantity at all masses, its colours chosen for what is within the limits."""
    over = grid.machs.written, grid.altitudes.written
    shown = values[inside] if inside.any() else values.compressed()
    low, high = (float(shown.min()), float(shown.max())) if len(shown) else (0.0, 1.0)
    levels = MaxNLocator(LINES).tick_values(low, high)
    for axes, plane in zip(row, values, strict=True):
        colours = axes.contourf(*over, plane, levels, cmap="viridis", extend="both")
        lines = axes.contour(
            *over, plane, levels, colors="black", linewidths=0.5, linestyles="solid"
        )
        axes.clabel(lines, fmt="%g", fontsize=7, zorder=LABEL)
    figure.colorbar(colours, ax=list(row), label=label)


def _draw_nearest(axes: Axes, shares: Sequence[Array], grid: Grid) -> None:
    """Draw which limit is nearest, and how far it is in per cent of half its range."""
    over = _finer(np.array(grid.machs.written)), _finer(np.array(grid.altitudes.written))
    finer = [np.ma.masked_invalid(_finer(_finer(share.filled(np.nan)).T).T) for share in shares]
    for i, colour in enumerate(COLOURS):
        others = np.ma.min([share for j, share in enumerate(finer) if j != i], axis=0)
        axes.contourf(*over, others - finer[i], [0.0, FAR], colors=[colour])
    lines = axes.contour(
        *over, 100.0 * np.ma.min(finer, axis=0), MARGINS, colors="black", linewidths=0.8
    )
    axes.clabel(lines, fmt="%g %%", fontsize=7, zorder=LABEL)


def _finer(values: Array) -> Array:
    """Values with more between them, along the first axis: the nearest limit changes there."""
    steps = np.linspace(0.0, len(values) - 1.0, FINER * (len(values) - 1) + 1)
    below = np.minimum(steps.astype(int), len(values) - 2)
    share = (steps - below).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[below] + share * values[below + 1])


def _hatch(axes: Axes, shares: Sequence[Array], grid: Grid) -> None:
    """Cover where limits are passed, and mark where there is no trim at all."""
    over = grid.machs.written, grid.altitudes.written
    axes.patch.set(hatch=NOWHERE, facecolor="white", edgecolor="gray")
    passed = [
        (share, hatch)
        for share, hatch in zip(shares, HATCHES, strict=True)
        if np.ma.any(share < 0.0)
    ]
    beyond = [-FAR, 0.0]
    for share, _ in passed:
        axes.contourf(*over, share, beyond, colors=["white"], zorder=COVER)
    for share, hatch in passed:
        hatched = axes.contourf(*over, share, beyond, colors="none", hatches=[hatch], zorder=COVER)
        hatched.set(edgecolor="gray", linewidth=0.0)
        axes.contour(*over, share, [0.0], colors="black", linewidths=1.8, zorder=COVER)


def _legend(shares: Sequence[Array]) -> list[Patch]:
    """What is hatched and coloured, as far as there is any of it."""
    nearest = np.ma.argmin(np.ma.array(shares), axis=0)
    handles = [
        Patch(facecolor=colour, label=f"nearest limit: {limit.name} (% of half its range)")
        for i, (limit, colour) in enumerate(zip(LIMITS, COLOURS, strict=True))
        if np.any((nearest == i) & (np.ma.min(shares, axis=0) >= 0.0))
    ]
    handles += [
        Patch(facecolor="white", edgecolor="gray", hatch=hatch, label=f"no trim: {_range(limit)}")
        for limit, hatch, share in zip(LIMITS, HATCHES, shares, strict=True)
        if np.ma.any(share < 0.0)
    ]
    if np.ma.is_masked(shares[0]):
        handles.append(
            Patch(facecolor="white", edgecolor="gray", hatch=NOWHERE, label="no trim found")
        )
    return handles


def _range(limit: Limit) -> str:
    return f"{limit.name} not within {limit.low:g} to {limit.high:g} {limit.unit}".rstrip()
