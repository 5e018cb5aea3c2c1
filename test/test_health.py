# Copyright 2026 ahv developers, Apache-2.0
"""A node's report counts its faults, times its answers and names the gravest level."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.health import ERROR, OK, WARN, Health, percentile

pytestmark = pytest.mark.unit

MS = 1_000_000  # [ns]


class Clock:
    """A steady clock that stands still unless moved."""

    now = 0

    def __call__(self):
        return self.now


@given(st.lists(st.integers(0, 10**9), min_size=1), st.sampled_from([0.0, 0.5, 0.9, 0.99, 1.0]))
def test_a_percentile_is_the_least_value_that_so_many_do_not_exceed(values, share):
    found = percentile(sorted(values), share)
    assert sum(value <= found for value in values) >= share * len(values) - 1e-6
    below = [value for value in values if value < found]
    assert len(below) < max(1, share * len(values) + 1e-6)


def test_a_quiet_node_is_healthy():
    assert Health(Clock()).report() == (OK, "healthy", {})


def test_answers_are_timed_from_their_states():
    clock = Clock()
    health = Health(clock)
    for latency in (1, 2, 3, 10):
        health.state_came()
        clock.now += latency * MS
        health.answered()
    clock.now = 40 * MS
    _, _, facts = health.report()
    assert facts["rate_hz"] == "100.0"
    assert facts["latency_ms_p50"] == "2.500"
    assert facts["latency_ms_p99"] == facts["latency_ms_max"] == "10.000"


def test_faults_are_counted_in_the_window_and_in_all():
    health = Health(Clock())
    assert health.count(Fault.LATE)
    assert not health.count(Fault.LATE, 2)
    assert health.report() == (WARN, "late: 3", {"late": "3"})
    assert health.report() == (OK, "healthy", {"late": "3"})
    assert health.count(Fault.COMMAND_LOST)
    level, text, facts = health.report()
    assert (level, text) == (ERROR, "command lost: 1")
    assert facts == {"late": "3", "command_lost": "1"}


def test_the_largest_of_a_value_is_kept_for_one_report():
    health = Health(Clock())
    for value in (0.1, 0.3, 0.2):
        health.extreme("observer_error", value)
    assert health.report()[2] == {"observer_error": "0.3"}
    assert health.report()[2] == {}
