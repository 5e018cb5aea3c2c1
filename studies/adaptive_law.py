# Copyright 2026 ahv developers, Apache-2.0
"""The studies behind the adaptive law: `python -m studies.adaptive_law`.

Flights of the section 4.3 start, and of one disturbed in all axes, on drawn vehicles; what is
counted is the barrier's doing, the loss of vehicles, and how well rates follow the desired plant.
"""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
from matplotlib import pyplot

from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.closed_loop import Loop, loop_step, start_loop
from ahv_analysis.flight.library import fly
from ahv_analysis.report.figures import STYLE
from ahv_control.disturbance_learner import (
    LearnerSettings,
    LearnerState,
    add_scaled,
    disturbance_estimate,
    learning_direction,
)
from ahv_control.error_dynamics import ErrorDynamics, error_decay
from ahv_control.flight_control import (
    FlightControl,
    Memory,
    answer,
)
from ahv_control.newton_raphson import nominal_response
from ahv_plant.dispersion import (
    Dispersion,
    Truth,
    disturbance_acceleration,
    draw_dispersion,
)
from ahv_plant.model.constants import DEGREES, RADIANS, STEP, UNSTART_ALPHA
from ahv_plant.model.vectors import Rates, State
from ahv_plant.numerics.elementary import atan
from ahv_plant.termination import termination

SEED = 20
RUNS = 200
STEPS = 15000
# The run of the fixed draw on which the explicit step explodes.
HARD = Dispersion(1.393, 0.623, 0.841, 1.367, 0.612, 0.729, 0.771, 0.669, 0.978)


class Score(NamedTuple):
    """What became of one flight."""

    steps: int  # flown before |alpha| > 5 deg, a termination of the flight, or its end
    largest_error: float  # [deg/s] largest |X - X_a| of any channel
    following: float  # [deg/s] root mean square of X - X_d
    roughness: float  # [deg] mean change of a surface per step


@numba.njit(error_model="numpy")
def explicit_step(loop: Loop, settings: LearnerSettings) -> LearnerState:
    """Learner one step later by explicit Euler, the obvious way and the wrong one."""
    learner, before, answered = loop.memory.learner, loop.plant.state, loop.commands
    rates = Rates(before.P, before.Q, before.R)
    response = nominal_response(before, answered.surfaces, settings.geometric)
    estimate = disturbance_estimate(learner, rates)
    P, Q, R = before.P * DEGREES, before.Q * DEGREES, before.R * DEGREES
    direction = learning_direction(P, Q, R, settings.gamma, settings.theta)
    a, d, k, b = learner.X_a, learner.X_d, settings.k_ap, settings.k_b
    e_P, e_Q, e_R = P - a.P * DEGREES, Q - a.Q * DEGREES, R - a.R * DEGREES
    fall = error_decay(d, answered.rates, settings.tracking)
    return LearnerState(
        Rates(
            a.P + STEP * (response.P + estimate.P + k.P * e_P * RADIANS),
            a.Q + STEP * (response.Q + estimate.Q + k.Q * e_Q * RADIANS),
            a.R + STEP * (response.R + estimate.R + k.R * e_R * RADIANS),
        ),
        Rates(d.P + STEP * fall.P, d.Q + STEP * fall.Q, d.R + STEP * fall.R),
        add_scaled(learner.W_P, STEP * e_P / (b * b - e_P * e_P), direction),
        add_scaled(learner.W_Q, STEP * e_Q / (b * b - e_Q * e_Q), direction),
        add_scaled(learner.W_R, STEP * e_R / (b * b - e_R * e_R), direction),
        learner.servos,
    )


@numba.njit(error_model="numpy", nogil=True)
def fly_study(
    state: State, settings: FlightControl, truth: Truth, explicit: bool, steps: int
) -> tuple[int, float, float, float]:
    """Fly until the end or the loss of the vehicle; sums for `Score`."""
    loop = start_loop(state, truth, settings, None, None)
    largest, follow, rough = 0.0, 0.0, 0.0
    for number in range(steps):
        state, before = loop.plant.state, loop.commands.surfaces
        alpha = abs(atan(state.w / state.u))
        if not alpha <= UNSTART_ALPHA or termination(state, truth.geometric) != 0:
            return number, largest, follow, rough
        later = loop_step(loop, number, truth, settings, None, None)
        if explicit:
            learner = explicit_step(loop, settings.learner)
            memory = Memory(learner, later.memory.integral)
            commands = answer(later.plant.state, None, memory, before, settings)
            later = Loop(later.plant, memory, commands, later.route, later.reference)
        loop = later
        state, learner, now = loop.plant.state, loop.memory.learner, loop.commands.surfaces
        a, d = learner.X_a, learner.X_d
        e = max(abs(state.P - a.P), abs(state.Q - a.Q), abs(state.R - a.R))
        largest = max(largest, e)
        P, Q, R = state.P - d.P, state.Q - d.Q, state.R - d.R
        follow += P * P + Q * Q + R * R
        rough += (
            abs(now.right_elevon - before.right_elevon)
            + abs(now.left_elevon - before.left_elevon)
            + abs(now.rudder - before.rudder)
        )
    return steps, largest, follow, rough


def score(
    state: State, settings: FlightControl, truth: Truth, explicit: bool = False, steps: int = STEPS
) -> Score:
    """Fly one flight of a study."""
    flown, largest, follow, rough = fly_study(state, settings, truth, explicit, steps)
    count = max(flown, 1)
    return Score(
        flown,
        largest * DEGREES,
        (follow / count) ** 0.5 * DEGREES,
        rough / (3 * count) * DEGREES,
    )


def scores(
    state: State,
    settings: FlightControl,
    level: float,
    runs: int,
    explicit: bool = False,
    steps: int = STEPS,
) -> list[Score]:
    """Fly drawn vehicles, on all cores."""

    def one(run: int) -> Score:
        truth = Truth(dispersion=draw_dispersion(level, SEED, run))
        return score(state, settings, truth, explicit, steps)

    with ThreadPoolExecutor() as pool:
        return list(pool.map(one, range(runs)))


def median(values: Iterable[float]) -> float:
    """Middle value."""
    ordered = sorted(values)
    return ordered[len(ordered) // 2]


def with_exponent(settings: FlightControl, exponent: float, bound: float) -> FlightControl:
    """Settings with another lambda and k_s [deg/s]."""

    def change(dynamics: ErrorDynamics) -> ErrorDynamics:
        k_s = Rates(*[bound * RADIANS] * 3)
        return dynamics._replace(exponent=exponent, bound=k_s)

    inner, learner = settings.inner, settings.learner
    assert learner is not None
    return settings._replace(
        inner=inner._replace(tracking=change(inner.tracking), following=change(inner.following)),
        learner=learner._replace(tracking=change(learner.tracking)),
    )


def with_theta(settings: FlightControl, theta: float) -> FlightControl:
    """Settings with another weight of the Jacobian's error."""
    assert settings.learner is not None
    return settings._replace(learner=settings.learner._replace(theta=theta))


def row(*cells: object) -> None:
    """Print a row of a Markdown table."""
    shown = (f"{cell:.3g}" if isinstance(cell, float) else str(cell) for cell in cells)
    print(f"| {' | '.join(shown)} |")


def study_barrier(state: State, settings: FlightControl, levels: Sequence[float]) -> None:
    """Explicit against implicit weight update."""
    print(f"\nBarrier: {RUNS} vehicles a level, seed {SEED}\n")
    row("level", "step", "within 5 deg", "beyond k_b", "largest error in k_b")
    row(*["---"] * 5)
    k_b = settings.learner.k_b
    for level in levels:
        for explicit in (True, False):
            found = scores(state, settings, level, RUNS, explicit)
            row(
                level,
                "explicit" if explicit else "implicit",
                sum(flight.steps == STEPS for flight in found),
                sum(flight.largest_error >= k_b for flight in found),
                max(flight.largest_error for flight in found) / k_b,
            )
    print("\nThe hard vehicle:\n")
    row("step", "flown s", "largest error in k_b")
    row(*["---"] * 3)
    for explicit in (True, False):
        flight = score(state, settings, Truth(dispersion=HARD), explicit)
        row(
            "explicit" if explicit else "implicit", flight.steps * STEP, flight.largest_error / k_b
        )


def study_settings(
    title: str, start: State, choices: Iterable[tuple[tuple[object, ...], FlightControl]]
) -> None:
    """Compare settings on vehicles dispersed by 40 %: whole flights, and 20 s closely."""
    print(f"\n{title}: {RUNS} vehicles at 40 %, seed {SEED}\n")
    for number, (names, settings) in enumerate(choices):
        if number == 0:
            row(*names, "within 5 deg", "X - X_d deg/s", "surface deg/step")
            row(*["---"] * (len(names) + 3))
            continue
        whole = scores(load_case("neuro_adaptive_di").plant.initial, settings, 0.4, RUNS)
        close = scores(start, settings, 0.4, RUNS, steps=2000)
        row(
            *names,
            sum(flight.steps == STEPS for flight in whole),
            median(flight.following for flight in close),
            median(flight.roughness for flight in close),
        )


KINDS = {
    "constant": {"disturbance.Q.constant": 1.0},
    "sine": {"disturbance.Q.amplitude": 1.0, "disturbance.Q.frequency": 0.5},
    "state-dependent": {
        "disturbance.Q.constant": 0.3,
        "disturbance.Q.Q": -0.8,
        "disturbance.Q.Q2": 0.3,
    },
}


def draw_learning(path: Path) -> None:
    """Draw d-hat beside the true d(t, X) of the pitch channel, and its error, in flight."""
    undispersed = {f"dispersion.{name}": 1.0 for name in Dispersion._fields}
    start = {"initial.Q": 3.0, "duration": 20.0}
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(2, len(KINDS), sharex=True, figsize=(9.6, 4.2))
        for column, (kind, changes) in zip(axes.T, KINDS.items(), strict=True):
            case = load_case("neuro_adaptive_di", undispersed | start | changes)
            flight = record_of(fly(case), False)
            assert flight.estimates is not None
            rates = flight.states[:, 3:6]
            true = [
                disturbance_acceleration(case.plant.truth.disturbance, time, *rate)[1]
                for time, rate in zip(flight.time.tolist(), rates.tolist(), strict=True)
            ]
            estimate, actual = flight.estimates[:, 1] * DEGREES, np.array(true) * DEGREES
            column[0].plot(flight.time, actual, color="0.55", label="$d$")
            column[0].plot(flight.time, estimate, color="C0", label=r"$\hat d$")
            column[0].set_title(kind, fontsize=9)
            column[1].plot(flight.time, estimate - actual, color="C3")
            column[1].set_ylim(-0.3, 0.3)
            column[1].set_xlabel("time [s]")
        axes[0, 0].set_ylabel("disturbance [deg/s$^2$]")
        axes[1, 0].set_ylabel(r"$\hat d - d$ [deg/s$^2$]")
        axes[0, 0].legend(frameon=False)
        figure.tight_layout()
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=120)
        pyplot.close(figure)


def main() -> None:
    """Draw the learning and print all studies as Markdown tables."""
    draw_learning(Path("docs/figures/learning.png"))
    case = load_case("neuro_adaptive_di")
    settings, start = case.control, case.plant.initial
    study_barrier(start, settings, (0.3, 0.4, 0.5))
    tilted = start._replace(P=3 * RADIANS, Q=2 * RADIANS, R=-3 * RADIANS)
    study_settings(
        "Exponent and bound",
        tilted,
        [(("lambda", "k_s deg/s"), settings)]
        + [
            ((exponent, bound), with_exponent(settings, exponent, bound))
            for exponent in (0.001, 0.5, 1.0, 1.5, 2.0)
            for bound in (1.0, 2.0, 5.0, 10.0)
        ],
    )
    study_settings(
        "Weight of the Jacobian",
        tilted,
        [(("theta s^2",), settings)]
        + [((theta,), with_theta(settings, theta)) for theta in (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)],
    )


if __name__ == "__main__":
    main()
