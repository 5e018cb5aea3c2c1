# Copyright 2026 ahv developers, Apache-2.0
"""Figures of a replay: commands as recorded and as replayed, and the difference between them."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from ahv_analysis.bag.rows import Array
from ahv_analysis.bag.series import Series
from ahv_analysis.quantities import Quantity, of_topic
from ahv_analysis.replay.inputs import Recording
from ahv_analysis.replay.replay import Replay
from ahv_analysis.replay.result import Stamps, common_stamps
from ahv_analysis.report.drawn import drawn, drawn_time
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

ROUNDING = 1e-6  # [unit of the label] what moves less is drawn as the constant that it is


TITLES: dict[LoopTopic, str] = {
    ATTITUDE_COMMAND: "Attitude command",
    RATE_COMMAND: "Body-rate command",
    LEARNER: "Approximate and desired plant of the disturbance learner",
    DISTURBANCE_ESTIMATE: "Disturbance estimate",
    SURFACE_COMMAND: "Surface command",
    THROTTLE_COMMAND: "Throttle command",
}


def replay_figures(
    recording: Recording, flown: Replay
) -> tuple[Sequence[Plate], Callable[[Plate], Figure]]:
    """A figure for every topic that was replayed, and how to draw one."""
    topics = {topic.name.rpartition("/")[2]: topic for topic in flown.answers}
    plates = [Plate(name, TITLES[topic], ()) for name, topic in topics.items()]

    def draw(plate: Plate) -> Figure:
        topic = topics[plate.number]
        nothing = Series(np.empty(0, np.int64), np.empty((0, len(topic.layout.fields))))
        recorded = recording.topics.get(topic, nothing)
        return draw_replay(plate.title, of_topic(topic), recorded, flown.answers[topic])

    return plates, draw


def draw_replay(
    title: str,
    quantities: Sequence[Quantity],
    recorded: Series,
    replayed: Series,
) -> Figure:
    """Draw commands over time: on the left both, on the right replayed less recorded."""
    common = common_stamps(recorded.stamps, replayed.stamps)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(
            len(quantities),
            2,
            sharex=True,
            squeeze=False,
            figsize=(9.6, 1.9 * len(quantities) + 0.9),
            width_ratios=(3, 2),
        )
        for one, (both, between) in zip(quantities, axes, strict=True):
            before, after = _column(recorded, one), _column(replayed, one)
            difference = _at(common, replayed, after) - _at(common, recorded, before)
            before, after, difference = (
                _drawn(recorded.stamps, before),
                _drawn(replayed.stamps, after),
                _drawn(common, difference),
            )
            both.plot(*before, color="0.55", linewidth=2.4, label="recorded")
            both.plot(*after, color="C0", linewidth=1.1, label="replayed")
            between.plot(*difference, color="C3")
            both.set_ylabel(one.label())
            seen = np.concatenate((before[1], after[1]))
            if np.nanmax(seen) - np.nanmin(seen) < ROUNDING:
                both.set_ylim(seen[0] - 1.0, seen[0] + 1.0)
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


def _drawn(stamps: Stamps, values: Array) -> tuple[Array, Array]:
    """Times [s] and values of a line."""
    time = stamps / NANOSECONDS
    return drawn_time(time), drawn(time, values)


def _at(common: Stamps, series: Series, values: Array) -> Array:
    """Those of the values (n,) of a series that are at `common` stamps."""
    return values if common is series.stamps else values[np.searchsorted(series.stamps, common)]


def _column(series: Series, one: Quantity) -> Array:
    """Values of a quantity, in the unit for people."""
    return one.shown_values(series.values[:, one.index])
