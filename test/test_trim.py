# Copyright 2026 ahv developers, Apache-2.0
"""Trim is section 3.5.1's, to the digits that an independent solution gave."""

import numpy as np
import pytest
from hypothesis import given, settings

from ahv_plant.dispersion import NOMINAL, Truth
from ahv_plant.level_trim import balance
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import DEGREES, INITIAL_MASS
from ahv_plant.trim import trim
from ahv_plant.vehicle import vehicle_step
from test.flights import between

pytestmark = pytest.mark.unit


def digits(found):
    return (
        found.state.w,
        found.state.theta * DEGREES,
        found.surfaces.right_elevon * DEGREES,
        found.surfaces.left_elevon * DEGREES,
        found.throttle,
    )


def test_trim_of_the_report():
    found = trim()
    assert found.converged and found.within_limits
    assert found.residual < 1e-9
    w, theta, right, left, throttle = digits(found)
    assert w == pytest.approx(91.878, abs=5e-4)
    assert (theta, right, left) == pytest.approx((2.9442, -7.2163, -7.2163), abs=5e-5)
    assert throttle == pytest.approx(0.19417, abs=5e-6)
    assert found.alpha == pytest.approx(found.state.theta, abs=1e-12)
    assert (found.state.v, found.surfaces.rudder) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_trim_with_geometric_altitude():
    found = trim(truth=Truth(geometric=True))
    assert digits(found) == pytest.approx((90.4445, 2.8984, -7.1616, -7.1616, 0.19534), abs=5e-4)


@settings(max_examples=25)
@given(between(22000.0, 27000.0), between(1600.0, 2400.0), between(100000.0, 140000.0))
def test_a_trimmed_vehicle_stays_trimmed(altitude, speed, mass):
    found = trim(altitude, speed, mass)
    assert found.converged
    state = found.state
    if found.within_limits:
        for _ in range(10):
            state = vehicle_step(state, found.surfaces, found.throttle, 0.0, NOMINAL)
        # only the mass changes, and the balance with it
        assert state[:9] == pytest.approx(found.state[:9], abs=2e-3)
        assert state.h == pytest.approx(altitude, abs=1e-3)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"altitude": 50000.0}, ("altitude", "50000", "0 to 47000 m")),
        ({"altitude": float("nan")}, ("altitude", "nan", "0 to 47000 m")),
        ({"speed": 900.0}, ("speed", "900", "1191 to 7147 m/s")),
        ({"mass": 20000.0}, ("mass", "20000", "60000 to 140000 kg")),
    ],
)
def test_a_condition_outside_the_model_is_named(arguments, words):
    with pytest.raises(ValueError) as error:
        trim(**arguments)
    assert all(word in str(error.value) for word in words)


def test_a_trim_beyond_the_stops_is_said_to_be():
    found = trim(altitude=8000.0)
    assert found.converged and found.throttle > 1.0
    assert not found.within_limits


@pytest.mark.compiled
def test_there_is_a_trim_for_every_condition_of_the_model():
    within = 0
    for altitude in (0.0, 12000.0, 24000.0, *range(36000, 47001, 1000)):
        sound = atmosphere(altitude, False).sound_speed
        for mach in (4.0001, 4.5, *range(6, 24, 2), 23.9999):
            found = trim(altitude, mach * sound)
            assert found.converged, (altitude, mach)
            within += found.within_limits
    assert within == 71
    high = trim(47000.0, 4947.0)
    assert high.within_limits
    elevon = high.surfaces.right_elevon * DEGREES
    assert (high.alpha * DEGREES, elevon, high.throttle) == pytest.approx(
        (14.62, -25.46, 0.413), abs=5e-3
    )


@pytest.mark.compiled
@pytest.mark.parametrize("altitude", [36000.0, 42000.0, 47000.0])
@pytest.mark.parametrize("mach", [4.5, 9.0, 15.0, 21.0, 23.9999])
def test_there_is_no_other_trim(altitude, mach):
    """At any alpha the pitch balance is quadratic in the elevons; w decides along both roots.

    Where the square vanishes, at alpha = 0, the far one passes through infinity.
    """
    speed = mach * atmosphere(altitude, False).sound_speed

    def rates(alpha, elevon):
        return balance(alpha, float(elevon), altitude, speed, INITIAL_MASS, NOMINAL)[:2]

    found = []
    before = (0.0, 0.0)
    for alpha in np.radians(np.arange(-15.0, 60.0, 0.25)):
        left, middle, right = (rates(alpha, elevon)[1] for elevon in (-1.0, 0.0, 1.0))
        roots = np.roots([(left + right) / 2 - middle, (right - left) / 2, middle])
        assert np.all(np.isreal(roots))
        near_and_far = sorted(roots, key=abs)
        now = [rates(alpha, root)[0] if abs(root) < 100.0 else 0.0 for root in near_and_far]
        now += [0.0] * (2 - len(now))
        found += [(alpha, branch) for branch in (0, 1) if now[branch] * before[branch] < 0.0]
        before = now
    ((alpha, branch),) = found
    assert branch == 0
    assert alpha - np.radians(0.25) <= trim(altitude, speed).alpha <= alpha


def test_outside_the_stops_a_trim_is_shown_but_not_held():
    found = trim(altitude=45000.0)
    assert found.converged and not found.within_limits
    assert found.surfaces.right_elevon * DEGREES > 100.0
