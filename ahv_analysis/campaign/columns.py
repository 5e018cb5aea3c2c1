# Copyright 2026 ahv developers, Apache-2.0
"""The columns of a campaign: what each means, and how to have some of all its runs."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.campaign.draws import checked_draws
from ahv_analysis.campaign.store import Columns, level_folder, read_parts
from ahv_analysis.errors import CampaignError
from ahv_analysis.flight.outcome import Cause
from ahv_plant.dispersion import Dispersion
from ahv_plant.draws import draw_values

LOST = "lost"  # the verdict as a number: 1 for a lost vehicle, 0 for one that was kept


class Column(NamedTuple):
    """What a column holds."""

    unit: str
    meaning: str


COLUMNS = {
    "run": Column("", "number of the run; with level and seed it draws the vehicle again"),
    "CL": Column("-", "multiplier of the lift coefficient"),
    "CD": Column("-", "multiplier of the drag coefficient"),
    "CY": Column("-", "multiplier of the side force coefficient"),
    "Cl": Column("-", "multiplier of the rolling moment coefficient"),
    "Cm": Column("-", "multiplier of the pitching moment coefficient"),
    "Cn": Column("-", "multiplier of the yawing moment coefficient"),
    "Ixx": Column("-", "multiplier of the moment of inertia in roll"),
    "Iyy": Column("-", "multiplier of the moment of inertia in pitch"),
    "Izz": Column("-", "multiplier of the moment of inertia in yaw"),
    "initial_u": Column("m/s", "forward speed at the start"),
    "initial_P": Column("rad/s", "roll rate at the start"),
    "initial_Q": Column("rad/s", "pitch rate at the start"),
    "initial_R": Column("rad/s", "yaw rate at the start"),
    "initial_h": Column("m", "altitude at the start"),
    "cause": Column(
        "",
        "why the run failed: "
        + ", ".join(f"{cause.value} {cause.name.lower().replace('_', ' ')}" for cause in Cause),
    ),
    "time_s": Column("s", "flown before the failure, or to the end"),
    "max_abs_alpha_deg": Column("deg", "largest angle of attack, that of the failure with it"),
    "alpha_margin_deg": Column("deg", "5 deg less the largest angle of attack"),
    "max_abs_beta_deg": Column("deg", "largest angle of sideslip"),
    "max_abs_rate_dps": Column("deg/s", "largest of the three body rates"),
    "max_abs_phi_deg": Column("deg", "largest bank angle"),
    "min_surface_deg": Column("deg", "least of the three surface commands"),
    "max_surface_deg": Column("deg", "largest of the three surface commands"),
    "min_throttle": Column("-", "least throttle command"),
    "max_throttle": Column("-", "largest throttle command"),
    "max_altitude_error_m": Column("m", "largest distance from the commanded altitude"),
    "max_observer_error_dps": Column("deg/s", "largest X - X_a of the learner, 0 without one"),
    "final_altitude_m": Column("m", "altitude at the end, or at the last state before failure"),
    "final_speed_mps": Column("m/s", "forward speed u there"),
    "rms_altitude_error_m": Column("m", "root mean square of altitude less that to follow"),
    "final_altitude_error_m": Column("m", "altitude less that to follow, at the end"),
    "rms_speed_error_mps": Column("m/s", "root mean square of u less that to follow"),
    "max_speed_error_mps": Column("m/s", "largest distance from the speed to follow"),
    "max_heading_error_deg": Column("deg", "largest angle to the heading to follow"),
    "fuel_kg": Column("kg", "fuel burnt"),
    "least_mach": Column("-", "least Mach number; below 4 the model of the vehicle does not hold"),
    "outside_corridor_s": Column("s", "time outside the corridor, 0 without one"),
    "nose_down_alpha_deg": Column(
        "deg",
        "largest angle of attack with full nose-down from the start; above 5: beyond saving",
    ),
    "trim_exists": Column("", "whether there is a level trim at the commanded altitude and speed"),
    "trim_alpha_deg": Column("deg", "angle of attack of that trim"),
}
DRAWN = (*Dispersion._fields, *(name for name in COLUMNS if name.startswith("initial_")))
IDENTIFYING = ("run", "cause", *DRAWN)  # what is no metric


def label(name: str) -> str:
    """Name of a column with its unit, for an axis."""
    if name == LOST:
        return "lost [-]"
    unit = COLUMNS[name].unit if name in COLUMNS else ""
    for ending in ("_deg", "_dps", "_m", "_s", "_mps"):
        name = name.removesuffix(ending)
    words = name.replace("max_abs_alpha", "max |alpha|").replace("max_abs_beta", "max |beta|")
    return f"{words.replace('_', ' ')} [{unit}]" if unit else words.replace("_", " ")


def read_columns(campaign: Campaign, folder: Path, names: Sequence[str] | None = None) -> Columns:
    """Columns `names`, or all, of every run that `folder` holds of `campaign`, sorted by run.

    Raises CampaignError for a folder that is damaged, or has no such column.
    """
    runs = level_folder(folder, campaign.level)
    parts = list(read_parts(runs, names or ()))
    if not parts:
        raise CampaignError(f"{runs} holds no runs of a campaign")
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def is_lost(columns: Columns) -> Array:
    """Whether each run was lost (N,)."""
    lost: Array = columns["cause"] != Cause.SUCCESS
    return lost


def quantity(columns: Columns, name: str) -> Array:
    """A column (N,) as numbers, or the verdict; CampaignError if there is none of this name."""
    if name == LOST:
        return is_lost(columns).astype(float)
    if name not in columns:
        raise CampaignError(
            f"the campaign has no column {name!r}; valid are {LOST}, {', '.join(columns)}"
        )
    return columns[name].astype(float)


def factors(campaign: Campaign, columns: Columns) -> dict[str, Array]:
    """What was drawn for the runs: (N,) each, those that do not vary left out.

    What a file of distributions draws is no column, and is drawn again here.
    """
    found = {name: columns[name] for name in DRAWN}
    if campaign.draws is not None:
        drawn = checked_draws(campaign.draws)
        rows = [draw_values(drawn, campaign.seed, run) for run in columns["run"].tolist()]
        found |= {
            name: np.array([float(row[name]) for row in rows])
            for name in rows[0]
            if name.removeprefix("dispersion.") not in found
        }
    return {name: values for name, values in found.items() if np.ptp(values) > 0.0}
