# Copyright 2026 ahv developers, Apache-2.0
"""A step is answered once, when all its inputs are there, in whatever order they come."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ahv_msgs_py.node.synchronizer import Stepwise

pytestmark = pytest.mark.unit

STEP = 10


@given(st.permutations([(name, k) for name in "ab" for k in (0, 1, 2)]))
def test_every_order_of_arrival_answers_in_order_of_stamps(arrivals):
    answers = []
    inputs = Stepwise(("a", "b"), lambda stamp, a, b: answers.append((stamp, a, b)))
    for name, k in arrivals:
        inputs.put(name, k * STEP, (name, k))
    stamps = [stamp for stamp, _, _ in answers]
    assert stamps == sorted(set(stamps))
    assert stamps[-1] == 2 * STEP
    for stamp, a, b in answers:
        assert (a, b) == (("a", stamp // STEP), ("b", stamp // STEP))


def test_a_repeated_message_is_not_answered_twice():
    answers = []
    inputs = Stepwise(("a", "b"), lambda stamp, a, b: answers.append(stamp))
    for _ in range(3):
        inputs.put("a", 0, (1.0,))
        inputs.put("b", 0, (2.0,))
    assert answers == [0]


def test_lockstep_order_answers_every_step():
    answers = []
    inputs = Stepwise(("a", "b"), lambda stamp, a, b: answers.append(stamp))
    for k in range(5):
        first, second = ("ab", "ba")[k % 2]
        inputs.put(first, k * STEP, ())
        inputs.put(second, k * STEP, ())
    assert answers == [k * STEP for k in range(5)]


def test_it_says_what_the_first_step_that_is_not_answered_waits_for():
    inputs = Stepwise(("a", "b", "c"), lambda *answered: None)
    assert inputs.awaited() is None
    inputs.put("b", 2 * STEP, ())
    inputs.put("b", STEP, ())
    assert inputs.awaited() == (STEP, ("a", "c"))
    for name in "ac":
        inputs.put(name, STEP, ())
    assert inputs.awaited() == (2 * STEP, ("a", "c"))
