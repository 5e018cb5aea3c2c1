# Copyright 2026 ahv developers, Apache-2.0
"""What a notebook needs, as `import ahv_analysis as ahv` gives it: flights as arrays.

Nothing here needs ROS: the library flies, to the bits of the graph.
"""

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pyarrow
import xarray
from pyarrow.parquet import read_table

from ahv_analysis.bag.dataset import bag_dataset, flight_dataset
from ahv_analysis.bag.notes import NOTES, read_notes
from ahv_analysis.bag.record import FlightRecord, record_of
from ahv_analysis.campaign import campaign as campaigns
from ahv_analysis.campaign.store import level_folder, part_files
from ahv_analysis.flight.case import (
    Case,
    Draw,
    case_names,
    dispersion_parameters,
    load_case,
    notes,
)
from ahv_analysis.flight.library import fly as fly_steps
from ahv_analysis.report.summary import summarize
from ahv_plant.dispersion import draw_dispersion

__all__ = ["Flight", "case_names", "fly", "fly_campaign", "read_bag"]


@dataclass(frozen=True)
class Flight:
    """A flight that was flown here: what was set up, and what came of it.

    See Also: `fly`, which makes one; `read_bag`, for one that was recorded.
    """

    case: Case
    record: FlightRecord  # states and commands as arrays, in the units of `State`
    ended_early: str  # why it ended before its time; empty if it did not

    def dataset(self) -> xarray.Dataset:
        """Every signal over `time` [s], with units, frame and meaning as attributes."""
        return flight_dataset(self.record, read_notes({NOTES: notes(self.case)}))

    def summary(self) -> dict[str, Any]:
        """Verdict, extremes and end, as `ahv fly --json` prints them."""
        return summarize(self.record, self.ended_early)


def fly(
    case: str,
    *,
    dispersion: float | Mapping[str, float] | None = None,
    seed: int = 0,
    run: int = 0,
    duration: float | None = None,
) -> Flight:
    """Fly a case: a name in config/cases, or a YAML file.

    `dispersion` is a level [-] like 0.3, at which the vehicle of `seed` and `run` is drawn, the
    one that run of a campaign flies; or multipliers [-] by their names, like {"CL": 0.8}.
    `duration` [s] stands in for that of the case. Raises ParameterError, which names what is
    wrong.
    """
    changes: dict[str, object] = {}
    draw = None
    if isinstance(dispersion, Mapping):
        changes |= {f"dispersion.{name}": value for name, value in dispersion.items()}
    elif dispersion is not None:
        changes |= dispersion_parameters(draw_dispersion(dispersion, seed, run))
        draw = Draw(dispersion, seed, run)
    if duration is not None:
        changes["duration"] = duration
    flown = load_case(case, changes, draw)
    steps = list(fly_steps(flown))
    return Flight(flown, record_of(steps, flown.plant.truth.geometric), steps[-1].ended_early)


def fly_campaign(
    case: str,
    *,
    level: float,
    runs: int,
    seed: int = 0,
    random_starts: bool = False,
    folder: str | Path | None = None,
    workers: int | None = None,
) -> pyarrow.Table:
    """Fly `runs` vehicles drawn at `level` [-]: a row a run, as docs/results.md speaks of them.

    With a `folder` the runs are kept there, and flown on from if it has some; `workers` threads
    fly, one a core if it is not said. `.to_pandas()` makes a data frame of the table. Raises
    ParameterError for a case that cannot be flown, CampaignError for a folder of another campaign.
    """
    campaign = campaigns.Campaign(load_case(case), level, runs, seed, random_starts)
    with ExitStack() as stack:
        kept = Path(folder or stack.enter_context(TemporaryDirectory()))
        pool = stack.enter_context(ThreadPoolExecutor(workers or os.cpu_count()))
        campaigns.fly_campaign(campaign, kept, pool)
        table = read_table([str(part) for part in part_files(level_folder(kept, level))])
        return table.slice(0, runs)


def read_bag(folder: str | Path) -> xarray.Dataset:
    """The flight in a bag, as `Flight.dataset` has one; BagError if there is none.

    See Also: docs/bags.md, and `ahv bag export` for other tools.
    """
    return bag_dataset(Path(folder))
