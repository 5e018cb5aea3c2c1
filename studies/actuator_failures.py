# Copyright 2026 ahv developers, Apache-2.0
"""What the laws do when an actuator fails: the table in docs/results.md.

`python -m studies.actuator_failures` flies the nominal vehicle on typical hardware; one control
fails after 20 s of level flight.
"""

from ahv_analysis.campaign.batch import fly_alone
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.outcome import Cause
from ahv_plant.hardware.actuator_parameters import FAILURES
from ahv_plant.model.constants import DEGREES, STEP

CASES = ("nominal_di", "neuro_adaptive_sc_gdi")
CONTROLS = ("right_elevon", "rudder", "throttle")


def outcome(case: str, control: str, failure: str) -> str:
    """What a flight comes to, in words."""
    plant: dict[str, object] = {f"failure.{control}": failure, "failure.time": 20.0}
    plant |= {f"dispersion.{name}": 1.0 for name in ("CL", "CD", "CY", "Cl", "Cm", "Cn")}
    plant |= {f"dispersion.{name}": 1.0 for name in ("Ixx", "Iyy", "Izz")}
    found = fly_alone(load_case(case, plant, hardware="typical"))
    alpha = found.max_abs_alpha * DEGREES
    if found.cause == Cause.SUCCESS:
        return f"kept, alpha to {alpha:.2f} deg"
    words = Cause(int(found.cause)).name.lower().replace("_", " ")
    return f"{words} after {found.steps * STEP - 20.0:.2f} s"


def main() -> None:
    """Print the table."""
    print(f"| fails | how | {' | '.join(CASES)} |")
    print(f"|---|---|{'---|' * len(CASES)}")
    for control in CONTROLS:
        for failure in FAILURES[1:]:
            cells = (outcome(case, control, failure) for case in CASES)
            print(
                f"| {control.replace('_', ' ')} | {failure.replace('_', ' ')} "
                f"| {' | '.join(cells)} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
