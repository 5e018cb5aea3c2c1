# Copyright 2026 ahv developers, Apache-2.0
"""The documents say what the code says: parts written from it are up to date, and true."""

from pathlib import Path

import pytest
import rclpy

from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.reference import MARKED, PARTS, filled
from ahv_msgs_py.graph import listeners, sender
from ahv_msgs_py.topics import BY_NAME, LOOP_TOPICS, QUEUE_DEPTH

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


def test_a_part_that_is_not_known_is_an_error():
    with pytest.raises(KeyError, match="weather"):
        filled("<!-- reference weather -->\n<!-- end -->\n")


def test_the_graph_that_flies_is_the_one_that_is_drawn(domain):
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    observer = rclpy.create_node("observer", context=context)
    seen = {}

    def look(steps):
        for topic in LOOP_TOPICS:
            senders = {end.node_name for end in observer.get_publishers_info_by_topic(topic.name)}
            ends = observer.get_subscriptions_info_by_topic(topic.name)
            seen[topic] = (senders, {end.node_name for end in ends})

    try:
        case = load_case("neuro_adaptive_di", {"duration": 60.0})
        fly_graph(case, None, domain=domain, progress=look)
    finally:
        observer.destroy_node()
        rclpy.shutdown(context=context)
    assert seen == {
        topic: ({sender(name)}, set(listeners(name))) for name, topic in BY_NAME.items()
    }


@pytest.mark.parametrize("name", ["messages.md", "your_own_controller.md"])
def test_the_depth_of_queues_is_the_one_that_is_written(name):
    assert f"{QUEUE_DEPTH:,}".replace(",", " ") in (ROOT / "docs" / name).read_text()
