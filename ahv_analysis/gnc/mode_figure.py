# Copyright 2026 ahv developers, Apache-2.0
"""The picture of modes: eigenvalues in the complex plane, each with its name."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from ahv_analysis.gnc.modes import LATERAL, Mode

LINEAR = 1e-3  # [rad/s] within which the axes are linear
KINDS = (("longitudinal", "o", "#0072B2"), ("lateral", "s", "#D55E00"))


def draw_modes(modes: Sequence[Mode], title: str) -> Figure:
    """Draw the modes: right of the line in the middle they grow, left of it they die away."""
    figure = Figure(figsize=(7.2, 4.2), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    axes.set_xscale("symlog", linthresh=LINEAR)
    axes.set_yscale("symlog", linthresh=LINEAR)
    axes.axvspan(0.0, 10.0, color="#F4D9D0", zorder=0)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.axhline(0.0, color="gray", linewidth=0.6)
    shown = set()
    for number, mode in enumerate(sorted(modes, key=lambda mode: mode.eigenvalue.real)):
        lateral = next(iter(mode.participation)) in LATERAL
        kind, marker, colour = KINDS[lateral]
        value = mode.eigenvalue
        ends = (value, value.conjugate()) if value.imag else (value,)
        axes.plot(
            [end.real for end in ends],
            [end.imag for end in ends],
            marker,
            color=colour,
            label=None if kind in shown else kind,
        )
        shown.add(kind)
        side = 1 if value.imag or number % 2 else -1
        axes.annotate(
            f"{mode.name} {value.real:.3g}" + (f" ± {value.imag:.3g} i" if value.imag else ""),
            (value.real, value.imag),
            (0, side * (26 if number % 4 < 2 or value.imag else 58)),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
            arrowprops={"arrowstyle": "-", "color": "gray", "linewidth": 0.5},
        )
    axes.set(xlim=(-10.0, 10.0), ylim=(-10.0, 10.0))
    axes.set(xlabel="real part [rad/s]: grows on the right", ylabel="imaginary part [rad/s]")
    axes.legend(loc="upper left", fontsize=8)
    figure.suptitle(f"Modes of the vehicle, open loop\n{title}", fontsize=9)
    return figure
