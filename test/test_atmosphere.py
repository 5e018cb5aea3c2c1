# Copyright 2026 ahv developers, Apache-2.0
"""The air is the International Standard Atmosphere."""

import pytest
from hypothesis import given

from ahv_plant.model.atmosphere import (
    STANDARD_GRAVITY,
    atmosphere,
    geopotential_altitude,
)
from test.flights import between

pytestmark = pytest.mark.unit


@pytest.mark.parametrize(
    "altitude, temperature, pressure, density",
    [  # ISO 2533:1975, rounded as printed
        (0.0, 288.15, 101325.0, 1.225),
        (11000.0, 216.65, 22632.0, 0.363918),
        (20000.0, 216.65, 5474.88, 0.0880349),
        (24000.0, 220.65, 2930.49, 0.0462674),
        (32000.0, 228.65, 868.014, 0.0132250),
        (47000.0, 270.65, 110.906, 0.00142753),
    ],
)
def test_published_values(altitude, temperature, pressure, density):
    air = atmosphere(altitude, False)
    assert air.temperature == pytest.approx(temperature, rel=1e-9)
    assert air.pressure == pytest.approx(pressure, rel=1e-5)
    assert air.density == pytest.approx(density, rel=1e-5)


@given(between(10.0, 46990.0))
def test_pressure_carries_the_air_above(altitude):
    step = 1.0
    below, above = atmosphere(altitude - step, False), atmosphere(altitude + step, False)
    gradient = (above.pressure - below.pressure) / (2 * step)
    weight = -atmosphere(altitude, False).density * STANDARD_GRAVITY
    assert gradient == pytest.approx(weight, rel=2e-5)


@pytest.mark.parametrize("base", [11000.0, 20000.0, 32000.0])
def test_layers_join_without_a_step(base):
    below, above = atmosphere(base, False), atmosphere(base + 1e-6, False)
    assert above.pressure == pytest.approx(below.pressure, rel=1e-9)
    assert above.temperature == pytest.approx(below.temperature, abs=1e-7)


def test_geometric_altitude_of_the_us_standard_atmosphere():
    # U.S. Standard Atmosphere 1976 lists 24 km geometric as 23 910 m geopotential, 2971.7 Pa
    assert geopotential_altitude(24000.0, True) == pytest.approx(23910.0, abs=0.5)
    assert atmosphere(24000.0, True).pressure == pytest.approx(2971.7, rel=2e-5)


def test_air_beyond_the_model_is_that_of_its_edge():
    assert atmosphere(60000.0, False) == atmosphere(47000.0, False)
    assert atmosphere(-500.0, False) == atmosphere(0.0, False)
