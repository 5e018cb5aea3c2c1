# Copyright 2026 ahv developers, Apache-2.0
"""What a campaign came to, counted part by part."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.campaign.store import Columns, level_folder, read_parts
from ahv_analysis.flight.outcome import Cause
from ahv_plant.model.aerodynamics import MACH_MINIMUM
from ahv_plant.model.constants import DEGREES, UNSTART_ALPHA

COUNTED = (
    *("run", "cause", "time_s", "nose_down_alpha_deg", "trim_exists", "trim_alpha_deg"),
    *("least_mach", "rms_altitude_error_m", "final_altitude_error_m", "rms_speed_error_mps"),
    *("fuel_kg",),
)


@dataclass
class Counts:
    """Counts of runs, and the time that they flew together."""

    causes: Counter[int] = field(default_factory=Counter)  # by Cause
    holdable: int = 0  # with a trim inside the limits at the commanded altitude
    failed_without_trim: int = 0
    beyond_saving: int = 0  # pass 5 deg though they go nose down as fast as they can
    failed_beyond_saving: int = 0
    flown_s: float = 0.0
    slow: int = 0  # successes that were below Mach 4, where the model does not hold
    tracked: list[Array] = field(default_factory=list)  # (n, 4) of the successes


def count_runs(parts: Iterable[Columns], runs: int) -> Counts:
    """Count the runs below `runs` of all `parts`, which have the columns COUNTED."""
    counts = Counts()
    for part in parts:
        asked = part["run"] < runs
        cause = part["cause"][asked]
        holdable = part["trim_exists"] & (
            np.abs(part["trim_alpha_deg"]) <= UNSTART_ALPHA * DEGREES
        )
        holdable = holdable[asked]
        counts.causes.update(cause.tolist())
        counts.holdable += int(np.sum(holdable))
        counts.failed_without_trim += int(np.sum(~holdable & (cause != Cause.SUCCESS)))
        beyond = part["nose_down_alpha_deg"][asked] > UNSTART_ALPHA * DEGREES
        counts.beyond_saving += int(np.sum(beyond))
        counts.failed_beyond_saving += int(np.sum(beyond & (cause != Cause.SUCCESS)))
        kept = cause == Cause.SUCCESS
        counts.slow += int(np.sum(kept & (part["least_mach"][asked] < MACH_MINIMUM)))
        counts.tracked.append(np.array([part[name][asked][kept] for name in COUNTED[-4:]]).T)
        counts.flown_s += float(np.sum(part["time_s"][asked]))
    return counts


def exact_interval(successes: int, runs: int) -> tuple[float, float]:
    """Clopper-Pearson 95 % interval of a success rate."""
    interval = binomtest(successes, runs).proportion_ci(method="exact")
    return float(interval.low), float(interval.high)


def _tracking(rows: Array) -> dict[str, float]:
    """How the successes (n, 4) followed their reference: medians, and what was largest."""
    altitude, final, speed, fuel = rows.T
    return {
        "median_rms_altitude_error_m": float(np.median(altitude)),
        "largest_rms_altitude_error_m": float(np.max(altitude)),
        "median_final_altitude_error_m": float(np.median(np.abs(final))),
        "largest_final_altitude_error_m": float(np.max(np.abs(final))),
        "median_rms_speed_error_mps": float(np.median(speed)),
        "largest_rms_speed_error_mps": float(np.max(speed)),
        "median_fuel_kg": float(np.median(fuel)),
    }


def summarize_campaign(campaign: Campaign, folder: Path) -> dict[str, Any]:
    """Counts of a campaign, with the bounds that no controller beats."""
    parts = read_parts(level_folder(folder, campaign.level), COUNTED, campaign.describe())
    counts = count_runs(parts, campaign.runs)
    runs, successes = counts.causes.total(), counts.causes[Cause.SUCCESS]
    failures = {
        cause.name.lower(): counts.causes[cause]
        for cause in Cause
        if cause != Cause.SUCCESS and counts.causes[cause]
    }
    return {
        "controller": campaign.case.name,
        "level": campaign.level,
        "runs": runs,
        "successes": successes,
        "success_rate": successes / runs,
        "interval": exact_interval(successes, runs),
        "failures": failures,
        "trim_within_5_deg": counts.holdable,
        "failures_without_such_trim": counts.failed_without_trim,
        "beyond_saving": counts.beyond_saving,
        "failures_beyond_saving": counts.failed_beyond_saving,
        "successes_below_mach_4": counts.slow,
        "tracking": _tracking(np.concatenate(counts.tracked)) if successes else None,
        "flown_s": counts.flown_s,
    }
