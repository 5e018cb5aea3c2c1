# Copyright 2026 ahv developers, Apache-2.0
"""Vehicles are drawn as they are said to be, each again with the same bits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import draw_dispersion
from ahv_plant.draws import Normal, Truncated, Uniform, bent, distributions_of, draw_values
from ahv_plant.parameters import PLANT_PARAMETERS
from test.flights import between

pytestmark = pytest.mark.unit

RUNS = 4000
QUANTITIES = {
    "dispersion.mass": {"normal": [1.0, 0.03]},
    "dispersion.density": {"uniform": [0.7, 1.3]},
    "dispersion.X_cg": {"truncated": [0.1, 0.2, -0.1, 0.4]},
    "dispersion.Iyy": {"normal": [1.0, 0.05]},
    "dispersion.temperature": {"uniform": [0.9, 1.1]},
}
CORRELATION = [
    ["dispersion.mass", "dispersion.Iyy", 0.8],
    ["dispersion.temperature", "dispersion.density", -0.6],
]
# draw_dispersion(0.3, 7, 3) since the first campaign
OLD = """
0x1.48f71452a3021p+0
0x1.3b11cc8fec447p+0
0x1.ada94c139dd5fp-1
0x1.23859bcedd572p+0
0x1.e2ebd5b8677c4p-1
0x1.2ec4949a3dc4fp+0
0x1.4a363acc1697dp+0
0x1.e93e81fe541dbp-1
0x1.3f157e8b56b4fp+0
"""


def made(quantities, correlation=()):
    return distributions_of(quantities, correlation, PLANT_PARAMETERS)


def drawn(quantities, correlation=(), runs=RUNS):
    """Values (runs) of every quantity by its last name."""
    distributions = made(quantities, correlation)
    rows = [draw_values(distributions, 5, run) for run in range(runs)]
    return {
        name.removeprefix("dispersion."): np.array([r[name] for r in rows]) for name in rows[0]
    }


@pytest.fixture(scope="module")
def values():
    return drawn(QUANTITIES, CORRELATION)


def test_the_draw_of_an_old_campaign_keeps_its_bits():
    assert [number.hex() for number in draw_dispersion(0.3, 7, 3)] == OLD.split()


@pytest.mark.parametrize(
    ("name", "distribution"),
    [
        ("mass", stats.norm(1.0, 0.03)),
        ("density", stats.uniform(0.7, 0.6)),
        ("X_cg", stats.truncnorm(-1.0, 1.5, 0.1, 0.2)),
        ("Iyy", stats.norm(1.0, 0.05)),
    ],
)
def test_draws_have_moments_and_shape_of_their_distribution(values, name, distribution):
    """Also where they are correlated with others."""
    error = distribution.std() / math.sqrt(RUNS)
    assert values[name].mean() == pytest.approx(distribution.mean(), abs=4.0 * error)
    assert values[name].std() == pytest.approx(distribution.std(), rel=0.05)
    assert stats.kstest(values[name], distribution.cdf).pvalue > 1e-3


def test_truncated_draws_stay_between_their_ends_and_reach_them(values):
    least, most = values["X_cg"].min(), values["X_cg"].max()
    assert -0.1 <= least < -0.098 and 0.398 < most <= 0.4


def test_quantities_are_correlated_as_they_are_said_to_be(values):
    found = np.corrcoef(
        [values[name] for name in ("mass", "Iyy", "density", "temperature", "X_cg")]
    )
    uniform = 6.0 / math.pi * math.asin(-0.6 / 2.0)
    expected = np.eye(5)
    expected[0, 1] = expected[1, 0] = 0.8
    expected[2, 3] = expected[3, 2] = uniform
    assert found == pytest.approx(expected, abs=4.0 / math.sqrt(RUNS))


def test_a_quantity_more_or_less_changes_no_other():
    few = {name: QUANTITIES[name] for name in ("dispersion.density", "dispersion.X_cg")}
    alone, among = drawn(few, runs=5), drawn(QUANTITIES, runs=5)
    assert all(np.array_equal(alone[name], among[name]) for name in alone)


def test_a_run_can_be_drawn_again_alone():
    distributions = made(QUANTITIES, CORRELATION)
    runs = [draw_values(distributions, 7, run) for run in range(4)]
    assert draw_values(distributions, 7, 2) == runs[2]
    assert len({tuple(run.values()) for run in runs}) == 4
    assert draw_values(distributions, 8, 2) != runs[2]


@given(between(-9.0, 9.0), between(-1.0, 1.0), between(0.01, 1.0), between(0.01, 3.0))
def test_a_value_has_as_much_below_it_as_the_normal(z, mean, deviation, width):
    assert bent(z, Normal(mean, deviation)) == mean + z * deviation
    end = mean + width
    assert mean <= bent(z, Uniform(mean, end)) <= end
    value = bent(z, Truncated(mean, deviation, mean, end))
    assert mean <= value <= end
    whole = stats.norm.cdf(width / deviation) - 0.5
    below = stats.norm.cdf((value - mean) / deviation) - 0.5
    assert below == pytest.approx(whole * stats.norm.cdf(z), abs=1e-9)


@given(st.floats(-0.99, 0.99))
def test_the_factor_gives_the_correlation_back(r):
    factor = made(QUANTITIES, [["dispersion.mass", "dispersion.X_cg", r]]).factor
    lower = np.array([[*row, *[0.0] * (len(factor) - len(row))] for row in factor])
    expected = np.eye(5)
    expected[0, 2] = expected[2, 0] = r
    assert lower @ lower.T == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("quantities", "correlation", "words"),
    [
        ({"dispersion.mas": {"normal": [1, 0.1]}}, [], "did you mean 'dispersion.mass'"),
        ({"listeners": {"uniform": [1, 2]}}, [], "listeners is no number"),
        ({"dispersion.mass": {"gamma": [1, 0.1]}}, [], r"one of uniform: \[low, high\]"),
        ({"dispersion.mass": {"normal": [1.0]}}, [], r"normal: \[mean, deviation\]"),
        ({"dispersion.mass": {"normal": [1.0, math.nan]}}, [], "must be one of"),
        ({"dispersion.mass": {"normal": [1.0, 10**400]}}, [], "must be one of"),
        ({"dispersion.mass": [1.0, 0.1]}, [], "must be one of"),
        ({"dispersion.mass": {"uniform": [1.1, 0.9]}}, [], "width above 0"),
        ({"dispersion.mass": {"normal": [1.0, -0.1]}}, [], "width above 0"),
        ({"dispersion.mass": {"truncated": [1.0, 0.0, 0.9, 1.1]}}, [], "width above 0"),
        ({"dispersion.mass": {"truncated": [1.0, 0.01, 2.0, 3.0]}}, [], "leave 1e-06"),
        ({"dispersion.mass": {"uniform": [0.0, 1.0]}}, [], "mass is 0.0, .*uniform draws reach"),
        ({"dispersion.mass": {"normal": [1.0, 0.2]}}, [], "normal draws reach there"),
        (QUANTITIES, [["dispersion.mass", "dispersion.CL", 0.5]], "'dispersion.CL', but drawn"),
        (QUANTITIES, [["dispersion.mass", "dispersion.mass", 0.5]], "name, other name, number"),
        (QUANTITIES, ["dispersion.mass"], "name, other name, number"),
        (QUANTITIES, [["dispersion.mass", "dispersion.Iyy", 1.0]], "larger than any can be"),
        (
            QUANTITIES,
            [
                ["dispersion.mass", "dispersion.Iyy", 0.9],
                ["dispersion.mass", "dispersion.density", 0.9],
                ["dispersion.density", "dispersion.Iyy", -0.9],
            ],
            "larger than any can be",
        ),
    ],
)
def test_what_cannot_be_drawn_is_named(quantities, correlation, words):
    with pytest.raises(ParameterError, match=words):
        made(quantities, correlation)
