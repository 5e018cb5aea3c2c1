# Copyright 2026 ahv developers, Apache-2.0
"""The aerodynamic polynomials are the published ones, and add up to the six coefficients."""

import csv
import math
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import given

from ahv_plant.model import aerodynamic_fits
from ahv_plant.model.aerodynamics import aerodynamic_coefficients, air_data, control_coefficients
from ahv_plant.model.constants import DEGREES, MEAN_CHORD, WING_SPAN
from ahv_plant.model.vectors import Surfaces
from test.flights import STATES, SURFACES, as_python, between

pytestmark = pytest.mark.unit

Powers = tuple[int, int, int]  # of alpha, Mach, deflection


class Polynomial:
    """A polynomial in alpha, Mach and deflection that keeps its terms apart."""

    def __init__(self, terms: dict[Powers, float]):
        self.terms = terms

    def __add__(self, other):
        sum_ = dict(self.terms)
        for powers, value in _terms(other).items():
            assert powers not in sum_ or 0.0 in (value, sum_[powers]), (
                "two terms of the same powers"
            )
            sum_[powers] = sum_.get(powers, 0.0) + value
        return Polynomial(sum_)

    def __mul__(self, other):
        product = {}
        for one, value in self.terms.items():
            for two, factor in _terms(other).items():
                product[tuple(i + j for i, j in zip(one, two, strict=True))] = value * factor
        return Polynomial(product)

    __radd__ = __add__
    __rmul__ = __mul__


def _terms(value):
    return value.terms if isinstance(value, Polynomial) else {(0, 0, 0): value}


ALPHA = Polynomial({(1, 0, 0): 1.0})
MACH = Polynomial({(0, 1, 0): 1.0})
DEFLECTION = Polynomial({(0, 0, 1): 1.0})


def published():
    """Terms of every polynomial by its name, from the table of Keshmiri et al."""
    table = defaultdict(dict)
    with open(Path(__file__).parent / "data" / "aero_coefficients.csv") as file:
        for row in csv.DictReader(file):
            powers = tuple(int(row[f"{name}_power"]) for name in ("alpha", "mach", "deflection"))
            table[f"{row['coefficient']}_{row['part']}"][powers] = float(row["value"])
    return dict(table)


PUBLISHED = published()
WITH_DEFLECTION = [name for name in PUBLISHED if name.endswith(("elevon", "rudder"))]


def test_there_are_22_polynomials():
    assert len(PUBLISHED) == 22


@pytest.mark.parametrize("name", PUBLISHED)
def test_polynomial_has_the_published_terms(name):
    function = as_python(getattr(aerodynamic_fits, name))
    if name in WITH_DEFLECTION:
        built, _ = function(ALPHA, MACH, DEFLECTION)
    else:
        built = function(ALPHA, MACH)
    terms = {powers: value for powers, value in built.terms.items() if value}
    assert terms == PUBLISHED[name]


@pytest.mark.parametrize("name", WITH_DEFLECTION)
@given(a=between(-5.0, 8.0), m=between(4.0, 20.0), d=between(-40.0, 30.0))
def test_slope_is_the_complex_step_derivative(name, a, m, d):
    function = getattr(aerodynamic_fits, name)
    _, slope = function(a, m, d)
    value, _ = function(a, m, complex(d, 1e-30))
    assert slope == pytest.approx(value.imag / 1e-30, rel=1e-12, abs=1e-25)


def _sum(name, a, m, d=0.0):
    return sum(value * a**i * m**j * d**k for (i, j, k), value in PUBLISHED[name].items())


@given(STATES, SURFACES)
def test_parts_add_up_as_in_section_2_2(state, surfaces):
    air = air_data(state, False)
    a, m = air.alpha * DEGREES, air.mach
    e, l, r = (deflection * DEGREES for deflection in surfaces)  # noqa: E741
    p_hat, q_hat, r_hat = (
        rate * length / (2 * air.speed)
        for rate, length in ((state.P, WING_SPAN), (state.Q, MEAN_CHORD), (state.R, WING_SPAN))
    )

    def lateral(axis):
        return (
            _sum(f"{axis}_beta", a, m) * air.beta
            + _sum(f"{axis}_elevon", a, m, e)
            - _sum(f"{axis}_elevon", a, m, l)
            + _sum(f"{axis}_rudder", a, m, r)
        )

    def symmetric(axis):
        return (
            _sum(f"{axis}_basic", a, m)
            + _sum(f"{axis}_elevon", a, m, e)
            + _sum(f"{axis}_elevon", a, m, l)
        )

    expected = (
        symmetric("CL"),
        symmetric("CD") + _sum("CD_rudder", a, m, r),
        lateral("CY"),
        lateral("Cl") + _sum("Cl_p", a, m) * p_hat + _sum("Cl_r", a, m) * r_hat,
        symmetric("Cm") + _sum("Cm_rudder", a, m, r) + _sum("Cm_q", a, m) * q_hat,
        lateral("Cn") + _sum("Cn_p", a, m) * p_hat + _sum("Cn_r", a, m) * r_hat,
    )
    assert aerodynamic_coefficients(air, state, surfaces) == pytest.approx(
        expected, rel=1e-10, abs=1e-13
    )


@given(STATES, SURFACES)
def test_mirrored_elevons_mirror_the_lateral_coefficients(state, surfaces):
    level = state._replace(v=0.0, P=0.0, R=0.0)
    air = air_data(level, False)
    there, _, _, _ = control_coefficients(air, surfaces._replace(rudder=0.0))
    swapped = Surfaces(surfaces.left_elevon, surfaces.right_elevon, 0.0)
    back, _, _, _ = control_coefficients(air, swapped)
    assert (there.CL, there.CD, there.Cm) == pytest.approx((back.CL, back.CD, back.Cm), rel=1e-12)
    # the rudder's polynomials keep terms of the order 1e-18 at zero deflection
    assert (there.CY, there.Cl, there.Cn) == pytest.approx(
        (-back.CY, -back.Cl, -back.Cn), abs=1e-16
    )


@given(STATES)
def test_air_data_are_the_definitions(state):
    air = air_data(state, False)
    assert air.alpha == pytest.approx(math.atan2(state.w, state.u), abs=1e-15)
    assert air.beta == pytest.approx(math.asin(state.v / air.speed), abs=1e-15)
    assert air.sin_alpha == pytest.approx(math.sin(air.alpha), abs=1e-15)
    assert air.cos_alpha == pytest.approx(math.cos(air.alpha), abs=1e-15)
