# Copyright 2026 ahv developers, Apache-2.0
"""Why vehicles are lost on typical hardware that full nose-down would have kept.

`python -m studies.hardware_losses` flies the protected law at 40 and 50 %, picks the losses that
are not beyond saving, and flies each of them again with one thing changed at a time: what the
hardware is, what the law hears, what the noise is, and what full nose-down is. docs/results.md
names the causes.
"""

from collections.abc import Mapping

import numpy as np

from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.flight.case import Case, load_case, make_case
from ahv_analysis.flight.outcome import Cause
from ahv_plant.model.constants import (
    DEGREES,
    RADIANS,
    STEP,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    UNSTART_ALPHA,
)
from ahv_plant.model.vectors import Controls, Surfaces
from ahv_plant.numerics.elementary import atan2
from ahv_plant.plant_flight import PlantFlight
from studies.adaptive_law import row
from studies.results import fly_parts

CASE, RUNS, SEED, LEVELS = "neuro_adaptive_sc_gdi_protected", 3873, 2026, (0.4, 0.5)
NOISES = 32  # other draws of the noise, for the same vehicle
LONGEST = 400  # steps in which a nose comes down, if it does

Changes = Mapping[str, Mapping[str, object]]  # parameters by node


def of_servos(part: str, value: float) -> Changes:
    """One parameter of the servos of all surfaces."""
    return {"plant": {f"actuator.{name}.{part}": value for name in ("elevons", "rudder")}}


QUIET: Changes = {
    "plant": {f"sensor.{name}.noise": 0.0 for name in ("P", "Q", "R", "phi", "theta", "psi")}
}
CHANGED: Mapping[str, Changes] = {
    "as flown": {},
    "no noise": QUIET,
    "no delay": {"plant": {"latency.delay": 0.0}},
    "servos of 60 rad/s": of_servos("bandwidth", 60.0),
    "servos of 90 deg/s": of_servos("rate_limit", 90.0),
    "no cautious start": {"disturbance_learner": {"first_estimate": 0.0}},
    "observer hears commands": {"disturbance_learner": {"observer_surfaces": "commanded"}},
}


def changed(case: Case, changes: Changes) -> Case:
    """Return the case with other parameters of some nodes."""
    nodes = case.parameters.items()
    return make_case(case.name, {node: values | changes.get(node, {}) for node, values in nodes})


def told(case: Case) -> str:
    """What a flight comes to, in words."""
    found = fly_alone(case)
    alpha = found.max_abs_alpha * DEGREES
    if found.cause == Cause.SUCCESS:
        return f"kept, alpha to {alpha:.2f} deg"
    return f"lost after {(found.steps - 1) * STEP:.2f} s"


def nose_down(case: Case, late: int = 0, throttle: float = THROTTLE_MAXIMUM, roll: float = 0.0):
    """Largest alpha and sideslip [deg] at full nose-down, until the nose is down.

    The elevons are told `late` steps later, the `throttle` is another, the vehicle rolls by `roll`
    [deg/s] at the start; the rudder stays. Without these it is the bound of docs/results.md.
    """
    plant = case.plant
    start = plant.initial._replace(P=roll * RADIANS)
    flight = PlantFlight(plant._replace(initial=start))
    now, alphas, betas = flight.start, [], []
    assert plant.hardware is not None
    before = Controls(plant.hardware.start.surfaces, throttle)
    full = Controls(Surfaces(SURFACE_MINIMUM, SURFACE_MINIMUM, 0.0), throttle)
    for number in range(LONGEST):
        alphas.append(atan2(now.state.w, now.state.u))
        betas.append(abs(atan2(now.state.v, now.state.u)))
        if alphas[-1] < 0.0 or alphas[-1] > UNSTART_ALPHA:
            break
        now = flight.later(now, before if number < late else full, number)
    return max(alphas) * DEGREES, max(betas) * DEGREES


def lost_though_saveable(campaign: Campaign) -> tuple[int, list[int]]:
    """Number of the lost, and those of them that full nose-down would have kept."""
    parts = list(fly_parts(campaign))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    lost = columns["cause"] != 0
    beyond = columns["nose_down_alpha_deg"] > UNSTART_ALPHA * DEGREES
    return int(np.sum(lost)), columns["run"][lost & ~beyond].tolist()


def study(campaign: Campaign, run: int) -> None:
    """All that is changed for one vehicle."""
    case = campaign.case_of(run)
    print(f"\nRun {run} at {campaign.level:.0%}, seed {campaign.seed}\n")
    row("changed", "what comes of it")
    row("---", "---")
    for name, changes in CHANGED.items():
        row(name, told(changed(case, changes)))
    noises = [changed(case, {"plant": {"noise.run": RUNS + i}}) for i in range(NOISES)]
    kept = sum(fly_alone(one).cause == Cause.SUCCESS for one in noises)
    row(f"{NOISES} other draws of the noise", f"kept in {kept}")
    full: Mapping[str, Mapping[str, float]] = {
        "full nose-down": {},
        "the same, the elevons told 10 ms later": {"late": 1},
        "the same, 20 ms later": {"late": 2},
        "full nose-down with the throttle at 0.4": {"throttle": 0.4},
        "full nose-down from a roll of 0.1 deg/s": {"roll": 0.1},
        "the same, of 0.5 deg/s": {"roll": 0.5},
    }
    for name, given in full.items():
        alpha, beta = nose_down(case, **given)  # type: ignore[arg-type]  # late is whole
        row(name, f"alpha to {alpha:.3f} deg, sideslip to {beta:.2f} deg")


def main() -> None:
    """Print what is lost, and the table of each vehicle that need not be."""
    case = load_case(CASE, hardware="typical")
    for level in LEVELS:
        campaign = Campaign(case, level, RUNS, SEED)
        lost, runs = lost_though_saveable(campaign)
        print(f"\n{level:.0%}: {lost} of {RUNS} lost; of these full nose-down keeps {len(runs)}")
        for run in runs:
            study(campaign, run)


if __name__ == "__main__":
    main()
