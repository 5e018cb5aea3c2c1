# Copyright 2026 ahv developers, Apache-2.0
"""A flight ends when the model no longer describes the vehicle, and says why."""

import math

import pytest

from ahv_plant.termination import termination_reason
from test.flights import CRUISE

pytestmark = pytest.mark.unit


@pytest.mark.parametrize("name", CRUISE._fields)
@pytest.mark.parametrize("broken", [math.nan, math.inf, -math.inf])
def test_a_state_that_is_not_finite_ends_the_flight(name, broken):
    reason = termination_reason(CRUISE._replace(**{name: broken}), False, 2.5)
    assert reason == "state is not finite at 2.5 s"


@pytest.mark.parametrize(
    ("altitude", "geometric", "inside"),
    [
        (-0.1, False, False),
        (0.0, False, True),
        (47000.0, False, True),
        (47000.1, False, False),
        (47300.0, True, True),  # 46 951 m geopotential
        (47400.0, True, False),
    ],
)
def test_the_atmosphere_model_ends_at_47_km(altitude, geometric, inside):
    reason = termination_reason(CRUISE._replace(h=altitude), geometric, 0.0)
    assert reason == ("" if inside else "left the atmosphere model at 0 s")
