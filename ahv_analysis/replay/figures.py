# Copyright 2026 ahv developers, Apache-2.0
"""Figures of a replay: commands as recorded and as replayed, and the difference between them."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from ahv_analysis.bag.record import Array
from ahv_analysis.bag.series import Series
from ahv_analysis.replay.inputs import Recording
from ahv_analysis.replay.replay import Replay
from ahv_analysis.report.figures import STYLE, Plate
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    DISTURBANCE_ESTIMATE,
    LEARNER,
    RATE_COMMAND,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
    LoopTopic,
)
from ahv_plant.model.constants import DEGREES

ROUNDING = 1e-6  # [unit of the label] what moves less is drawn as the constant that it is


class Line(NamedTuple):
    """One field of a topic: place, label and scale to the unit of the label."""

    index: int
    label: str
    scale: float = DEGREES


TITLES: dict[LoopTopic, tuple[str, Sequence[Line]]] = {
    ATTITUDE_COMMAND: (
        "Attitude command",
        [
            Line(0, r"$\phi^*$ [deg]"),
            Line(1, r"$\theta^*$ [deg]"),
            Line(2, r"$\psi^*$ [deg]"),
        ],
    ),
    RATE_COMMAND: (
        "Body-rate command",
        [Line(0, "$P^*$ [deg/s]"), Line(1, "$Q^*$ [deg/s]"), Line(2, "$R^*$ [deg/s]")],
    ),
    LEARNER: (
        "Approximate and desired plant of the disturbance learner",
        [
            Line(index, f"${rate}_{plant}$ [deg/s]")
            for index, (plant, rate) in enumerate(product("ad", "PQR"))
        ],
    ),
    DISTURBANCE_ESTIMATE: (
        "Disturbance estimate",
        [
            Line(3, r"$\hat d_P$ [deg/s$^2$]"),
            Line(4, r"$\hat d_Q$ [deg/s$^2$]"),
            Line(5, r"$\hat d_R$ [deg/s$^2$]"),
        ],
    ),
    SURFACE_COMMAND: (
        "Surface command",
        [
            Line(0, r"$\delta_e$ [deg]"),
            Line(1, r"$\delta_a$ [deg]"),
            Line(2, r"$\delta_r$ [deg]"),
        ],
    ),
    THROTTLE_COMMAND: ("Throttle command", [Line(0, r"$\sigma_T$ [-]", 1.0)]),
}


def replay_figures(
    recording: Recording, flown: Replay
) -> tuple[Sequence[Plate], Callable[[Plate], Figure]]:
    """A figure for every topic that was replayed, and how to draw one."""
    topics = {topic.name.rpartition("/")[2]: topic for topic in flown.answers}
    plates = [Plate(name, TITLES[topic][0], ()) for name, topic in topics.items()]

    def draw(plate: Plate) -> Figure:
        topic = topics[plate.number]
        nothing = Series(np.empty(0, np.int64), np.empty((0, len(topic.layout.fields))))
        recorded = recording.topics.get(topic, nothing)
        return draw_replay(plate.title, TITLES[topic][1], recorded, flown.answers[topic])

    return plates, draw


def draw_replay(
    title: str,
    lines: Sequence[Line],
    recorded: Series,
    replayed: Series,
) -> Figure:
    """Draw commands over time: on the left both, on the right replayed less recorded."""
    common, before_at, after_at = np.intersect1d(
        recorded.stamps, replayed.stamps, assume_unique=True, return_indices=True
    )
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(lines),
            2,
            sharex=True,
            squeeze=False,
            figsize=(9.6, 1.9 * len(lines) + 0.9),
            width_ratios=(3, 2),
        )
        for line, (both, between) in zip(lines, axes, strict=True):
            before, after = _column(recorded, line), _column(replayed, line)
            both.plot(*before, color="0.55", linewidth=2.4, label="recorded")
            both.plot(*after, color="C0", linewidth=1.1, label="replayed")
            between.plot(
                common / NANOSECONDS, after[1][after_at] - before[1][before_at], color="C3"
            )
            both.set_ylabel(line.label)
            drawn = np.concatenate((before[1], after[1]))
            if np.ptp(drawn) < ROUNDING:
                both.set_ylim(drawn[0] - 1.0, drawn[0] + 1.0)
            for axis in (both, between):
                axis.margins(x=0)
                axis.ticklabel_format(useOffset=False)
        axes[0][1].set_title("replayed less recorded", fontsize=9)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
        figure.suptitle(title, fontsize=10, x=0.02, ha="left")
        figure.align_ylabels(axes[:, 0])
        axes[0][0].legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, fontsize=8
        )
        figure.tight_layout()
    return figure


def _column(series: Series, line: Line) -> tuple[Array, Array]:
    """Time [s] and values of a field, in the unit of its label."""
    return series.stamps / NANOSECONDS, series.values[:, line.index] * line.scale
