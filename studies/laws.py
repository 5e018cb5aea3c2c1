# Copyright 2026 ahv developers, Apache-2.0
"""How the laws of others were tuned: `python -m studies.laws` prints the tables of docs/laws.md.

One rule for all of them, on the nominal vehicle in its trim at 24 km alone. On `typical` hardware,

* the peak of the sensitivity |S| of the loop through both elevons is at most 1.5, which is a gain
  margin of 9.5 dB and a phase margin of 39 deg at least (Skogestad and Postlethwaite,
  Multivariable Feedback Control, 2005, section 2.4.3);
* sensor noise moves neither elevons nor rudder at more than 40 deg/s (rms): two thirds of their
  rate limit;
* and of the settings in the grid that hold both, those are taken that leave the smallest pitch
  rate after a disturbance of 10 deg/s^2 in pitch.

The sensitivity is measured in flight: one command to the elevons is changed by a little, and the
Fourier transform of what follows in all later ones is S. No law is linearised by hand.
"""

from collections.abc import Callable, Iterator
from itertools import product
from types import ModuleType
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from ahv_analysis.flight.case import load_case
from ahv_control import flight_control
from ahv_control.laws import eso, indi, lqi, sliding_mode
from ahv_control.reference import held
from ahv_plant.dispersion import AxisDisturbance, Disturbance, Truth
from ahv_plant.hardware.noise import Channel, draws_of
from ahv_plant.model.constants import DEGREES, RADIANS, STEP
from ahv_plant.model.vectors import Controls, State, Surfaces
from ahv_plant.plant import noise_stream, plant_step, rig, start_plant
from ahv_plant.trim import CRUISE_ALTITUDE, CRUISE_SPEED, trim
from studies import lqi_gains

Array = NDArray[np.float64]
Flight = Callable[..., Array]

PEAK = 1.5  # [-] of |S|
RESTLESS = 40.0  # [deg/s] rms of what noise does to a surface
PUSH = 10.0  # [deg/s^2] in pitch, from 1 s on
OVERSHOOT = 100.0  # [m] after a step of 100 m: of the law that has an altitude loop of its own
LOWEST = 0.3  # [rad/s] below which there is no loop of the pitch rate
PULSE, PULSE_STEP, STEPS = 1e-5, 500, 3000  # [rad]
EXACT = 1 << 14
HARDWARE = load_case("nominal_di", hardware="typical").plant.hardware
GRIDS: dict[ModuleType, dict[str, tuple[float, ...]]] = {
    eso: {"omega_o": (10.0, 15.0, 20.0, 25.0), "k_Q": (5.0, 6.0, 7.0, 8.0)},
    indi: {"omega_f": (4.0, 5.0, 6.0, 7.0), "k_Q": (5.0, 6.0, 7.0, 8.0)},
    sliding_mode: {"omega": (3.0, 3.5, 4.0, 4.5), "phi": (5.0, 10.0)},
}
# of the linear-quadratic law the numbers of Bryson's rule, in degrees and metres
BRYSON = {"alpha": (0.5, 0.8), "elevons": (4.0, 5.0), "altitude": (200.0, 300.0)}


class Look(NamedTuple):
    """What a law does on the nominal vehicle."""

    peak: float  # [-] of |S|
    complementary: float  # [-] peak of |T|
    elevon: float  # [deg/s] rms by noise
    rudder: float  # [deg/s] rms by noise
    Q: float  # [deg/s] largest after the disturbance
    overshoot: float  # [m] after a step of the altitude by 100 m


def flight_of(law: Any) -> Flight:
    """Compiled closed loop of a law: states and commands, with a pulse on the elevons."""
    first, later = law.start, law.step

    @numba.njit(error_model="numpy")
    def flight(state, truth, control, wanted, block, equipped, at, pulse):  # type: ignore[no-untyped-def]
        plant = start_plant(state, truth, draws_of(block[0]), equipped)
        memory, commands = first(plant.measured, wanted, control)
        kept = np.empty((len(block) - 1, 4))
        for number in range(len(kept)):
            surfaces = commands.surfaces
            kept[number, 0] = plant.state.h
            kept[number, 1] = plant.state.Q
            kept[number, 2] = surfaces.right_elevon
            kept[number, 3] = surfaces.rudder
            more = pulse if number == at else 0.0
            told = Surfaces(
                surfaces.right_elevon + more, surfaces.left_elevon + more, surfaces.rudder
            )
            before, draws = plant.measured, draws_of(block[number + 1])
            plant = plant_step(
                plant, Controls(told, commands.throttle), number, truth, draws, equipped
            )
            memory, commands = later(memory, before, commands, plant.measured, wanted, control)
        return kept

    return flight  # type: ignore[no-any-return]


def sensitivity(flight: Flight, control: Any, start: State) -> tuple[Array, Array]:
    """Frequencies [rad/s], and S [-] of the loop through both elevons."""
    still, struck = (
        flown(flight, control, start, STEPS, pulse=pulse)[PULSE_STEP:, 2] for pulse in (0.0, PULSE)
    )
    S = 1.0 + np.fft.rfft((struck - still) / PULSE, EXACT)
    return 2.0 * np.pi * np.fft.rfftfreq(EXACT, STEP), S


def flown(
    flight: Flight,
    control: Any,
    start: State,
    steps: int,
    *,
    truth: Truth = Truth(),  # noqa: B008  # a constant
    pulse: float = 0.0,
    noisy: bool = False,
) -> Array:
    """Altitude [m], Q [rad/s], right elevon and rudder [rad], step by step."""
    assert HARDWARE is not None
    block = np.zeros((steps + 1, len(Channel)))
    if noisy:
        noise_stream(HARDWARE, None, 0, 0).fill(block)
    wanted = held(CRUISE_ALTITUDE, CRUISE_SPEED)
    return flight(start, truth, control, wanted, block, rig(HARDWARE), PULSE_STEP, pulse)


def look(flight: Flight, control: Any) -> Look:
    """Measure what the rule is about."""
    start = trim().state
    frequency, S = sensitivity(flight, control, start)
    loop = frequency > LOWEST
    noisy = flown(flight, control, start, 2000, noisy=True)[500:]
    none = AxisDisturbance(*[0.0] * len(AxisDisturbance._fields))
    pushed = Truth(
        disturbance=Disturbance(none, none._replace(step=PUSH * RADIANS, step_time=1.0), none)
    )
    moved = np.diff(noisy[:, 2:], axis=0).std(axis=0) / STEP * DEGREES
    return Look(
        float(abs(S[loop]).max()),
        float(abs(S[loop] - 1.0).max()),
        *moved.tolist(),
        float(flown(flight, control, start, 1500, truth=pushed)[:, 1].max()) * DEGREES,
        float(flown(flight, control, start._replace(h=start.h - 100.0), 15000)[:, 0].max())
        - start.h,
    )


def holds(found: Look) -> bool:
    """Whether settings keep to the rule."""
    return found.peak <= PEAK and max(found.elevon, found.rudder) <= RESTLESS


def linear_choices() -> Iterator[tuple[dict[str, float], Any]]:
    """Settings of the linear-quadratic law."""
    usual = lqi.design(lqi.Settings())
    for values in product(*BRYSON.values()):
        alpha, elevons, altitude = values
        weights = lqi_gains.WEIGHTS._replace(
            states=lqi_gains.WEIGHTS.states._replace(
                alpha=alpha * RADIANS, altitude=altitude, altitude_sum=20.0 * altitude
            ),
            elevons=elevons * RADIANS,
        )
        given = dict(zip(BRYSON, values, strict=True))
        yield given, usual._replace(corners=lqi_gains.corners(weights))


def choices(law: ModuleType) -> Iterator[tuple[dict[str, float], Any]]:
    """Settings of the grid of a law, and what is flown with them."""
    for values in product(*GRIDS[law].values()):
        given = dict(zip(GRIDS[law], values, strict=True))
        yield given, law.design(law.Settings(**given))


def tune(name: str, law: ModuleType, grid: Iterator[tuple[dict[str, float], Any]]) -> None:
    """Print what the settings of a grid do, and which are taken."""
    flight = flight_of(law)
    found = [(given, look(flight, control)) for given, control in grid]
    print(f"\n{name}\n\n| {' | '.join([*found[0][0], *Look._fields, 'holds'])} |")
    print(f"|{'---|' * (len(found[0][0]) + len(Look._fields) + 1)}")
    for given, seen in found:
        cells = [*map("{:g}".format, given.values()), *map("{:.2f}".format, seen)]
        print(f"| {' | '.join([*cells, 'yes' if holds(seen) else 'no'])} |")
    limit = OVERSHOOT if law is lqi else np.inf
    good = [(seen.Q, given) for given, seen in found if holds(seen) and seen.overshoot <= limit]
    print(f"\ntaken: {min(good, key=lambda one: one[0])[1] if good else 'none'}")


def main() -> None:
    """Tune every law."""
    for law in GRIDS:
        tune(law.__name__.rpartition(".")[2], law, choices(law))
    tune("lqi", lqi, linear_choices())
    print("\nthe report's SC-GDI, for comparison")
    case = load_case("neuro_adaptive_sc_gdi", hardware="typical")
    print(look(flight_of(flight_control), case.control))


if __name__ == "__main__":
    main()
