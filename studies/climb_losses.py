# Copyright 2026 ahv developers, Apache-2.0
"""Why vehicles lose their inlet in a climb to 27 km: what level flight takes of them up there.

`python -m studies.climb_losses` flies 1000 vehicles up the profile `climb_mach` and compares the
angle of attack of their level trim at 27 km, the Mach number as it was. docs/guidance.md has it.
"""

import numpy as np

from ahv_analysis.campaign.batch import find_trims
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.flight.case import load_case
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import DEGREES
from studies.results import fly_parts

CASE, PROFILE, LEVEL, RUNS, SEED = "neuro_adaptive_sc_gdi", "climb_mach", 0.2, 1000, 2026
TOP = 27_000.0  # [m]
BURNT = 20_000.0  # [kg] of fuel when the climb ends


def main() -> None:
    """Print the trims of those that are kept and of those that are lost."""
    case = load_case(CASE, hardware="typical", profile=PROFILE)
    campaign = Campaign(case, LEVEL, RUNS, SEED)
    lost = np.concatenate([part["cause"] for part in fly_parts(campaign)]) != 0
    start, truth = case.plant.initial, case.plant.truth
    mach = case.control.speed / atmosphere(24_000.0, False).sound_speed
    speed = mach * atmosphere(TOP, False).sound_speed
    dispersions = np.array([campaign.dispersion(run) for run in range(RUNS)])
    alpha = find_trims(dispersions, TOP, speed, start.mass - BURNT, truth)[:, 0] * DEGREES
    for name, these in (("kept", alpha[~lost]), ("lost", alpha[lost])):
        print(
            f"{len(these)} {name}: level flight at 27 km takes {these.min():.2f} to "
            f"{these.max():.2f} deg, {np.median(these):.2f} in the median; "
            f"more than 5 deg of {np.sum(these > 5.0)}"
        )


if __name__ == "__main__":
    main()
