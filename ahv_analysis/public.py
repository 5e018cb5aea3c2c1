# Copyright 2026 ahv developers, Apache-2.0
"""What a notebook needs, as `import ahv_analysis as ahv` gives it: flights as arrays.

Campaigns, maps and the envelope of level flight are tables. Nothing here needs ROS: the library
flies, to the bits of the graph. `hardware` is a name in config/hardware, `profile` one in
config/profiles, or a file; what they set stands above the case's own, as with the commands.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
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
from ahv_analysis.campaign import map as maps
from ahv_analysis.campaign.axis import LEVEL, settings_of
from ahv_analysis.campaign.draws import checked_draws, load_draws
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
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import Truth, draw_dispersion
from ahv_plant.envelope import envelope_point

__all__ = ["Flight", "case_names", "envelope", "fly", "fly_campaign", "fly_map", "read_bag"]


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
        return summarize(self.record, self.ended_early, control=self.case.control)


def fly(
    case: str,
    *,
    dispersion: float | Mapping[str, float] | None = None,
    seed: int = 0,
    run: int = 0,
    duration: float | None = None,
    hardware: str | None = None,
    profile: str | None = None,
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
    flown = load_case(case, changes, draw, hardware=hardware, profile=profile)
    steps = list(fly_steps(flown))
    return Flight(flown, record_of(steps, flown.plant.truth.geometric), steps[-1].ended_early)


def fly_campaign(
    case: str,
    *,
    level: float,
    runs: int,
    seed: int = 0,
    random_starts: bool = False,
    draws: str | Path | Mapping[str, Any] | None = None,
    hardware: str | None = None,
    profile: str | None = None,
    folder: str | Path | None = None,
    workers: int | None = None,
) -> pyarrow.Table:
    """Fly `runs` vehicles drawn at `level` [-]: a row a run, as docs/results.md speaks of them.

    `draws` is what is drawn besides, a file as `ahv monte-carlo --draws` has it or what stands in
    one. With a `folder` the runs are kept there, and flown on from if it has some; `workers`
    threads fly, one a core if it is not said. `.to_pandas()` makes a data frame of the table.
    Raises ParameterError for what cannot be flown, CampaignError for a folder of another campaign.
    """
    level = float(LEVEL.check("campaign", level))
    flown = load_case(case, hardware=hardware, profile=profile)
    drawn = load_draws(Path(draws)) if isinstance(draws, str | Path) else draws
    if drawn is not None:
        drawn = dict(drawn)
        checked_draws(drawn)
    campaign = campaigns.Campaign(flown, level, _counted(runs), seed, random_starts, drawn)
    with _kept_in(folder, workers) as (kept, pool):
        campaigns.fly_campaign(campaign, kept, pool)
        table = read_table([str(part) for part in part_files(level_folder(kept, level))])
        return table.slice(0, runs)


def fly_map(
    case: str,
    *,
    x: str,
    y: str,
    settings: Mapping[str, object] | None = None,
    level: float | None = None,
    runs: int = 200,
    seed: int = 0,
    hardware: str | None = None,
    profile: str | None = None,
    folder: str | Path | None = None,
    workers: int | None = None,
) -> pyarrow.Table:
    """Fly the success rate over two axes: a row a point, as map.parquet of `ahv map` has it.

    `x` and `y` are written as for the command, like "latency.delay=0:0.04:3"; `settings` are
    parameters that differ, by name; `level` [-] is 0.3 unless it is given or an axis. Every point
    is a campaign of the same `runs` vehicles. `folder` and `workers` are as in `fly_campaign`.
    Raises ParameterError and CampaignError.
    """
    flown = maps.read_map(
        case,
        x,
        y,
        settings_of(settings or {}),
        level=level,
        runs=_counted(runs),
        seed=seed,
        hardware=hardware,
        profile=profile,
    )
    with _kept_in(folder, workers) as (kept, pool):
        points = maps.fly_map(flown, kept, pool)
    return pyarrow.Table.from_pylist([point._asdict() for point in points])


def envelope(
    altitudes: Sequence[float],
    machs: Sequence[float],
    masses: Sequence[float],
    *,
    geometric: bool = False,
) -> pyarrow.Table:
    """Trim the nominal vehicle (3.5.1) at every altitude [m], Mach number [-] and mass [kg].

    A row a point, as trim.parquet of `ahv trim --map` has it, with the margins to every limit; a
    point without a trim has nan. Raises ParameterError outside the range of the model.
    """
    truth = Truth(geometric)
    try:
        points = [
            envelope_point(altitude, mach, mass, truth)
            for mass, altitude, mach in product(masses, altitudes, machs)
        ]
    except ValueError as error:
        raise ParameterError(f"envelope: {error}") from error
    return pyarrow.Table.from_pylist([point._asdict() for point in points])


def _counted(runs: int) -> int:
    if runs < 1:
        raise ParameterError(f"runs is {runs}, but must be 1 or more")
    return runs


@contextmanager
def _kept_in(folder: str | Path | None, workers: int | None) -> Iterator[tuple[Path, Executor]]:
    """Folder of what is flown, a passing one if it is None, and who flies."""
    with TemporaryDirectory() as passing, ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        yield Path(folder or passing), pool


def read_bag(folder: str | Path) -> xarray.Dataset:
    """The flight in a bag, as `Flight.dataset` has one; BagError if there is none.

    See Also: docs/bags.md, and `ahv bag export` for other tools.
    """
    return bag_dataset(Path(folder))
