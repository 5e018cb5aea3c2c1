# Copyright 2026 ahv developers, Apache-2.0
"""The studies behind docs/results.md: `python -m studies.results`.

What the cautious start of a protected flight is worth, which vehicles full elevons do not save,
and what other readings of the report's chapter 5 give.
"""

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.campaign import RUNS_PER_JOB, Campaign, fly_runs
from ahv_analysis.campaign.store import Columns
from ahv_analysis.campaign.summary import exact_interval
from ahv_analysis.campaign.table import CONTROLLERS, REPORT
from ahv_analysis.flight.case import Case, load_case, make_case
from ahv_analysis.flight.library import fly
from ahv_control.flight_control import NEUTRAL
from ahv_control.flight_control import start as start_law
from ahv_plant.dispersion import Dispersion, Truth
from ahv_plant.model.constants import (
    DEGREES,
    STEP,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    UNSTART_ALPHA,
)
from ahv_plant.model.vectors import Measurement, State, Surfaces
from ahv_plant.numerics.elementary import atan
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.vehicle import vehicle_step
from studies.adaptive_law import row

SEED = 2017
LEVEL, RUNS = 0.5, 3873  # of the protection; as many as the report flew at 40 %
FULL_NOSE_DOWN = Surfaces(SURFACE_MINIMUM, SURFACE_MINIMUM, 0.0)
LONGEST = 3000  # steps in which a nose comes down, if it does
STARTS_FLOWN = 1000  # of section 3.5.2's random starts
STARTED = (0.0, 0.3)  # levels of dispersion for these

Triple = tuple[float, float, float]  # of P, Q, R

FASTER = dict.fromkeys(("k_ap_P", "k_ap_Q", "k_ap_R"), 50.0)  # [1/s]
STARTS: dict[str, Mapping[str, Mapping[str, object]]] = {
    f"d_0 = {first:g} deg/s^2": {"disturbance_learner": {"first_estimate": first}}
    for first in (0.0, 10.0, 20.0, 30.0, 40.0, 60.0)
} | {
    "d_0 = 0, gamma = 2000, k_ap = 50": {
        "disturbance_learner": {"first_estimate": 0.0, "gamma": 2000.0} | FASTER,
        "inner_loop": FASTER,
    }
}


def fly_parts(campaign: Campaign) -> Iterator[Columns]:
    """Fly a campaign on all cores, keeping nothing: its columns job by job."""

    def job(first: int) -> Columns:
        return fly_runs(campaign, first, min(RUNS_PER_JOB, campaign.runs - first))

    with ThreadPoolExecutor() as pool:
        yield from pool.map(job, range(0, campaign.runs, RUNS_PER_JOB))


def failed_runs(campaign: Campaign) -> set[int]:
    """Runs of a campaign that fail."""
    parts = fly_parts(campaign)
    return {run for part in parts for run in part["run"][part["cause"] != 0].tolist()}


@kernel
def nose_comes_down(state: State, truth: Truth, before: Surfaces, delay: int) -> bool:
    """Whether alpha falls below zero before it passes 5 deg, with all that there is against it.

    That is full thrust, and elevons at their stop from the step `delay` on; until then surfaces
    stay as `before`. A vehicle of which it is not true without delay is beyond its elevons.
    """
    for step in range(LONGEST):
        surfaces = before if step < delay else FULL_NOSE_DOWN
        state = vehicle_step(state, surfaces, THROTTLE_MAXIMUM, step * STEP, truth)
        alpha = atan(state.w / state.u)
        if alpha > UNSTART_ALPHA:
            return False
        if alpha < 0.0:
            return True
    return False


def beyond_elevons(campaign: Campaign, delay: int) -> set[int]:
    """Runs on vehicles that their elevons cannot save after a delay [steps] in level trim."""
    start, control = campaign.case.plant.initial, campaign.case.control
    _, commands = start_law(Measurement(start, NEUTRAL), None, control)
    truths = [Truth(dispersion=campaign.dispersion(run)) for run in range(campaign.runs)]
    return {
        run
        for run, truth in enumerate(truths)
        if not nose_comes_down(start, truth, commands.surfaces, delay)
    }


def study_protection() -> None:
    """First estimates of the cautious start, and the vehicles beyond their elevons."""
    case = load_case("neuro_adaptive_sc_gdi_protected")
    campaign = Campaign(case, LEVEL, RUNS, SEED)
    print(f"\n{RUNS} vehicles at {LEVEL:.0%}, seed {SEED}: how long elevons may wait\n")
    row("elevons full nose down from s", "vehicles that pass 5 deg")
    row(*["---"] * 2)
    for delay in (0, 1, 2, 5, 10, 20, 50):
        row(delay * STEP, len(beyond_elevons(campaign, delay)))
    beyond = beyond_elevons(campaign, 0)
    print("\nThe cautious start:\n")
    row("start", "lost", "of these beyond their elevons", "nominal: alpha deg", "h m")
    row(*["---"] * 5)
    for name, changes in STARTS.items():
        chosen = changed(case, changes)
        lost = failed_runs(Campaign(chosen, LEVEL, RUNS, SEED))
        undispersed = {f"dispersion.{name}": 1.0 for name in Dispersion._fields}
        nominal = record_of(fly(changed(chosen, {"plant": undispersed})), False)
        alpha, h = nominal.air.alpha * DEGREES, nominal.column("h")
        row(
            name,
            len(lost),
            len(lost & beyond),
            f"{alpha.min():.2f} to {alpha.max():.2f}",
            f"{h.min():.0f} to {h.max():.0f}",
        )


def changed(case: Case, changes: Mapping[str, Mapping[str, object]]) -> Case:
    """Return the case with other parameters of some nodes."""
    nodes = case.parameters.items()
    return make_case(case.name, {node: values | changes.get(node, {}) for node, values in nodes})


def error_dynamics(
    exponent: float, k_s: Triple, k: Triple, k_ad: Triple = (5.0, 7.0, 5.0)
) -> dict[str, dict[str, object]]:
    """Parameters of eq 5.11, taken by the letter: its gains k and k_ad, k_s in rad/s."""

    def gains(prefix: str, values: Triple) -> dict[str, object]:
        scaled = (a * b ** (2.0 - 2.0 * exponent) for a, b in zip(values, k_s, strict=True))
        return {f"{prefix}_{axis}": gain for axis, gain in zip("PQR", scaled, strict=True)}

    bounds = {f"k_s_{axis}": b * DEGREES for axis, b in zip("PQR", k_s, strict=True)}
    tracking = {"lambda": exponent} | bounds | gains("k", k)
    return {
        "inner_loop": tracking | gains("k_ad", k_ad),
        "disturbance_learner": tracking,
    }


def attitude_gain(k: float) -> dict[str, dict[str, object]]:
    """Parameters of the intermediate loop [1/s]."""
    return {"outer_intermediate": dict.fromkeys(("k_phi", "k_theta", "k_psi"), k)}


PRINTED: Triple = (0.1, 0.3, 0.1)  # k_s, taken in rad/s
TWO: Triple = (2.0, 2.0, 2.0)  # k, as printed
READINGS: dict[str, Mapping[str, Mapping[str, object]]] = {
    "as built: lambda 1.5, K 2, 10, 2": {},
    "K 2, 6.67, 2, in pitch by the letter": error_dynamics(1.5, PRINTED, (0.2, 2.0, 0.2)),
    "K 2, 20, 2": error_dynamics(1.5, PRINTED, (0.2, 6.0, 0.2)),
    "lambda 1: dynamic inversion, K 2": error_dynamics(1.0, PRINTED, TWO),
    "lambda 1, K 50": error_dynamics(1.0, PRINTED, (50.0, 50.0, 50.0)),
    "K 20, 6.67, 20, by the letter": error_dynamics(1.5, PRINTED, TWO),
    "lambda 0.001, k_s in rad/s": error_dynamics(0.001, PRINTED, TWO),
    "the same, k in eq 5.14 too": error_dynamics(0.001, PRINTED, TWO, TWO),
    "k_u 0.01, as in section 3.5.2": {"velocity": {"k_u": 0.01}},
    "k_phi, k_theta, k_psi 0.2, as there": attitude_gain(0.2),
    "rates regulated to zero, section 5.1": attitude_gain(0.0),
}
MANY = range(1, 6)  # seeds of a count that chance has less part in


def succeeded(campaign: Campaign) -> Columns:
    """Columns of the runs of a campaign, with whether each was a success."""
    parts = list(fly_parts(campaign))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return columns | {"success": columns["cause"] == 0}


def study_readings() -> None:
    """Readings of section 5.2 at the report's numbers of trials, and from random starts."""
    levels = [reported for reported in REPORT if reported.level in (0.3, 0.4)]
    names = [f"success at {reported.level:.0%}, %" for reported in levels]
    starts = [f"of {STARTS_FLOWN} random starts at {level:.0%}, lost" for level in STARTED]
    print(f"\nReadings of SC-GDI, seed {SEED}; |h - h*| at the end, of the successes at 40 %\n")
    row("reading", *names, "95 % within m", *starts)
    row(*["---"] * (len(levels) + 4))
    built = load_case("neuro_adaptive_sc_gdi")
    cases = {name: changed(built, changes) for name, changes in READINGS.items()}
    cases["lambda 0.001, k_s in deg/s"] = load_case("neuro_adaptive_sc_gdi_literal")
    for name, case in cases.items():
        rates = []
        for reported in levels:
            flown = succeeded(Campaign(case, reported.level, reported.trials, SEED))
            rates.append(f"{100.0 * np.mean(flown['success']):.2f}")
        missed = np.abs(flown["final_altitude_m"] - case.control.outer.altitude)
        within = np.percentile(missed[flown["success"]], 95.0)
        lost = [
            len(failed_runs(Campaign(case, level, STARTS_FLOWN, SEED, random_starts=True)))
            for level in STARTED
        ]
        row(name, *rates, f"{within:.0f}", *lost)


def study_draws() -> None:
    """The report's two controllers over the draws of many seeds."""
    levels = [reported for reported in REPORT if reported.level in (0.3, 0.4)]
    names = [f"success at {reported.level:.0%}, %" for reported in levels]
    print(f"\nThe two controllers of the report over the draws of {len(MANY)} seeds\n")
    row("controller", *names)
    row(*["---"] * (len(levels) + 1))
    for controller in CONTROLLERS:
        case = load_case(controller)
        cells = []
        for reported in levels:
            campaigns = [Campaign(case, reported.level, reported.trials, seed) for seed in MANY]
            runs = len(campaigns) * reported.trials
            kept = runs - sum(len(failed_runs(campaign)) for campaign in campaigns)
            low, high = exact_interval(kept, runs)
            cells.append(f"{100 * kept / runs:.2f} [{100 * low:.2f}, {100 * high:.2f}]")
        row(controller, *cells)


def main() -> None:
    """Print all studies as Markdown tables."""
    study_protection()
    study_readings()
    study_draws()


if __name__ == "__main__":
    main()
