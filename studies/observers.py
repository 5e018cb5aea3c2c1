# Copyright 2026 ahv developers, Apache-2.0
"""Which surfaces the learner's observer hears, and what that is worth: a table in docs/results.md.

`python -m studies.observers` flies Table 5.1's vehicles at 30 and 40 % on typical hardware, with
surfaces as commanded, by the law's own model of the servos, which may be wrong, and as measured.
"""

from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.campaign.summary import exact_interval
from ahv_analysis.flight.case import load_case, make_case
from studies.adaptive_law import row
from studies.results import failed_runs

LEVELS = (0.3, 0.4)
RUNS, SEED = 3873, 2026
CASES = (
    "neuro_adaptive_di",
    "neuro_adaptive_sc_gdi",
    "neuro_adaptive_di_protected",
    "neuro_adaptive_sc_gdi_protected",
)
MODEL = {"observer_surfaces": "modelled"}
HEARD: dict[str, dict[str, object]] = {
    "commanded": {"observer_surfaces": "commanded"},
    "modelled": {**MODEL},
    "modelled, half the bandwidth": {**MODEL, "servo_model.bandwidth": 15.0},
    "modelled, twice the bandwidth": {**MODEL, "servo_model.bandwidth": 60.0},
    "modelled, half the rate limit": {**MODEL, "servo_model.rate_limit": 30.0},
    "measured": {"observer_surfaces": "measured"},
}


def kept(name: str, level: float, heard: dict[str, object]) -> str:
    """Success rate of a case at a level [-], in per cent with its interval."""
    given = load_case(name, hardware="typical").parameters
    learner = given["disturbance_learner"] | heard
    case = make_case(name, given | {"disturbance_learner": learner})
    successes = RUNS - len(failed_runs(Campaign(case, level, RUNS, SEED)))
    low, high = exact_interval(successes, RUNS)
    return f"{successes / RUNS:.2%} [{low:.2%}, {high:.2%}]".replace("%", "")


def main() -> None:
    """Print the table."""
    row("controller", "level", *HEARD)
    row(*["---"] * (2 + len(HEARD)))
    for name in CASES:
        for level in LEVELS:
            row(name, f"{level:.0%}", *(kept(name, level, heard) for heard in HEARD.values()))


if __name__ == "__main__":
    main()
