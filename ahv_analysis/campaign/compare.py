# Copyright 2026 ahv developers, Apache-2.0
"""Two campaigns on the same draws, paired run by run: who saves whom, and what else differs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, bootstrap, t

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.campaign.columns import COLUMNS, IDENTIFYING, is_lost, read_columns
from ahv_analysis.campaign.store import Columns, differences
from ahv_analysis.campaign.summary import exact_interval
from ahv_analysis.errors import CampaignError
from ahv_plant.dispersion import Dispersion

RESAMPLES = 1999  # of the bootstrap
LARGEST = 20_000  # differences up to which it is one; the mean of more is normal
BLOCK = 4_000_000  # numbers of a bootstrap that are in memory at a time
CONFIDENCE = 0.95
ROUNDING = 1e-9  # in the unit of any metric
SAME_DRAWS = ("level", "seed", "random_starts", "draws")


class Difference(NamedTuple):
    """How a metric differs, B less A, over the runs that both keep."""

    name: str
    unit: str
    mean_a: float
    mean_b: float
    mean: float  # of the differences
    low: float  # 95 % interval of that mean
    high: float
    differ: int  # runs whose values are not the same bits

    @property
    def tells(self) -> bool:
        """Whether it differs by more than rounding."""
        return max(abs(self.low), abs(self.high)) > ROUNDING


class Comparison(NamedTuple):
    """Two campaigns side by side."""

    runs: int  # that both have
    kept_by_both: int
    only_a: list[int]  # runs that only A keeps
    only_b: list[int]  # runs that only B keeps
    p_value: float  # [-] exact McNemar, two-sided
    rates: tuple[float, float]  # [-] success of A and of B, over these runs
    intervals: tuple[tuple[float, float], tuple[float, float]]  # exact, 95 %
    difference: tuple[float, float, float]  # [-] of the rates, B less A, with its interval
    metrics: list[Difference]
    differ: int  # runs of which any column differs, by as little as a bit
    apart: str  # in what else the two descriptions differ; empty if in nothing
    largest_alphas: tuple[Array, Array]  # [deg] of every run, by A and by B
    lost: tuple[Array, Array]

    @property
    def identical(self) -> bool:
        """Whether no value of any run differs."""
        return self.differ == 0


def compare(a: tuple[Campaign, Path], b: tuple[Campaign, Path]) -> Comparison:
    """Compare two campaigns, given with their folders, over the runs that both have.

    Raises CampaignError if they did not draw the same vehicles.
    """
    descriptions = [campaign.describe() for campaign, _ in (a, b)]
    one, other = ({name: each[name] for name in SAME_DRAWS} for each in descriptions)
    differing = differences(one, other)
    if differing:
        raise CampaignError(
            f"{a[1]} and {b[1]} are not of the same draws, and cannot be paired ({differing})"
        )
    first, second = _paired(read_columns(*a), read_columns(*b), (a[1], b[1]))
    return compare_columns(first, second, _settings_apart(*descriptions))


def _paired(a: Columns, b: Columns, folders: tuple[Path, Path]) -> tuple[Columns, Columns]:
    """Rows of the runs that both have."""
    _, here, there = np.intersect1d(a["run"], b["run"], return_indices=True)
    if not len(here):
        raise CampaignError(f"{folders[0]} and {folders[1]} have no run in common")
    first = {name: column[here] for name, column in a.items()}
    second = {name: column[there] for name, column in b.items()}
    for name in Dispersion._fields:
        if not np.array_equal(first[name], second[name]):
            raise CampaignError(
                f"{folders[0]} and {folders[1]} are not of the same draws: {name} of a run differs"
            )
    return first, second


def _settings_apart(a: Mapping[str, Any], b: Mapping[str, Any]) -> str:
    """Parameters in which two campaigns differ, and then their case; in words."""
    words = [] if a["case"] == b["case"] else [f"case {a['case']} and {b['case']}"]
    for node, values in a["parameters"].items():
        others = b["parameters"].get(node, {})
        words += [
            f"{node}.{name} {value} and {others.get(name)}"
            for name, value in values.items()
            if others.get(name) != value
        ]
    return ", ".join(words)


def compare_columns(a: Columns, b: Columns, apart: str = "") -> Comparison:
    """Compare columns of the same runs, in the same order; `apart` is what is known to differ."""
    lost_a, lost_b = is_lost(a), is_lost(b)
    runs = len(lost_a)
    only_a, only_b = (
        a["run"][one & ~other].tolist() for one, other in ((lost_b, lost_a), (lost_a, lost_b))
    )
    both = ~lost_a & ~lost_b
    kept = int(np.sum(~lost_a)), int(np.sum(~lost_b))
    parting = len(only_a) + len(only_b)
    gain = lost_a.astype(float) - lost_b.astype(float)
    return Comparison(
        runs,
        int(np.sum(both)),
        only_a,
        only_b,
        float(binomtest(len(only_a), parting).pvalue) if parting else 1.0,
        (kept[0] / runs, kept[1] / runs),
        (exact_interval(kept[0], runs), exact_interval(kept[1], runs)),
        (float(np.mean(gain)), *mean_interval(gain)),
        [
            _difference(name, a[name][both], b[name][both])
            for name in a
            if name not in IDENTIFYING and name in b
        ],
        _differing_runs(a, b),
        apart,
        (a["max_abs_alpha_deg"], b["max_abs_alpha_deg"]),
        (lost_a, lost_b),
    )


def _differing_runs(a: Columns, b: Columns) -> int:
    """Runs of which any column that both have differs; no trim is like no trim."""
    differ = np.zeros(len(a["run"]), dtype=bool)
    for name in a.keys() & b.keys():
        one, other = a[name].astype(float), b[name].astype(float)
        differ |= (one != other) & ~(np.isnan(one) & np.isnan(other))
    return int(np.sum(differ))


def _difference(name: str, a: Array, b: Array) -> Difference:
    there = np.isfinite(a.astype(float)) & np.isfinite(b.astype(float))
    before, after = a[there].astype(float), b[there].astype(float)
    difference = after - before
    unit = COLUMNS[name].unit if name in COLUMNS else ""
    if not len(difference):
        return Difference(name, unit, 0.0, 0.0, 0.0, 0.0, 0.0, 0)
    low, high = mean_interval(difference)
    means = float(np.mean(before)), float(np.mean(after)), float(np.mean(difference))
    return Difference(name, unit, *means, low, high, int(np.count_nonzero(difference)))


def mean_interval(values: Array) -> tuple[float, float]:
    """95 % interval of the mean of `values` (N,), in their unit.

    By scipy's percentile bootstrap; of many, where the mean is normal, by Student's t.
    """
    if np.ptp(values) == 0.0:  # all the same, or only one
        return float(values[0]), float(values[0])
    if len(values) > LARGEST:
        half = float(np.std(values, ddof=1)) / np.sqrt(len(values))
        half *= float(t.ppf(0.5 + CONFIDENCE / 2, len(values) - 1))
        return float(np.mean(values)) - half, float(np.mean(values)) + half
    found = bootstrap(
        (values,),
        np.mean,
        n_resamples=RESAMPLES,
        batch=max(1, BLOCK // len(values)),
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(0),  # the same campaigns have the same interval
    ).confidence_interval
    return float(found.low), float(found.high)
