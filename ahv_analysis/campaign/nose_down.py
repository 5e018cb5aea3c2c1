# Copyright 2026 ahv developers, Apache-2.0
"""The bound of physics: vehicles that no law could have saved from where they start."""

import numpy as np

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.batch import LIKE, lanes_of, starting_at
from ahv_plant.dispersion import Truth
from ahv_plant.hardware.delay import ROWS
from ahv_plant.hardware.noise import NO_DRAWS
from ahv_plant.hardware.wind import through_air
from ahv_plant.model.constants import STEP, SURFACE_MINIMUM, THROTTLE_MAXIMUM
from ahv_plant.model.vectors import Controls, State, Surfaces
from ahv_plant.numerics.elementary import atan2
from ahv_plant.numerics.elementwise import elementwise, kernel, select
from ahv_plant.numerics.simd import LANES, load, store, widen
from ahv_plant.plant import Hardware, Plant, Rig, plant_step, start_plant

NOSE_DOWN_STEPS = 300  # 3 s: what turns at all has turned by then


@elementwise
def _alpha(plant: Plant, number: int, truth: Truth) -> float:
    moving = through_air(plant.state, number * STEP, plant.turbulence, truth.wind)
    return atan2(moving.w, moving.u)


@kernel
def nose_down(state, truth, draws, rig):
    """Largest alpha [rad] while elevons are told up to the stop and the throttle to open.

    No law that starts there keeps it smaller: commands are these from the first one on. It is
    that against the air, in steady wind and gust; turbulence, which could help, is left out. The
    numbers may be lanes.
    """
    command = Controls(Surfaces(SURFACE_MINIMUM, SURFACE_MINIMUM, 0.0), THROTTLE_MAXIMUM)
    plant = widen(start_plant(state, truth, draws, rig), state.u)
    largest = _alpha(plant, 0, truth)
    rising = 1.0 + 0.0 * largest
    for number in range(NOSE_DOWN_STEPS):
        plant = widen(plant_step(plant, command, number, truth, draws, rig), state.u)
        alpha = _alpha(plant, number + 1, truth)
        rising = select(alpha < 0.0, 0.0 * alpha, rising)  # afterwards it dives, and may tumble
        largest = select(rising == 1.0, max(largest, alpha), largest)
    return largest


@kernel
def nose_down_batch(states, starts, dispersions, like, truth, draws, rig, result):
    """Largest alpha of a batch that goes nose down, to result (1, LANES)."""
    dispersion = load(like[1], dispersions)
    truth = Truth(truth.geometric, dispersion, truth.disturbance, truth.further, truth.wind)
    largest = nose_down(load(like[0], states), truth, draws, starting_at(starts, like[2], rig))
    store(result, (largest,))


def nose_down_alphas(
    states: Array,
    dispersions: Array,
    starts: Array | None,
    truth: Truth,
    hardware: Hardware | None,
) -> Array:
    """Largest alpha [rad] (N, 1) of N runs that go nose down as fast as they can.

    Where it passes the bound of the inlet, no law that starts there saves the vehicle. Sensors
    have no say in it. `starts` are for hardware, as in `fly_batch_on_hardware`.
    """
    largest = np.empty((1, LANES))
    rows = []
    for first in range(0, len(states), LANES):
        vehicles, equipped, controls = lanes_of(dispersions, first), None, None
        if hardware is not None and starts is not None:
            controls = lanes_of(starts, first)
            equipped = Rig(hardware, np.array([controls] * ROWS))
        like = (State(*LIKE[0]), LIKE[1], None if hardware is None else hardware.start)
        nose_down_batch(
            lanes_of(states, first),
            controls,
            vehicles,
            like,
            truth,
            None if hardware is None else NO_DRAWS,
            equipped,
            largest,
        )
        rows.append(largest.T.copy())
    return np.concatenate(rows)[: len(states)]
