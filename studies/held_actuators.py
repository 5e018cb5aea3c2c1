# Copyright 2026 ahv developers, Apache-2.0
"""What half a step of lag is worth: actuators that move before a step, and are held over it.

`python -m studies.held_actuators` flies 500 vehicles of seed 2026 on hardware as `typical`, whose
actuators do not move within the Runge-Kutta step, but before it. docs/hardware.md compares them.
"""

from concurrent.futures import ThreadPoolExecutor
from math import exp

import numpy as np

from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.flight.case import load_case, make_case
from ahv_control.flight_control import NEUTRAL
from ahv_control.flight_control import start as start_law
from ahv_control.flight_control import step as step_law
from ahv_plant.dispersion import Truth
from ahv_plant.hardware.noise import draws_of
from ahv_plant.model.constants import RADIANS, STEP, UNSTART_ALPHA
from ahv_plant.model.vectors import Measurement, State, Surfaces, clamp, limit_throttle
from ahv_plant.numerics.elementary import atan2
from ahv_plant.numerics.elementwise import elementwise, kernel
from ahv_plant.plant import noise_stream
from ahv_plant.termination import termination
from ahv_plant.vehicle import vehicle_step
from studies.adaptive_law import row

RUNS, SEED, STEPS = 500, 2026, 15_000
DELAY = 2  # steps
SHARE = 1.0 - exp(-30.0 * STEP)  # [-] of its way that a servo of 30 rad/s goes in a step
MOST = 60.0 * RADIANS * STEP  # [rad] a step, at 60 deg/s
SIGMA = 0.02 * RADIANS  # [rad/s], [rad] of gyroscopes and attitude
ROWS = 4  # of the line in which commands wait


@elementwise
def _noisy(s: State, n: State) -> State:
    return State(
        *(s.u, s.v, s.w),
        *(s.P + SIGMA * n.P, s.Q + SIGMA * n.Q, s.R + SIGMA * n.R),
        *(s.phi + SIGMA * n.phi, s.theta + SIGMA * n.theta, s.psi + SIGMA * n.psi),
        *(s.x, s.y, s.h, s.mass),
    )


@elementwise
def _toward(position: float, command: float) -> float:
    return position + clamp(SHARE * (command - position), -MOST, MOST)


@kernel
def is_kept(state, truth, control, block, trim):
    """Whether a vehicle keeps its inlet, from actuators at `trim` [rad]."""
    line = np.zeros((ROWS, 3))
    line[:, :2] = trim
    right, left, rudder = trim, trim, 0.0
    before = Measurement(_noisy(state, draws_of(block[0]).noise.state), NEUTRAL)
    memory, commands = start_law(before, None, control)
    for number in range(STEPS):
        alpha = atan2(state.w, state.u)
        if abs(alpha) > UNSTART_ALPHA or termination(state, truth.geometric) != 0:
            return False
        told = commands.surfaces
        row, due = number % ROWS, (number - DELAY) % ROWS
        line[row, 0], line[row, 1], line[row, 2] = told.right_elevon, told.left_elevon, told.rudder
        right, left = _toward(right, line[due, 0]), _toward(left, line[due, 1])
        rudder = _toward(rudder, line[due, 2])
        throttle = limit_throttle(commands.throttle)
        acting = Surfaces(right, left, rudder)
        state = vehicle_step(state, acting, throttle, number * STEP, truth)
        now = Measurement(_noisy(state, draws_of(block[number + 1]).noise.state), told)
        memory, commands = step_law(memory, before, commands, now, None, control)
        before = now
    return True


def kept(name: str, level: float) -> int:
    """Vehicles of a case that are kept, its observer hearing commanded surfaces."""
    case = load_case(name, hardware="typical")
    hears = case.parameters["disturbance_learner"] | {"observer_surfaces": "commanded"}
    control = make_case(name, case.parameters | {"disturbance_learner": hears}).control
    campaign, hardware = Campaign(case, level, RUNS, SEED), case.plant.hardware
    assert hardware is not None
    trim, start = hardware.start.surfaces.right_elevon, case.plant.initial

    def one(run: int) -> bool:
        block = noise_stream(hardware, None, SEED, run).block(STEPS + 1)
        truth = Truth(dispersion=campaign.dispersion(run))
        return bool(is_kept(start, truth, control, block, trim))

    with ThreadPoolExecutor() as pool:
        return sum(pool.map(one, range(RUNS)))


def main() -> None:
    """Print how many are kept."""
    row("case", "30 %", "40 %")
    row("---", "---", "---")
    for name in ("neuro_adaptive_di", "neuro_adaptive_sc_gdi_protected"):
        row(name, *(str(kept(name, level)) for level in (0.3, 0.4)))


if __name__ == "__main__":
    main()
