# Copyright 2026 ahv developers, Apache-2.0
"""A guard lets one voice through, in order, with values that can be; all else it names."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ahv_msgs_py.layout import MessageError, NamedVector
from ahv_msgs_py.node.faults import HOLD, PERIOD, SILENCE, STALE, Fault, fault_rows
from ahv_msgs_py.node.guard import Guard, Refusal
from ahv_msgs_py.node.synchronizer import RealTimeSteps
from ahv_msgs_py.topics import SURFACE_COMMAND

pytestmark = pytest.mark.unit

VALUES = (-0.1, -0.1, 0.0)
LAYOUT = SURFACE_COMMAND.layout


FIRST, TWIN = b"the first", b"its twin"  # GIDs


class Air:
    """What surrounds a guard: a clock that stands still unless moved, and its publishers."""

    def __init__(self, realtime=True):
        self.time = 0
        self.publishers = [FIRST]
        self.guard = Guard(
            SURFACE_COMMAND, self.general, lambda: self.time, realtime, lambda: self.publishers
        )

    @staticmethod
    def general(data):
        raise MessageError("not of this layout")

    def say(self, step, values=VALUES, now=None, by=FIRST):
        """Send the command of a step; returns the fault that it was refused for, or None."""
        data = LAYOUT.encode(step * PERIOD, values)
        try:
            self.guard.read(data, by, None if now is None else now * PERIOD)
        except Refusal as refusal:
            return refusal.fault
        return None


def test_messages_in_order_are_obeyed():
    air = Air()
    assert [air.say(step) for step in range(50)] == [None] * 50


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_numbers_that_are_none_are_refused(value, place):
    values = [*VALUES]
    values[place] = value
    assert Air().say(0, values) == Fault.NOT_FINITE


def test_a_deflection_beyond_the_stops_is_refused():
    assert Air().say(0, (0.0, -2.0, 0.0)) == Fault.OUT_OF_RANGE


def test_repeated_and_late_messages_are_refused():
    air = Air()
    assert air.say(5) is None
    assert air.say(5) == Fault.DUPLICATE
    assert air.say(4) == Fault.OUT_OF_ORDER
    assert air.say(6) is None


def test_stamps_far_from_the_newest_state_are_refused_in_real_time():
    limit = STALE // PERIOD
    assert Air().say(100, now=100 + limit) is None
    assert Air().say(100, now=100 + limit + 1) == Fault.STALE
    assert Air().say(100, now=100 - limit) is None
    assert Air().say(100, now=100 - limit - 1) == Fault.WRONG_STAMP
    assert Air(realtime=False).say(100, now=0) is None  # in lockstep history comes late


def test_a_stamp_between_two_steps_is_refused():
    guard = Air().guard
    with pytest.raises(Refusal) as refusal:
        guard.read(LAYOUT.encode(3, VALUES), FIRST, None)
    assert refusal.value.fault == Fault.WRONG_STAMP


def test_other_bytes_are_refused():
    foreign = NamedVector(LAYOUT.frame, ["one", "two", "three"]).encode(0, VALUES)
    with pytest.raises(Refusal) as refusal:
        Air().guard.read(foreign, FIRST, None)
    assert refusal.value.fault == Fault.MALFORMED


@given(st.lists(st.sampled_from([FIRST, TWIN]), min_size=1), st.booleans())
def test_a_twin_is_never_obeyed_while_the_first_is_there(order, realtime):
    """Whoever is first, whoever's turn it is, and though both started with the flight."""
    air = Air(realtime)
    air.publishers = [TWIN, FIRST]
    first = order[0]
    for step, by in enumerate(order):
        air.time += PERIOD
        expected = None if by == first else Fault.SECOND_PUBLISHER
        assert air.say(2 * step, now=2 * step, by=by) == expected
        if by != first:
            assert air.say(2 * step, now=2 * step, by=first) is None


def test_another_publisher_takes_over_after_a_silence():
    air = Air()
    assert air.say(0, now=0) is None
    air.time = SILENCE
    assert air.say(10, now=10, by=TWIN) == Fault.SECOND_PUBLISHER
    air.time = SILENCE + 1
    assert air.say(11, now=11, by=TWIN) is None
    assert air.say(12, now=12) == Fault.SECOND_PUBLISHER  # the first one has lost its turn


def test_in_lockstep_another_publisher_takes_over_when_the_first_has_left():
    air = Air(realtime=False)
    assert air.say(0) is None
    air.time, air.publishers = 100 * SILENCE, [TWIN, FIRST]
    assert air.say(1, by=TWIN) == Fault.SECOND_PUBLISHER
    air.publishers = [TWIN]
    assert air.say(1, by=TWIN) is None


def test_a_publisher_of_which_much_was_lost_is_still_itself():
    air = Air()
    assert air.say(0, now=0) is None
    assert air.say(90, now=90) is None


def test_what_a_publisher_says_wrongly_does_not_make_it_the_one_that_is_obeyed():
    air = Air()
    assert air.say(0, (math.nan, 0.0, 0.0), by=TWIN) == Fault.NOT_FINITE
    assert air.say(0) is None
    assert air.say(1, by=TWIN) == Fault.SECOND_PUBLISHER


class Steps:
    """Real-time steps with two inputs beside the state, and what came of them."""

    def __init__(self, wait=True):
        self.answers = []
        self.missing = []
        self.steps = RealTimeSteps(
            ("state", "a", "b"),
            lambda stamp, *values: self.answers.append((stamp // PERIOD, *values)),
            {"a": lambda last, age: ("a held", last, age), "b": lambda last, age: None},
            lambda stamp, name: self.missing.append((stamp // PERIOD, name)),
            wait,
        )

    def put(self, *names, step):
        for name in names:
            self.steps.put(name, step * PERIOD, (name, step))


def test_a_step_is_answered_when_its_inputs_are_there():
    steps = Steps()
    steps.put("a", "state", "b", step=0)
    steps.put("state", "b", "a", step=1)
    state = ("state", 0), ("a", 0), ("b", 0)
    assert steps.answers == [(0, *state), (1, ("state", 1), ("a", 1), ("b", 1))]
    assert steps.missing == []


def test_a_lost_input_costs_one_step_and_is_waited_for_again_when_it_is_in_time():
    steps = Steps()
    steps.put("state", "a", "b", step=0)
    steps.put("state", "b", step=1)  # a has died
    steps.put("state", "b", step=2)
    assert steps.answers[1:] == [(2, ("state", 2), ("a held", ("a", 0), 2), ("b", 2))]
    steps.put("a", step=1)  # too late to be waited for
    steps.put("state", "b", step=3)
    assert steps.answers[2:] == [(3, ("state", 3), ("a held", ("a", 1), 2), ("b", 3))]
    steps.put("a", step=3)
    steps.put("state", "b", step=4)
    assert len(steps.answers) == 3
    steps.put("a", step=4)
    assert steps.answers[3:] == [(4, ("state", 4), ("a", 4), ("b", 4))]


def test_an_input_that_never_came_has_no_last_values():
    steps = Steps()
    steps.put("state", "b", step=0)
    steps.put("state", "b", step=1)
    assert steps.answers == [(1, ("state", 1), ("a held", None, 0), ("b", 1))]


def test_without_waiting_a_step_is_answered_with_what_is_there():
    steps = Steps(wait=False)
    steps.put("a", "state", step=0)
    steps.put("a", "b", "state", step=1)
    assert steps.answers == [
        (0, ("state", 0), ("a", 0), None),
        (1, ("state", 1), ("a", 1), ("b", 1)),
    ]
    assert steps.missing == [(0, "b")]


def test_limits_are_in_the_order_that_the_responses_say():
    assert PERIOD < STALE <= HOLD


def test_every_fault_says_who_notices_what_is_done_and_when():
    rows = fault_rows()
    assert len({row[0] for row in rows}) == len(rows)
    for row in rows:
        assert all(row), row
