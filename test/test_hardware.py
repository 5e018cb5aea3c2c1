# Copyright 2026 ahv developers, Apache-2.0
"""Flights on hardware that is not ideal: the same by every engine, and what becomes of them."""

from itertools import islice

import numpy as np
import pytest

from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.flight.case import load_case, make_case
from ahv_analysis.flight.library import fly

SEED = 11
TYPICAL = {
    "actuator.elevons.order": 1,
    "actuator.elevons.rate_limit": 60.0,
    "actuator.rudder.order": 2,
    "actuator.rudder.rate_limit": 60.0,
    "actuator.engine.order": 1,
    "actuator.engine.bandwidth": 5.0,
    "latency.delay": 0.02,
    "latency.jitter": 0.2,
    **{f"sensor.{state}.noise": 0.02 for state in ("P", "Q", "R", "phi", "theta", "psi")},
}


@pytest.fixture(scope="module")
def case():
    given = load_case("neuro_adaptive_sc_gdi_protected").parameters
    plant = given["plant"] | TYPICAL | {"duration": 12.0}
    learner = given["disturbance_learner"] | {"measured_surfaces": True}
    return make_case("typical", given | {"plant": plant, "disturbance_learner": learner})


@pytest.mark.parametrize("random_starts", [False, True])
def test_a_run_is_the_same_in_a_lane_alone_and_flown_step_by_step(case, random_starts):
    campaign = Campaign(case, 0.3, 3, SEED, random_starts)
    rows = fly_runs(campaign, 0, 3)
    for run in range(3):
        alone = fly_again(campaign, run)
        for name, column in alone.items():
            assert np.array_equal(column[0], rows[name][run], equal_nan=True), name
        *_, last = fly(campaign.case_of(run))
        assert last.state.h == rows["final_altitude_m"][run]
        assert last.state.u == rows["final_speed_mps"][run]


def test_a_block_of_draws_ends_where_it_likes(case):
    """The flight is longer than a block, and its steps are no multiple of one."""
    whole = fly_runs(Campaign(case, 0.3, 1, SEED), 0, 1)
    odd = case._replace(plant=case.plant._replace(steps=1003))
    *_, last = islice(fly(Campaign(case, 0.3, 1, SEED).case_of(0)), 1004)
    part = fly_runs(Campaign(odd, 0.3, 1, SEED), 0, 1)
    assert part["final_altitude_m"][0] == last.state.h != whole["final_altitude_m"][0]
