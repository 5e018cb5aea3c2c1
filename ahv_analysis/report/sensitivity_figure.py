# Copyright 2026 ahv developers, Apache-2.0
"""Pictures of what decides: a tornado, the index against chance, and the two that matter most."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.columns import LOST, label
from ahv_analysis.campaign.sensitivity import SLICES, Sensitivities, logistic
from ahv_analysis.campaign.summary import exact_interval

DECIDES, NOT, LOSS = "#0072B2", "0.75", "#D55E00"  # told apart by every eye (Okabe, Ito)
CELLS = 8  # of the plane, along each side
COLUMNS = 3  # of scatter plots
MOST = 12  # factors that a picture has room for


def draw_sensitivity(
    found: Sensitivities, values: Array, lost: Array, factors: Mapping[str, Array], title: str
) -> Figure:
    """Draw a tornado, the index of every factor against chance, and the plane of the first two.

    `values` (N,) are those of the quantity, `lost` (N,) the verdicts, `factors` (N,) each.
    """
    figure = Figure(figsize=(11.0, 4.4), dpi=110, layout="constrained")
    tornado, index, plane = figure.subplots(1, 3, width_ratios=(3, 2, 3))
    shown = found.factors[:MOST]
    _draw_tornado(tornado, found, float(np.nanmean(values)))
    for place, one in enumerate(shown):
        index.barh(-place, one.pawn, color=DECIDES if one.decides else NOT, height=0.6)
    index.axvline(found.chance, color="black", ls=":", lw=1.2)
    index.text(found.chance, 0.65, " chance", fontsize=8, va="bottom")
    index.set(yticks=[], xlim=(0.0, 1.0), xlabel="PAWN index [-]", ylim=tornado.get_ylim())
    index.set_title("how far a tenth of its range\nmoves the distribution", fontsize=9)
    first, second = _first_two(found)
    if second:
        _draw_plane(figure, plane, (first, second), found.quantity, values, lost, factors)
    else:
        _draw_slices(plane, found.quantity, values, lost, first, factors[first])
    figure.suptitle(title, fontsize=9)
    return figure


def _first_two(found: Sensitivities) -> tuple[str, str]:
    names = [one.factor for one in found.factors[:2]]
    return names[0], names[1] if len(names) > 1 else ""


def _draw_tornado(axes: Axes, found: Sensitivities, mean: float) -> None:
    shown = found.factors[:MOST]
    ends = [value for one in shown for value in (one.at_low, one.at_high)]
    for place, one in enumerate(shown):
        colour = DECIDES if one.decides else NOT
        axes.barh(-place, one.at_high - one.at_low, left=one.at_low, color=colour, height=0.6)
        axes.plot(one.at_low, -place, "|", color="black", ms=11, mew=2.0)
    axes.axvline(mean, color="0.3", lw=0.8)
    axes.set(yticks=[-place for place in range(len(shown))], ylim=(-len(shown) + 0.4, 1.1))
    axes.set_yticklabels([f"{one.factor}  {one.rank_correlation:+.2f}" for one in shown])
    margin = 0.06 * (max(ends) - min(ends) or 1.0)
    axes.set_xlim(min(*ends, mean) - margin, max(*ends, mean) + margin)
    of = "share of lost runs [-]" if found.quantity == LOST else f"mean {label(found.quantity)}"
    axes.set_xlabel(of)
    axes.set_title(
        "mean where the factor is least (tick) to where it is most\n"
        "(tenths of the runs); beside the name: rank correlation",
        fontsize=9,
    )


def _draw_plane(
    figure: Figure,
    axes: Axes,
    names: tuple[str, str],
    quantity: str,
    values: Array,
    lost: Array,
    factors: Mapping[str, Array],
) -> None:
    """Draw means in cells of the plane of two factors, lost runs, and where losses begin."""
    x, y = (factors[name] for name in names)
    there = np.isfinite(values)
    edges = [np.linspace(one.min(), one.max(), CELLS + 1) for one in (x, y)]
    counts, *_ = np.histogram2d(x[there], y[there], edges)
    sums, *_ = np.histogram2d(x[there], y[there], edges, weights=values[there])
    means = np.ma.masked_invalid(np.divide(sums, counts, where=counts > 0, out=sums * np.nan))
    mesh = axes.pcolormesh(*edges, means.T, cmap="cividis_r" if quantity == LOST else "viridis")
    of = "share of lost runs [-]" if quantity == LOST else f"mean {label(quantity)}"
    figure.colorbar(mesh, ax=axes, label=of)
    said = f"{int(counts.min())} to {int(counts.max())} runs a cell"
    if lost.any():
        axes.plot(x[lost], y[lost], ".", ms=3, color=LOSS, rasterized=True)
        said += "; dots: lost runs"
    if lost.any() and not lost.all() and boundary(axes, x, y, lost):
        said += "; line: half are lost"
    axes.set(xlabel=label(names[0]), ylabel=label(names[1]))
    axes.set_title(f"the two of largest index\n{said}", fontsize=9)


def boundary(axes: Axes, x: Array, y: Array, lost: Array) -> bool:
    """Draw where a regression of second order has half of the runs lost; False if nowhere."""
    over = np.linspace(x.min(), x.max(), 80), np.linspace(y.min(), y.max(), 80)
    weights, _ = logistic(_second_order(x, y, x, y), lost.astype(float))
    grid = [plane.ravel() for plane in np.meshgrid(*over)]
    odds = np.column_stack([np.ones(len(grid[0])), _second_order(*grid, x, y)]) @ weights
    if not odds.min() < 0.0 < odds.max():
        return False
    plane = odds.reshape(len(over[1]), -1)
    axes.contour(*over, plane, [0.0], colors="white", linewidths=3.0)
    axes.contour(*over, plane, [0.0], colors="black", linewidths=1.5)
    return True


def _second_order(x: Array, y: Array, x_of: Array, y_of: Array) -> Array:
    one, other = (x - x_of.mean()) / x_of.std(), (y - y_of.mean()) / y_of.std()
    return np.column_stack([one, other, one**2, other**2, one * other])


def draw_scatter(
    found: Sensitivities, values: Array, lost: Array, factors: Mapping[str, Array], title: str
) -> Figure:
    """Draw the quantity over every factor, the most decisive first."""
    shown = [one.factor for one in found.factors[:MOST]]
    rows = -(-len(shown) // COLUMNS)
    figure = Figure(figsize=(9.0, 0.7 + 2.3 * rows), dpi=110, layout="constrained")
    panels = figure.subplots(rows, COLUMNS, sharey=True, squeeze=False)
    for axes, name in zip(panels.flat, shown, strict=False):
        _draw_slices(axes, found.quantity, values, lost, name, factors[name])
    for axes in panels.flat[len(shown) :]:
        axes.set_axis_off()
    of = "share of lost runs [-]" if found.quantity == LOST else label(found.quantity)
    figure.supylabel(of, fontsize=9)
    figure.suptitle(title, fontsize=9)
    return figure


def _draw_slices(
    axes: Axes, quantity: str, values: Array, lost: Array, name: str, factor: Array
) -> None:
    """Draw every run and the median of each tenth, or the share of lost runs with its interval."""
    groups = np.array_split(np.argsort(factor, kind="stable"), SLICES)
    middles = [float(np.median(factor[group])) for group in groups]
    if quantity == LOST:
        shares = np.array([float(np.mean(lost[group])) for group in groups])
        bars = [exact_interval(int(np.sum(lost[group])), len(group)) for group in groups]
        low, high = np.array(bars).T
        axes.errorbar(middles, shares, (shares - low, high - shares), fmt="o-", ms=3, lw=1.0)
    else:
        for where, colour in ((~lost, DECIDES), (lost, LOSS)):
            style = {"ms": 2, "color": colour, "alpha": 0.4, "rasterized": True}
            axes.plot(factor[where], values[where], ".", **style)
        medians = [float(np.nanmedian(values[group])) for group in groups]
        axes.plot(middles, medians, "o-", color="black", ms=3, lw=1.0)
    axes.set_xlabel(label(name), fontsize=9)
    axes.grid(color="0.9")
