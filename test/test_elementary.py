# Copyright 2026 ahv developers, Apache-2.0
"""The elementary functions are those of mathematics, to a few units in the last place."""

import math

import mpmath
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ahv_plant.numerics.elementary import (
    asin,
    atan,
    atan2,
    atan_ratio,
    exp_small,
    log_near_one,
    power,
    sin_cos,
)
from test.flights import between

pytestmark = pytest.mark.unit


def ulps(found, exact):
    """Distance of a double from the exact value in units of its last place."""
    return abs(float((mpmath.mpf(found) - exact) / mpmath.mpf(math.ulp(float(exact)))))


@given(between(-10.0, 10.0) | between(-1e5, 1e5))
@example(0.0)
@example(math.pi / 4)
@example(-3 * math.pi / 4)
@example(math.pi)
def test_sine_and_cosine(x):
    with mpmath.workdps(60):
        sine, cosine = sin_cos(x)
        # near a zero of the function the reduction leaves an absolute error instead
        assert ulps(sine, mpmath.sin(x)) < 2 or abs(sine - float(mpmath.sin(x))) < 1e-16
        assert ulps(cosine, mpmath.cos(x)) < 2 or abs(cosine - float(mpmath.cos(x))) < 1e-16


@given(between(-3.0, 3.0) | st.floats(allow_nan=False, allow_infinity=False))
@example(math.tan(math.pi / 8))
@example(1.0)
def test_arctangent(x):
    with mpmath.workdps(60):
        assert ulps(atan(x), mpmath.atan(x)) < 3


@given(between(-3.0, 3.0), between(-3.0, 3.0))
@example(1.0, 0.0)
@example(-1.0, 0.0)
@example(0.0, -1.0)
@example(-1e-9, -7000.0)
def test_arctangent_in_all_four_quadrants(y, x):
    if x or y:
        with mpmath.workdps(60):
            assert ulps(atan2(y, x), mpmath.atan2(y, x)) < 3
        if x > 0.0:
            assert atan2(y, x).hex() == atan_ratio(y, x).hex()


@given(between(-1.0, 1.0))
def test_arcsine(x):
    with mpmath.workdps(60):
        assert abs(asin(x) - float(mpmath.asin(x))) < 2e-15 / math.sqrt(max(1 - x * x, 1e-12))


@pytest.mark.parametrize("x, edge", [(1.0, 1), (1.5, 1), (-1.0, -1), (-7.0, -1)])
def test_arcsine_stays_at_its_edge_beyond_one(x, edge):
    assert asin(x) == edge * math.pi / 2


@given(between(0.7, 1.4))
def test_logarithm(x):
    with mpmath.workdps(60):
        assert abs(log_near_one(x) - float(mpmath.log(x))) < 1e-16


@given(between(-10.0, 10.0))
def test_exponential(x):
    assert exp_small(x) == pytest.approx(math.exp(x), rel=2e-14, abs=0)


@given(between(0.08, 1.0), between(-2.0, 2.0))
def test_power(x, p):
    assert power(x, p) == pytest.approx(x**p, rel=5e-14, abs=0)


@given(between(0.08, 1.0))
def test_power_zero_is_exactly_one(x):
    assert power(x, 0.0) == 1.0


def test_not_a_number_stays_one():
    assert all(math.isnan(value) for value in (*sin_cos(math.nan), atan(math.nan)))
