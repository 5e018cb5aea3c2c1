# Copyright 2026 ahv developers, Apache-2.0
"""What all tests share: a private ROS domain, repeatable random examples, what may be absent."""

import itertools
import os
import sys
from importlib.util import find_spec

import pytest

from ahv_msgs_py.node.network import keep_to_this_machine
from test.browsing import browser, visit  # noqa: F401  fixtures

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
keep_to_this_machine()
if find_spec("hypothesis"):
    from hypothesis import HealthCheck, settings

    settings.register_profile(
        "ahv",
        deadline=None,
        derandomize=True,
        print_blob=False,
        suppress_health_check=[HealthCheck.too_slow],  # it goes by the clock of a busy machine
    )
    settings.load_profile("ahv")

# Packages that only tests need and rosdep may not bring: what imports one that is absent is
# skipped, a whole file or a test; the summary counts them by package.
FOR_TESTS = (
    "ament_flake8",
    "ament_pep257",
    "axe_playwright_python",
    "catkin_pkg",
    "control",
    "distributed",
    "hypothesis",
    "markdown_it",
    "mcap_ros2",
    "mpmath",
    "playwright",
)


class Absent:
    """Last of the finders: asked only for what no other has found."""

    @staticmethod
    def find_spec(name, path=None, target=None):
        if name in FOR_TESTS:
            pytest.skip(f"{name} is not installed", allow_module_level=True)


sys.meta_path.append(Absent)
WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])  # tests run in two processes
os.environ["ROS_DOMAIN_ID"] = str(99 + WORKER)  # of graphs that are not given a domain
_domains = itertools.count(os.getpid())


def pytest_collection_modifyitems(items):
    """Take a test without a mark for one of the graph: it may start what it likes."""
    for item in items:
        if not any(map(item.get_closest_marker, ("unit", "docs"))):
            item.add_marker(pytest.mark.graph)


def unused_domain():
    """A ROS domain that no other test of this run uses (above 101 ports are not safe)."""
    return 1 + (2 * next(_domains) + WORKER) % 98


@pytest.fixture
def domain():
    """The ROS domain of a test."""
    return unused_domain()


@pytest.fixture
def other_domain():
    """And one for what it has beside that: the next number is the other process's."""
    return unused_domain()
