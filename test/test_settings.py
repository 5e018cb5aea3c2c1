# Copyright 2026 ahv developers, Apache-2.0
"""What nodes tell of their settings makes the notes of a bag, however they were started."""

import json
from pathlib import Path

import pytest
import yaml

from ahv_analysis.bag.notes import told_notes, told_of
from ahv_analysis.bag.recorder_node import completed
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_msgs_py.layout import MessageError, text_bytes, text_of
from ahv_msgs_py.topics import FLIGHT, LOOP_TOPICS, QUEUE_DEPTH, VIEWER_TOPICS
from ahv_plant.plant_node import static_transforms
from test.test_replay import ahv  # noqa: F401  the command in this process

ROOT = Path(__file__).parent.parent


def test_a_flight_of_nodes_alone_is_replayed_by_what_they_told(
    tmp_path,
    domain,
    monkeypatch,
    ahv,  # noqa: F811
    capfd,
):
    """As one that was launched, or whose nodes were started by hand."""
    monkeypatch.setattr("ahv_analysis.flight.one_process.notes", lambda case: "")
    case = load_case("neuro_adaptive_di", {"duration": 1.0})
    fly_graph(case, tmp_path / "bag", domain=domain)
    told = json.loads(ahv("bag", "info", tmp_path / "bag", "--json").stdout)
    assert told["case"] == "unnamed" and told["planned_s"] == 1.0
    flown = {name: case.parameters[name] for name in ("plant", *case.controllers)}
    flown["plant"] |= {"listeners": 5}
    assert told["notes"]["parameters"] == flown
    assert "numba" in told["notes"]["versions"]
    result = json.loads(ahv("replay", tmp_path / "bag", "--json").stdout)
    assert (result["compared"], result["differences"]) == (6 * 101, 0)


def test_a_bag_of_the_stock_recorder_is_replayed_by_what_it_holds_of_settings(
    tmp_path,
    domain,
    monkeypatch,
    ahv,  # noqa: F811
):
    """As rosbag2 makes one: every topic, and no notes of anybody."""
    monkeypatch.setattr("ahv_analysis.flight.one_process.notes", lambda case: "")
    monkeypatch.setattr(BagWriter, "annotate", lambda self, notes: None)
    case = load_case("nominal_di", {"duration": 1.0})
    fly_graph(case, tmp_path / "bag", domain=domain, namespace="/uav1")
    assert "ahv: ''" in (tmp_path / "bag" / "metadata.yaml").read_text()
    told = json.loads(ahv("bag", "info", tmp_path / "bag", "--json").stdout)
    assert (told["case"], told["planned_s"]) == ("unnamed", 1.0)
    result = json.loads(ahv("replay", tmp_path / "bag", "--json").stdout)
    assert (result["compared"], result["differences"]) == (4 * 101, 0)


def test_of_two_settings_of_a_node_the_later_stands_and_strangers_are_passed_over():
    def said(node, **settings):
        return text_bytes(json.dumps({"node": node, "settings": settings}))

    told = [said("plant", duration=1.0), b"hm", said("guest", x=1), said("inner_loop", k_P=2.0)]
    assert told_notes(told[:1]) is None
    assert told_notes([*told, said("plant", duration=2.0)]).parameters == {
        "plant": {"duration": 2.0},
        "inner_loop": {"k_P": 2.0},
    }


def test_what_is_noted_is_not_told_again():
    noted = {"case": "mine", "versions": {}, "parameters": {"plant": {"duration": 2.0}}}
    told = {"plant": {"duration": 3.0}, "velocity": {"speed": 1800.0}}
    content = json.loads(completed(json.dumps(noted), told))
    assert content == noted | {"parameters": told | noted["parameters"]}
    for text in ("with love", "[1, 2]", "7"):
        assert completed(text, told) == text
    assert json.loads(completed("", told))["case"] == "unnamed"


@pytest.mark.parametrize(
    "data", [b"", b"\0\1\0\0", text_bytes("hm"), text_bytes('{"node": "plant"}'), text_bytes("[]")]
)
def test_what_is_no_setting_is_refused(data):
    with pytest.raises(MessageError):
        told_of(data)


def test_texts_as_bytes():
    for text in ("", "a", "äöü" * 7):
        assert text_of(text_bytes(text)) == text_of(text_bytes(text) + b"\0\0\0") == text
    with pytest.raises(MessageError):
        text_of(text_bytes("abc")[:-1])


def test_the_stock_recorder_is_told_to_keep_every_topic_of_lockstep():
    """As rosbag2 reads it: rclcpp's names of policies, a profile for every topic."""
    profiles = yaml.safe_load((ROOT / "config" / "rosbag2" / "lockstep_qos.yaml").read_text())
    durable = [topic.name for topic in VIEWER_TOPICS if topic.durable]
    assert set(profiles) == {*durable, FLIGHT.name, *(topic.name for topic in LOOP_TOPICS)}
    for profile in profiles.values():
        policies = ("reliability", "durability", "history", "depth")
        assert tuple(profile) == policies
        assert [profile[name] for name in policies] == [
            "reliable",
            "transient_local",
            "keep_last",
            QUEUE_DEPTH,
        ]


def test_frames_that_do_not_move_are_told_once():
    """REP-103 and REP-105: map is east-north-up, base_link forward-left-up."""
    links = {one.header.frame_id: one.child_frame_id for one in static_transforms(0)}
    assert links == {"map": "map_ned", "base_link_frd": "base_link"}


def test_an_infinite_duration_is_written_as_rosbag2_does(tmp_path):
    """RMW_DURATION_INFINITE of rmw/time.h: 9223372036 s and 854775807 ns, 2^63 - 1 ns in all."""
    BagWriter(tmp_path / "bag").close()
    text = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())
    (topic, *_) = text["rosbag2_bagfile_information"]["topics_with_message_count"]
    (profile,) = topic["topic_metadata"]["offered_qos_profiles"]
    for name in ("deadline", "lifespan", "liveliness_lease_duration"):
        assert profile[name] == {"sec": 9223372036, "nsec": 854775807}
