# Copyright 2026 ahv developers, Apache-2.0
"""Every operation on lanes gives each lane the bits that the same operation gives its number."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba.core import config
from numba.core.errors import TypingError

from ahv_plant.model.vectors import Surfaces
from ahv_plant.numerics.elementwise import elementwise, kernel, select
from ahv_plant.numerics.simd import LANES, load, store, widen

pytestmark = pytest.mark.unit

LIKE = ((0.0, 0.0), Surfaces(0.0, 0.0, 0.0), None)  # what a kernel is told of the rows of an array
NUMBERS = st.floats(0.001, 1000.0) | st.floats(-1000.0, -0.001)


def operations(a, b, c):
    """What elementwise functions may use, on numbers or on lanes of numbers."""
    between = (a < b) & (b <= c)
    outside = (a > c) | (c >= b) | (a == c)
    number = select(between, 1, select(outside, 2, 3))
    return (
        (a + b, a - 2.0, 3.0 * b, 1.0 / c, -a),
        Surfaces(abs(a), max(a, b, c), math.sqrt(abs(b))),
        (select(between, a, 0.5), select(number == 2, b, c), number, between),
    )


def flat(value):
    return [part for one in value for part in flat(one)] if isinstance(value, tuple) else [value]


@pytest.fixture(scope="module")
def in_lanes():
    """Run `operations` on rows of a, b, c; compiled here and now, even where nothing else is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(config, "DISABLE_JIT", False)
        inner = elementwise(operations)

        @kernel
        def run(rows, like, result):
            (a, b), surfaces, _ = load(like, rows)
            c = widen(surfaces, a).right_elevon
            store(result, (inner(a, b, c), widen((5, 0.25), c)))

        result = np.empty((len(flat(operations(1.0, 2.0, 3.0))) + 2, LANES))

        def compute(rows):
            padded = np.concatenate((rows, np.zeros((2, LANES))))
            run(padded, LIKE, result)
            return result.T

        compute(np.ones((3, LANES)))
    return compute


@given(rows=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=LANES, max_size=LANES))
def test_a_lane_computes_what_its_number_computes(in_lanes, rows):
    for lane, numbers in zip(in_lanes(np.array(rows).T), rows, strict=True):
        expected = np.array([*flat(operations(*numbers)), 5, 0.25], float)
        assert lane.tobytes() == expected.tobytes()


def test_a_conditional_expression_is_refused_and_not_computed_wrongly(monkeypatch):
    monkeypatch.setattr(config, "DISABLE_JIT", False)

    @kernel
    def run(rows, result):
        (a,) = load((0.0,), rows)
        store(result, (1.0 if a > 0.0 else -1.0,))

    with pytest.raises(TypingError, match="bool"):
        run(np.ones((1, LANES)), np.empty((1, LANES)))
