# Copyright 2026 ahv developers, Apache-2.0
"""What sideslip and bank do when the report's loops turn by sideslip, and when lift turns them.

`python -m studies.turns` flies the profile `s_turn` both ways, draws docs/figures/turns.png and
prints the numbers of docs/guidance.md. The dashed lines are no flight: they are the balance of
forces and moments at the rate at which the reference turns.
"""

from math import atan, sqrt
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from scipy.optimize import root

from ahv_analysis.bag.record import FlightRecord, record_of
from ahv_analysis.bag.rows import Array
from ahv_analysis.flight.case import Case, load_case, make_case
from ahv_analysis.flight.library import fly
from ahv_analysis.report.figures import STYLE
from ahv_control.guidance import by_time
from ahv_plant.dispersion import NOMINAL
from ahv_plant.model.constants import DEGREES, GRAVITY, STEP
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.trim import trim
from ahv_plant.vehicle import state_rate

FIGURE = Path("docs/figures/turns.png")
SETTLED = 20.0  # [s] from which on the start has no part in what is printed
EVERY = 100  # steps from point to point of what is drawn


def turning(case: Case, coordinated: bool) -> Case:
    """The case with turns that are banked, or flown by sideslip."""
    guiding = case.parameters["guidance"] | {"coordinated": coordinated}
    return make_case(case.name, case.parameters | {"guidance": guiding})


def sideslip(turn: float, altitude: float, speed: float, mass: float) -> float:
    """Sideslip angle [rad] at which the side force turns level wings by `turn` [rad/s].

    At `altitude` [m], u = `speed` [m/s] and `mass` [kg], with the surfaces that hold the moments:
    v_dot = w_dot = P_dot = Q_dot = R_dot = 0 of eqs 2.1-2.3. To first order the side force of the
    slip, q S C_Y,beta beta, is that of the turn, m V psi_dot.
    """
    level = trim(altitude, speed, mass)

    def rates(unknown: Array) -> Array:
        v, w, right, left, rudder = unknown.tolist()
        theta = atan(w / speed)  # level flight: h_dot = 0 with the wings level
        along = sqrt(speed * speed + w * w)
        state = State(
            *(speed, v, w, -turn * w / along, 0.0, turn * speed / along, 0.0, theta),
            *(0.0, 0.0, 0.0, altitude, mass),
        )
        rate = state_rate(state, Surfaces(right, left, rudder), level.throttle, 0.0, NOMINAL)
        return np.array([rate.v, rate.w, rate.P, rate.Q, rate.R])

    found = root(rates, [0.0, level.state.w, *level.surfaces], tol=1e-10)
    if not found.success:
        raise ValueError(f"no steady sideslip turns by {turn * DEGREES:g} deg/s: {found.message}")
    v, w = found.x[:2].tolist()
    return float(np.arcsin(v / np.sqrt(speed**2 + v**2 + w**2)))


def turn_rates(case: Case, record: FlightRecord) -> Array:
    """Rate [rad/s] at which the reference of a profile by time turns, of every step."""
    guidance = case.control.guidance
    assert guidance is not None
    ahead = guidance._replace(feed_forward=1.0)
    return np.array([by_time(None, n, ahead).psi_rate for n in range(len(record.stamps))])


def main() -> None:
    """Fly both, print and draw."""
    case = load_case("nominal_di", profile="s_turn")
    names = {True: "banked, tan φ* = V ψ̇* / g", False: "by sideslip, φ* = 0"}
    flights = {one: record_of(fly(turning(case, one)), False) for one in names}
    for one, record in flights.items():
        settled = slice(round(SETTLED / STEP), None)
        north, east = np.gradient(record.column("x")), np.gradient(record.column("y"))
        behind = np.arctan2(east, north) - record.column("psi")
        largest = [
            np.max(np.abs(values[settled])) * DEGREES
            for values in (record.air.beta, record.air.alpha, record.column("phi"), behind)
        ]
        print(
            f"{names[one]}: |beta| {largest[0]:.2f}, |alpha| {largest[1]:.2f}, |phi| "
            f"{largest[2]:.1f} deg at most; course and heading {largest[3]:.2f} deg apart"
        )
    turns = turn_rates(case, flights[True])
    time = flights[True].time
    slip = np.array(
        [
            sideslip(turn, h, u, mass)
            for turn, h, u, mass in zip(
                turns[::EVERY].tolist(),
                *(flights[False].column(name)[::EVERY].tolist() for name in ("h", "u", "mass")),
                strict=True,
            )
        ]
    )
    bank = np.arctan(flights[True].column("u") * turns / GRAVITY)
    print(f"by the balance of forces: |beta| {np.max(np.abs(slip)) * DEGREES:.3f} deg")
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(2, 2, sharex=True, figsize=(9.0, 5.2), layout="constrained")
        heading, banked, beta, alpha = axes.flat
        for one, color in ((True, "C0"), (False, "C3")):
            record = flights[one]
            for panel, values in (
                (heading, record.column("psi")),
                (banked, record.column("phi")),
                (beta, record.air.beta),
                (alpha, record.air.alpha),
            ):
                panel.plot(time, values * DEGREES, color=color, label=names[one])
        references = flights[True].references
        assert references is not None
        dashed = {"color": "k", "linestyle": "--", "linewidth": 1.0}
        heading.plot(time, references[:, 3] * DEGREES, label="reference ψ*", **dashed)
        banked.plot(time, bank * DEGREES, label="tan φ = V ψ̇* / g", **dashed)
        beta.plot(time[::EVERY], slip * DEGREES, label="side force = m V ψ̇*", **dashed)
        alpha.axhline(5.0, label="inlet unstart", **dashed)
        for panel, words in (
            (heading, "heading ψ [deg]"),
            (banked, "bank φ [deg]"),
            (beta, "sideslip β [deg]"),
            (alpha, "angle of attack α [deg]"),
        ):
            panel.set_ylabel(words)
            panel.legend(loc="best", fontsize=7)
        for panel in axes[1]:
            panel.set_xlabel("t [s]")
        figure.savefig(FIGURE, dpi=110, metadata={"Software": None})
    print(f"{FIGURE}, {len(time) * STEP:.0f} s")


if __name__ == "__main__":
    main()
