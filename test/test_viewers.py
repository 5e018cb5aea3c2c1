# Copyright 2026 ahv developers, Apache-2.0
"""The layouts of PlotJuggler and Foxglove show what a real bag holds, by the names that it has."""

import json
import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_msgs_py.config import config_folder
from ahv_plant.model.constants import DEGREES

PLOTJUGGLER = config_folder() / "viewers" / "plotjuggler.xml"
FOXGLOVE = config_folder() / "viewers" / "foxglove.json"
SCRIPT_TOPIC = "/studio_script/air"
# what a message path may end with; of Foxglove's functions those that the layout uses
FUNCTIONS = {"rad2deg"}


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Bag of an adaptive flight on the graph, long enough for every topic."""
    path = tmp_path_factory.mktemp("viewers") / "bag"
    fly_graph(load_case("neuro_adaptive_sc_gdi", {"duration": 0.2}), path)
    return path


def plain(value):
    """Return a message as dictionaries."""
    if not hasattr(value, "__slots__"):
        return value
    return {field: plain(getattr(value, field)) for field in value.__slots__}


@pytest.fixture(scope="module")
def messages(bag):
    """One message of every topic of the bag, read by others' software; empty where it has none."""
    with next(bag.glob("*.mcap")).open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        found = {channel.topic: {} for channel in reader.get_summary().channels.values()}
        for _, channel, _, message in reader.iter_decoded_messages():
            found[channel.topic] = plain(message)
    return found


def leaves(message, prefix):
    """Names that PlotJuggler gives to the numbers of a message: fields joined by slashes.

    A JointState is a special message: its numbers go by the names that it carries.
    """
    if "position" in message and "name" in message:
        assert len(message["name"]) == len(message["position"])
        yield from (f"{prefix}/{name}/position" for name in message["name"])
        return
    for field, value in message.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}/{field}")
        elif isinstance(value, float):
            yield f"{prefix}/{field}"


def unknown_curves(layout, messages):
    """Curves and sources of a PlotJuggler layout that a bag does not have."""
    known = {name for topic, message in messages.items() for name in leaves(message, topic)}
    snippets = layout.findall("customMathEquations/snippet")
    derived = {snippet.get("name") for snippet in snippets}
    curves = {curve.get("name") for curve in layout.iter("curve")}
    sources = {source.text for snippet in snippets for source in snippet.iter("linked_source")}
    sources |= {
        source.text for snippet in snippets for source in snippet.find("additional_sources")
    }
    return (curves - derived - known) | (sources - known) | (derived - curves)


def unknown_paths(layout, messages):
    """Message paths of a Foxglove layout that find no number in a bag, or another one."""
    script = layout["userNodes"]["air"]["sourceCode"]
    outputs = set(re.findall(r"(\w+): number[ ;]", script))
    unknown = set()
    for panel in layout["configById"].values():
        for path in panel.get("paths", []):
            if not finds(path, messages, outputs):
                unknown.add(path["value"])
        topics = {panel["topicToRender"]} if "topicToRender" in panel else set()
        unknown |= (topics | set(panel.get("topics", {}))) - set(messages)
    return unknown


def finds(path, messages, outputs):
    """Whether a path of a plot finds a number, under the label that the bag gives it."""
    if re.fullmatch(r"-?[\d.]+", path["value"]):
        return True  # a line across
    parts = re.fullmatch(r"(/[\w/]+)((?:\.\w+|\[\d+\])+)((?:\.@\w+)*)", path["value"])
    if parts is None:
        return False
    topic, fields, functions = parts.groups()
    if topic == SCRIPT_TOPIC:
        return fields[1:] in outputs
    value = message = messages.get(topic, {})
    for field, index in re.findall(r"\.(\w+)|\[(\d+)\]", fields):
        if field and isinstance(value, dict):
            value = value.get(field)
        elif index and isinstance(value, list) and int(index) < len(value):
            value = value[int(index)]
            if message["name"][int(index)] != path["label"]:
                return False
        else:
            return False
    return isinstance(value, float) and set(re.findall(r"@(\w+)", functions)) <= FUNCTIONS


@pytest.fixture
def plotjuggler():
    return ElementTree.parse(PLOTJUGGLER).getroot()


@pytest.fixture
def foxglove():
    return json.loads(FOXGLOVE.read_text(encoding="utf-8"))


def test_plotjuggler_finds_every_curve(plotjuggler, messages):
    assert len(list(plotjuggler.iter("curve"))) > 30
    assert unknown_curves(plotjuggler, messages) == set()


def test_foxglove_finds_every_path(foxglove, messages):
    assert sum(len(panel.get("paths", ())) for panel in foxglove["configById"].values()) > 30
    assert unknown_paths(foxglove, messages) == set()


def test_a_renamed_state_a_moved_field_or_a_lost_topic_is_noticed(plotjuggler, foxglove, messages):
    names = ["altitude" if name == "h" else name for name in messages["/ahv/state"]["name"]]
    renamed = messages | {"/ahv/state": messages["/ahv/state"] | {"name": names}}
    assert unknown_curves(plotjuggler, renamed) == {"/ahv/state/h/position"}
    assert unknown_paths(foxglove, renamed) == {"/ahv/state.position[11]"}
    lost = {name: message for name, message in messages.items() if name != "/ahv/rate_command"}
    assert len(unknown_curves(plotjuggler, lost)) == len(unknown_paths(foxglove, lost)) == 3
    moved = messages | {"/ahv/attitude_command": messages["/ahv/disturbance_estimate"]}
    assert len(unknown_curves(plotjuggler, moved)) == len(unknown_paths(foxglove, moved)) == 3
    without = {name: message for name, message in messages.items() if name != "/ahv/odometry"}
    assert unknown_paths(foxglove, without) == {"/ahv/odometry"}


def test_plotjuggler_derives_the_angles_that_the_bag_reader_derives(plotjuggler, bag, messages):
    """Its Lua is close enough to Python to be run: `value` and v1, v2 ... are the sources."""
    flown = read_bag(bag)
    expected = {
        "alpha [deg]": flown.air.alpha,
        "beta [deg]": flown.air.beta,
        "gamma [deg]": flown.climb_angle,
    }
    names = messages["/ahv/state"]["name"]
    snippets = plotjuggler.findall("customMathEquations/snippet")
    assert {snippet.get("name") for snippet in snippets} == set(expected)
    for snippet in snippets:
        formula = snippet.findtext("function").removeprefix("return ").replace("^", "**")
        formula = formula.replace("math.deg", "math.degrees")
        sources = {"value": snippet.findtext("linked_source")}
        sources |= {source.tag: source.text for source in snippet.find("additional_sources")}
        rows = zip(flown.states, expected[snippet.get("name")] * DEGREES, strict=True)
        for state, angle in rows:
            values = {
                name: state[names.index(source.split("/")[3])] for name, source in sources.items()
            }
            assert eval(formula, {"math": math} | values) == pytest.approx(angle, abs=1e-9)


def test_foxglove_derives_its_angles_from_states_that_there_are(foxglove, messages):
    script = foxglove["userNodes"]["air"]["sourceCode"]
    assert re.findall(r'inputs = \["(.*)"\]', script) == ["/ahv/state"]
    assert f'output = "{SCRIPT_TOPIC}"' in script
    fields = set(re.findall(r'state\("(\w+)"\)', script))
    assert fields == {"u", "v", "w", "phi", "theta"} <= set(messages["/ahv/state"]["name"])


def test_curves_in_degrees_are_radians_in_the_bag(plotjuggler, foxglove):
    for curve in plotjuggler.iter("curve"):
        options = curve.find("transform/options")
        if options is not None:
            assert float(options.get("value_scale")) == DEGREES
            assert "deg" in curve.find("transform").get("alias")
    for panel in foxglove["configById"].values():
        radians = [path["value"].endswith(".@rad2deg") for path in panel.get("paths", [])]
        if any(radians):
            assert all(radians) and "deg" in panel["foxglovePanelTitle"]


def test_the_view_in_three_dimensions_follows_the_frames_of_the_bag(foxglove, messages):
    view = foxglove["configById"]["3D!view"]
    odometry = messages["/ahv/odometry"]
    assert view["followTf"] == odometry["child_frame_id"]
    assert view["layers"]["grid"]["frameId"] == odometry["header"]["frame_id"]
    assert view["topics"]["/ahv/vehicle_marker"]["visible"]
    marker = messages["/ahv/vehicle_marker"]
    assert marker["header"]["frame_id"] == view["followTf"] and marker["points"]
    assert "/tf" in messages  # where tf2_msgs is installed there are messages, too


def test_every_panel_has_its_place(plotjuggler, foxglove):
    placed = []

    def walk(node):
        if isinstance(node, str):
            placed.append(node)
            for tab in foxglove["configById"][node].get("tabs", []):
                walk(tab["layout"])
        else:
            walk(node["first"])
            walk(node["second"])

    walk(foxglove["layout"])
    assert sorted(placed) == sorted(foxglove["configById"])
    for splitter in plotjuggler.iter("DockSplitter"):
        sizes = [float(size) for size in splitter.get("sizes").split(";")]
        assert len(splitter) == int(splitter.get("count")) == len(sizes)
        assert np.sum(sizes) == pytest.approx(1.0, abs=1e-5)
