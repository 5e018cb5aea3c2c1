# Copyright 2026 ahv developers, Apache-2.0
"""The documents say what the code says: parts written from it are up to date, and true."""

import re
from pathlib import Path

import pytest
import rclpy

from ahv_analysis.equation_index import cited, equation_rows
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.reference import MARKED, PARTS, filled
from ahv_analysis.report.figures import (
    CAMPAIGN_3,
    CAMPAIGN_4,
    CAMPAIGN_5,
    CHAPTER_3,
    CHAPTER_4,
    CHAPTER_5,
)
from ahv_msgs_py.graph import NODES, listeners, sender
from ahv_msgs_py.topics import BY_NAME, LOOP_TOPICS, QUEUE_DEPTH
from test.waiting import wait_until

ROOT = Path(__file__).parent.parent
PAGES = [path for path in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_a_page_is_what_the_code_makes_of_it(path):
    text = path.read_text()
    assert text == filled(text), "run python -m ahv_analysis.reference"
    assert text.count("<!-- reference ") == len(MARKED.findall(text)), "a mark has no end"


def test_every_part_is_asked_for():
    asked = {name for path in PAGES for name, _ in MARKED.findall(path.read_text())}
    assert asked == set(PARTS)


def test_a_citation_is_read_with_its_ranges():
    assert cited("eqs 4.3-4.5 and 5.11, as eq 2.3") == {(4, 3), (4, 4), (4, 5), (5, 11), (2, 3)}
    assert cited("eqs 2.1, 2.3-2.4, and 2.6\n    # eq 3.1.") == {
        (2, 1),
        (2, 3),
        (2, 4),
        (2, 6),
        (3, 1),
    }
    assert not cited("section 4.2, Table 5.1")


def test_eq_4_13_is_found_where_it_is_built_and_tested():
    rows = {row[0]: row for row in equation_rows(ROOT)}
    assert rows["4.13"][1].startswith("`learning_direction` in ")
    assert "test_learner.py::test_eq_4_13_by_woodbury_equals_the_dense_inverse" in rows["4.13"][2]


def test_every_numbered_figure_and_table_is_found_by_its_name():
    """A figure's number stands in the page, alone or inside a range."""
    page = (ROOT / "docs" / "from_the_report.md").read_text()
    spans = re.findall(r"Figures? (\d)\.(\d+)(?:-\d\.(\d+))?", page)
    named = {f"{c}.{n}" for c, a, b in spans for n in range(int(a), int(b or a) + 1)}
    plates = (CHAPTER_3, CHAPTER_4, CHAPTER_5, CAMPAIGN_3, CAMPAIGN_4, CAMPAIGN_5)
    assert named == {plate.number for chapter in plates for plate in chapter} | {"3.1"}
    assert {"Table 2.1", "Table 5.1"} <= set(re.findall(r"Table \d\.\d", page))


def test_a_part_that_is_not_known_is_an_error():
    with pytest.raises(KeyError, match="weather"):
        filled("<!-- reference weather -->\n<!-- end -->\n")


def test_the_graph_that_flies_is_the_one_that_is_drawn(domain):
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    observer = rclpy.create_node("observer", context=context)
    elsewhere = {name for name, node in NODES.items() if node.own_law}
    drawn = {
        topic: ({sender(name)}, set(listeners(name)) - elsewhere)
        for name, topic in BY_NAME.items()
    }
    seen = {}

    def number(ends):
        return sum(len(senders) + len(hearers) for senders, hearers in ends.values())

    def as_many_as_are_drawn():
        for topic in LOOP_TOPICS:
            senders = {end.node_name for end in observer.get_publishers_info_by_topic(topic.name)}
            ends = observer.get_subscriptions_info_by_topic(topic.name)
            seen[topic] = (senders, {end.node_name for end in ends})
        return number(seen) >= number(drawn)

    def look(steps):  # and the flight waits: of its ends the observer hears by and by
        wait_until(as_many_as_are_drawn, "the observer knows of all ends")

    try:
        case = load_case(
            "neuro_adaptive_di", {"duration": 1.0}, hardware="typical", profile="altitude_step"
        )
        fly_graph(case, None, domain=domain, progress=look)
    finally:
        observer.destroy_node()
        rclpy.shutdown(context=context)
    assert seen == drawn


@pytest.mark.parametrize("name", ["messages.md", "your_own_controller.md"])
def test_the_depth_of_queues_is_the_one_that_is_written(name):
    assert f"{QUEUE_DEPTH:,}".replace(",", " ") in (ROOT / "docs" / name).read_text()
