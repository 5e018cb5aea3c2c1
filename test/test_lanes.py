# Copyright 2026 ahv developers, Apache-2.0
"""A lane is a run: the same bits as alone, by machine instructions that advance all at once."""

import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.batch import (
    LIKE,
    fly_alone,
    fly_batch,
    fly_trajectory,
)
from ahv_analysis.campaign.campaign import Campaign
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.closed_loop import loop_step, start_loop
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.outcome import Cause, Outcome
from ahv_plant.dispersion import Truth, draw_dispersion
from ahv_plant.level_trim import LevelTrim, level_trim
from ahv_plant.model.vectors import State
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.numerics.simd import LANES, load, store, widen
from ahv_plant.trim import trim

STEPS = 15000
SEED = 5


@kernel
def last_of_flight(state, truth, control, steps):
    """State and learner at the end of an adaptive flight; the numbers may be lanes."""
    one = state.u
    loop = widen(start_loop(state, truth, control, None, None), one)
    for number in range(steps):
        loop = widen(loop_step(loop, number, truth, control, None, None), one)
    return loop.plant.state, loop.memory.learner


@kernel
def last_of_batch(states, dispersions, like, control, steps, result):
    """Ends of a batch of flights, a row a number."""
    truth = Truth(False, load(like[1], dispersions), None, None, None)
    store(result, last_of_flight(load(like[0], states), truth, control, steps))


def flat(value):
    if isinstance(value, tuple):
        return [number for part in value for number in flat(part)]
    return [value]


def as_lanes(rows):
    return np.ascontiguousarray(np.array(rows).T)


def same_bits(one, other):
    return np.asarray(one, float).tobytes() == np.asarray(other, float).tobytes()


@pytest.fixture(scope="module")
def case():
    return load_case("neuro_adaptive_sc_gdi_protected")


@pytest.fixture(scope="module")
def ends(case):
    """Last states and learners (13 + 45, LANES) of a batch of 15 000 steps at 40 %."""
    result = np.empty((13 + 45, LANES))
    last_of_batch(
        as_lanes([case.plant.initial] * LANES),
        as_lanes([draw_dispersion(0.4, SEED, run) for run in range(LANES)]),
        LIKE,
        case.control,
        STEPS,
        result,
    )
    return result


def test_a_lane_has_the_bits_of_the_scalar_run(case, ends):
    for run in range(LANES):
        truth = Truth(dispersion=draw_dispersion(0.4, SEED, run))
        alone = last_of_flight(case.plant.initial, truth, case.control, STEPS)
        assert same_bits(ends[:, run], flat(alone)), run


PLAIN = """
from ahv_analysis.flight.case import dispersion_parameters, load_case
from ahv_analysis.flight.closed_loop import loop_step, start_loop
from ahv_analysis.flight.library import fly
from ahv_plant.dispersion import draw_dispersion

plant = dispersion_parameters(draw_dispersion(0.4, {seed}, {run}))
for step in fly(load_case("neuro_adaptive_sc_gdi_protected", plant)):
    pass
learner = [number for part in step.learner[:-1] for number in part]
servos = [number for servo in step.learner.servos for number in servo]
print(*(number.hex() for number in [*step.state, *learner, *servos]))
"""


def test_a_lane_has_the_bits_of_plain_python_floats(ends):
    run = 3
    result = subprocess.run(
        [sys.executable, "-c", PLAIN.format(seed=SEED, run=run)],
        env={"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    numbers = [float.fromhex(number) for number in result.stdout.split()]
    assert same_bits(ends[:, run], numbers)


ASSEMBLY = """
import numpy as np
from ahv_analysis.campaign.batch import LIKE, batch_outcomes
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.outcome import Outcome
from ahv_plant.numerics.simd import LANES

case = load_case("neuro_adaptive_sc_gdi")
states = np.repeat(np.array(case.plant.initial)[:, None], LANES, axis=1)
result = np.empty((len(Outcome._fields), LANES))
truth, control = case.plant.truth, case.control
batch_outcomes(states, np.ones((9, LANES)), LIKE, truth, control, 1, None, result)
print(*batch_outcomes.inspect_asm().values())
"""


@pytest.mark.slow
def test_the_machine_code_is_packed(tmp_path):
    """Compiled afresh, for the cache keeps no assembly."""
    result = subprocess.run(
        [sys.executable, "-c", ASSEMBLY],
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    packed = len(re.findall(r"\tv?(?:mul|add|sub)pd\b", result.stdout))
    single = len(re.findall(r"\tv?(?:mul|add|sub)sd\b", result.stdout))
    fused = len(re.findall(r"\tvf(?:n?madd|n?msub)", result.stdout))
    assert packed > 1000 and single < 0.05 * packed
    assert fused == 0  # a fused multiply-add would round differently


@pytest.mark.parametrize("name", ["nominal_di_dispersed", "neuro_adaptive_di"])
def test_an_outcome_is_the_same_alone_and_in_a_lane_and_true_of_the_flight(name):
    campaign = Campaign(load_case(name, {"duration": 30.0}), 0.4, 20, SEED)
    runs = range(campaign.runs)
    outcomes = fly_batch(
        np.array([campaign.start(run) for run in runs]),
        np.array([campaign.dispersion(run) for run in runs]),
        campaign.case.plant.truth,
        campaign.case.control,
        3000,
    )
    for run in runs:
        one = campaign.case_of(run)
        alone = fly_alone(one)
        assert same_bits(alone, outcomes[run]), run
    one = campaign.case_of(7)
    flown, outcome = record_of(fly(one), False), Outcome(*outcomes[7])
    until = slice(int(outcome.steps))
    assert outcome.max_abs_alpha == pytest.approx(
        np.max(np.abs(flown.air.alpha[: int(outcome.steps) + 1])), rel=1e-12
    )
    assert outcome.min_surface == np.min(flown.surfaces[until])
    assert outcome.max_throttle == np.max(flown.throttle[until])
    assert outcome.final_altitude == flown.column("h")[until][-1]


@pytest.mark.parametrize(
    "change, cause",
    [
        ({"u": math.nan}, Cause.STATE_IS_NOT_FINITE),
        ({"h": math.inf}, Cause.STATE_IS_NOT_FINITE),
        ({"h": -10.0}, Cause.LEFT_THE_ATMOSPHERE_MODEL),
        ({"h": 60000.0}, Cause.LEFT_THE_ATMOSPHERE_MODEL),
        ({"u": 1.0, "w": 0.0}, Cause.SURFACES_LOST_THE_VEHICLE),
        ({"w": 200.0}, Cause.INLET_UNSTART),
    ],
)
def test_a_broken_lane_fails_with_its_cause_and_touches_no_other(change, cause):
    case = load_case("neuro_adaptive_di")
    starts = [case.plant.initial] * LANES
    vehicles = np.array([draw_dispersion(0.2, SEED, run) for run in range(LANES)])
    whole = fly_batch(np.array(starts), vehicles, case.plant.truth, case.control, 500)
    starts[5] = case.plant.initial._replace(**change)
    broken = fly_batch(np.array(starts), vehicles, case.plant.truth, case.control, 500)
    assert Outcome(*broken[5]).cause == cause
    assert Outcome(*broken[5]).steps == 0
    others = np.arange(LANES) != 5
    assert same_bits(broken[others], whole[others])
    assert not np.any(whole[:, 0])


def test_a_trajectory_to_draw_is_that_of_the_flight():
    case = load_case("neuro_adaptive_di", {"duration": 5.0})
    kept, flown = fly_trajectory(case, 10), record_of(fly(case), False)
    assert np.array_equal(kept.stamps, flown.stamps[::10])
    for name in ("states", "attitude_commands", "rate_commands", "surfaces", "throttle"):
        assert same_bits(getattr(kept, name), getattr(flown, name)[::10]), name


@pytest.mark.unit
@pytest.mark.parametrize("run", range(6))
def test_level_trim_is_the_trim_of_all_seven_equations(run):
    truth = Truth(dispersion=draw_dispersion(0.4, SEED, run))
    found = LevelTrim(*level_trim(24000.0, 1786.4, 136077.6, truth))
    full = trim(truth=truth)
    assert (found.exists == 1.0) == (full.converged and full.within_limits)
    if full.converged:
        assert found.alpha == pytest.approx(full.alpha, abs=1e-8)
        assert found.elevon == pytest.approx(full.surfaces.right_elevon, abs=1e-7)
        assert found.throttle == pytest.approx(full.throttle, abs=1e-7)


def test_a_batch_needs_no_multiple_of_the_lanes():
    case = load_case("neuro_adaptive_di")
    vehicles = np.array([draw_dispersion(0.2, SEED, run) for run in range(LANES + 3)])
    starts = np.array([case.plant.initial] * len(vehicles))
    outcomes = fly_batch(starts, vehicles, case.plant.truth, case.control, 100)
    assert outcomes.shape == (LANES + 3, len(Outcome._fields))
    assert same_bits(
        outcomes[-1:], fly_batch(starts[-1:], vehicles[-1:], case.plant.truth, case.control, 100)
    )
    assert State(*starts[0]) == case.plant.initial
