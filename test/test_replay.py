# Copyright 2026 ahv developers, Apache-2.0
"""A bag replays to the same bits; what differs is named; nobody else hears a replay."""

import json
import math
import random
import runpy
import shutil
import sys
from types import ModuleType, SimpleNamespace

import pytest
import rclpy
import yaml
from PIL import Image
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState

from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.command.app import app
from ahv_analysis.errors import BagError, GraphError
from ahv_analysis.flight.case import case_names, load_case, notes
from ahv_analysis.flight.library import fly_library
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.replay.inputs import read_recording
from ahv_analysis.replay.replay import answers, replay
from ahv_analysis.replay.result import total
from ahv_control.inner_loop_node import InnerLoopNode
from ahv_control.outer_intermediate_node import OuterIntermediateNode
from ahv_msgs_py.graph import NODES, controllers
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.topics import (
    LEARNER_TOPICS,
    LOOP_TOPICS,
    NOMINAL_TOPICS,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
)
from test.test_messages import message_of
from test.test_packaging import ROOT, Noted
from test.waiting import PATIENCE

SECONDS = 3.0
STEPS = 301
ADAPTIVE = "neuro_adaptive_di_protected"


def again(bag, case, **options):
    """Totals of a replay of all controllers of a case."""
    flown = replay(read_recording(bag), case, case.controllers, **options)
    return total(flown.comparisons) | {"skipped": flown.skipped}


@pytest.fixture
def ahv(capfd):
    """Run the command in this process; its exit code and what it printed."""

    def run(*arguments):
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            app([str(argument) for argument in arguments])
        printed = capfd.readouterr()
        return SimpleNamespace(exit_code=ended.value.code, stdout=printed.out, stderr=printed.err)

    return run


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """Bags of every case, flown in the library."""
    folder = tmp_path_factory.mktemp("bags")
    for name in case_names():
        fly_library(load_case(name, {"duration": SECONDS}), folder / name)
    return folder


@pytest.fixture
def changed_case(tmp_path):
    """Write the file of a case with one parameter multiplied."""

    def write(name, node, parameter, factor):
        value = load_case(name).parameters[node.rpartition("/")[2]][parameter]
        given = {"/**": {"base": name}, node: {parameter: factor * value}}
        content = {section: {"ros__parameters": values} for section, values in given.items()}
        file = tmp_path / "changed.yaml"
        file.write_text(yaml.safe_dump(content))
        return file

    return write


@pytest.mark.parametrize("name", case_names())
def test_every_case_replays_to_the_same_bits(name, bags):
    case = load_case(name)
    topics = NOMINAL_TOPICS + (LEARNER_TOPICS if case.control.learner else ())
    result = again(bags / name, case)
    assert result["compared"] == STEPS * (len(topics) - 1)
    assert result["differences"] == result["missing"] == result["unrecorded"] == 0
    assert not any(result["skipped"].values())
    assert result["first"] is result["largest"] is None


def test_a_flight_on_the_graph_replays_and_at_a_chosen_rate(tmp_path, domain):
    case = load_case(ADAPTIVE, {"duration": 1.0})
    fly_graph(case, tmp_path / "bag", domain=domain)
    for rate in (None, 20.0):
        result = again(tmp_path / "bag", case, rate=rate, domain=domain)
        assert (result["compared"], result["differences"]) == (101 * 6, 0)


@pytest.mark.parametrize(
    "node, parameter, topic, field, time_s",
    [
        ("outer_intermediate", "k_theta", "rate_command", "Q", 0.0),
        ("disturbance_learner", "gamma", "learner", "X_a.P", 0.01),
        ("inner_loop", "k_ad_Q", "surface_command", "right_elevon", 0.01),
        ("velocity", "k_u", "throttle_command", "throttle", 0.0),
    ],
)
def test_one_percent_of_one_gain_is_found(
    ahv, bags, changed_case, node, parameter, topic, field, time_s
):
    file = changed_case(ADAPTIVE, f"/**/{node}", parameter, 1.01)
    result = ahv("replay", bags / ADAPTIVE, "--parameters", file, "--json")
    found = json.loads(result.stdout)
    first = found["first"]
    assert result.exit_code == 1
    assert (first["node"], first["topic"], first["time_s"]) == (node, f"/ahv/{topic}", time_s)
    assert first["field"] == field
    assert first["difference"] == first["replayed"] - first["recorded"] != 0.0
    assert abs(found["largest"]["difference"]) >= abs(first["difference"])
    for name, counts in found["nodes"].items():  # others hear recorded inputs
        assert (counts["differences"] > 0) == (name == node), name


def at(stamp, node_type, method, parameters):
    """Let a node change its parameters after it has answered a stamp."""
    answer = getattr(node_type, method)

    def patched(self, now, *inputs):
        answer(self, now, *inputs)
        if now == stamp:
            given = [Parameter(name, value=value) for name, value in parameters.items()]
            assert all(result.successful for result in self.set_parameters(given))

    return node_type, method, patched


def test_parameters_changed_in_flight_are_changed_at_the_same_step(tmp_path, domain, monkeypatch):
    case = load_case("nominal_di", {"duration": 2.0})
    climb = {"altitude": 24500.0, "k_h": 0.1 / 3}
    with monkeypatch.context() as flight:
        flight.setattr(*at(500_000_000, OuterIntermediateNode, "_answer", climb))
        flight.setattr(*at(1_230_000_000, InnerLoopNode, "_answer_nominal", {"k_ad_P": 4.0}))
        flight.setattr(*at(1_230_000_000, OuterIntermediateNode, "_answer", {"altitude": 24e3}))
        fly_graph(case, tmp_path / "bag", domain=domain)
    recording = read_recording(tmp_path / "bag")
    assert [change.stamp for change in recording.changes] == [510_000_000, *[1_240_000_000] * 2]
    assert recording.changes[0].values == climb
    assert again(tmp_path / "bag", case)["differences"] == 0
    names = case.controllers
    first = total(replay(recording._replace(changes=[]), case, names).comparisons)["first"]
    assert (first["node"], first["time_s"]) == ("outer_intermediate", 0.51)


def loop_messages(path):
    """Topic, type and bytes of the loop's messages of a bag."""
    names = {topic.name for topic in LOOP_TOPICS}
    with Reader(path) as reader:
        for connection, _, data in reader.messages():
            if connection.topic in names:
                yield connection.topic, connection.msgtype, data


def rewrite(source, target, keep, case):
    """Write the messages of a bag for which `keep(topic, number)` holds into another."""
    bag = BagWriter(target, "" if case is None else notes(case))
    for number, (topic, _, data) in enumerate(loop_messages(source)):
        if keep(topic, number):
            bag.write(topic, data)
    bag.close()


def foreign(source, target):
    """Record a bag as `ros2 bag record -s mcap --max-bag-size` would have.

    Filed by the time of arrival, which has nothing to do with the stamps, in an order that mixes
    topics and steps, in two files; the messages are of senders that serialize in their own way.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    by_name = {topic.name: topic for topic in LOOP_TOPICS}
    messages = list(loop_messages(source))
    order = random.Random(1)
    arrivals = sorted(range(len(messages)), key=lambda number: number + order.uniform(0, 40))
    half = len(arrivals) // 2
    target.mkdir()
    content = None
    for part, numbers in enumerate((arrivals[:half], arrivals[half:])):
        folder = target.parent / f"{target.name}_{part}"
        with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            links = {}
            for number in numbers:
                name, type_name, data = messages[number]
                if name not in links:
                    links[name] = writer.add_connection(name, type_name, typestore=store)
                message = message_of(by_name[name], *by_name[name].layout.decode(data))
                message.header.frame_id = ""
                arrival = 1_700_000_000_000_000_000 + number
                writer.write(links[name], arrival, serialize_message(message))
        file = f"{target.name}_{part}.mcap"
        shutil.move(folder / file, target / file)
        found = yaml.safe_load((folder / "metadata.yaml").read_text())
        content = content or found
    information, last = (tree["rosbag2_bagfile_information"] for tree in (content, found))
    for key in ("relative_file_paths", "files"):
        information[key] += last[key]
    information["message_count"] += last["message_count"]
    (target / "metadata.yaml").write_text(yaml.safe_dump(content))


def test_a_bag_of_the_stock_recorder_replays(ahv, bags, tmp_path):
    foreign(bags / ADAPTIVE, tmp_path / "foreign")
    result = ahv("replay", tmp_path / "foreign")
    assert result.exit_code == 2
    assert "does not say with which parameters it was flown" in result.stderr
    found = again(tmp_path / "foreign", load_case(ADAPTIVE))
    assert (found["compared"], found["differences"], found["missing"]) == (STEPS * 6, 0, 0)


def test_an_adaptive_controller_is_tried_on_a_nominal_flight(bags):
    case = load_case("neuro_adaptive_di")
    flown = replay(read_recording(bags / "nominal_di"), case, case.controllers)
    by_topic = {entry.topic: entry for entry in flown.comparisons}
    for topic in LEARNER_TOPICS:  # heard by the inner loop, and compared with nothing
        assert len(flown.answers[topic].stamps) == STEPS
        assert not by_topic[topic.name].in_bag and not by_topic[topic.name].compared
    assert by_topic[SURFACE_COMMAND.name].differences > 0


def test_steps_without_all_inputs_are_skipped_and_counted(ahv, bags, tmp_path):
    lost = {SURFACE_COMMAND.name: (100, 101, 250)}
    counts = dict.fromkeys((topic.name for topic in LOOP_TOPICS), -1)

    def keep(topic, _):
        counts[topic] += 1
        return counts[topic] not in lost.get(topic, ())

    case = load_case(ADAPTIVE)
    rewrite(bags / ADAPTIVE, tmp_path / "bag", keep, case)
    result = ahv("replay", tmp_path / "bag", "--json")
    found = json.loads(result.stdout)
    skipped = {name: counts["skipped_steps"] for name, counts in found["nodes"].items()}
    assert skipped == dict.fromkeys(skipped, 0) | {"velocity": 3, "disturbance_learner": 3}
    differing = {name for name, counts in found["nodes"].items() if counts["differences"]}
    assert differing == {"disturbance_learner"}  # which has missed lessons
    assert found["unrecorded"] == 3  # surface commands
    table = ahv("replay", tmp_path / "bag", "--node", "velocity")
    assert table.exit_code == 0
    assert "All 298 commands are alike to the last bit." in table.stdout
    assert "Steps skipped because inputs are missing in the bag: velocity 3." in table.stdout


def test_messages_that_no_receiver_obeys_are_refused(bags, tmp_path):
    case = load_case("nominal_di")
    bag = BagWriter(tmp_path / "bag", notes(case))
    for topic, _, data in loop_messages(bags / "nominal_di"):
        bag.write(topic, data)
        bag.write(topic, data)
    bag.write(STATE.name, STATE.layout.encode(3_010_000_000, (math.nan,) * 13))
    bag.write(STATE.name, b"\x00\x01\x00\x00" + bytes(9))
    bag.close()
    recording = read_recording(tmp_path / "bag")
    assert recording.refused == STEPS * len(NOMINAL_TOPICS) + 2
    assert again(tmp_path / "bag", case)["differences"] == 0


def test_a_node_that_falls_silent_is_missing_its_commands(ahv, bags, monkeypatch):
    law = "ahv_control.velocity_node.throttle_command"
    monkeypatch.setattr(law, lambda *arguments: math.nan)
    result = ahv("replay", bags / "nominal_di", "--json")
    found = json.loads(result.stdout)
    assert result.exit_code == 1
    assert (found["differences"], found["missing"]) == (0, STEPS)
    assert found["nodes"]["velocity"]["missing"] == STEPS


def test_a_node_that_stops_is_reported(bags, monkeypatch):
    monkeypatch.setattr("ahv_analysis.replay.replay.LONGEST_SILENCE", 2.0)
    monkeypatch.setattr("ahv_control.velocity_node.VelocityNode._answer", lambda *arguments: None)
    with pytest.raises(GraphError, match="100 commands up to 1 s have not come"):
        again(bags / "nominal_di", load_case("nominal_di"))


@pytest.fixture
def neighbour(domain):
    """A node of somebody else in the same ROS domain."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("neighbour", context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_nobody_hears_a_replay_and_it_hears_nobody(bags, neighbour, domain):
    heard = []
    for topic in LOOP_TOPICS:
        kind = message_class(topic.layout.type_name)
        for prefix in ("", "/replay"):
            name = prefix + topic.name
            neighbour.create_subscription(kind, name, heard.append, quality(True), raw=True)
    publisher = neighbour.create_publisher(JointState, STATE.name, quality(True))
    publisher.publish(STATE.layout.encode(0, (1.0,) * 13))
    case = load_case("nominal_di")
    assert again(bags / "nominal_di", case, domain=domain)["differences"] == 0
    executor = rclpy.executors.SingleThreadedExecutor(context=neighbour.context)
    executor.add_node(neighbour)
    for _ in range(20):
        executor.spin_once(timeout_sec=0.01)
    executor.shutdown()
    assert len(heard) == 1  # its own message


def test_a_replay_to_be_watched_does_not_speak_into_a_flight(bags, neighbour, domain, monkeypatch):
    neighbour.create_publisher(JointState, SURFACE_COMMAND.name, quality(True))
    monkeypatch.setattr("ahv_analysis.replay.replay.LISTEN", PATIENCE)
    with pytest.raises(GraphError, match=r"somebody publishes /ahv/surface_command in this ROS"):
        again(bags / "nominal_di", load_case("nominal_di"), rate=100.0, domain=domain)


@pytest.mark.parametrize("name", controllers(adaptive=True))
def test_nodes_publish_what_a_replay_takes_from_them(name, domain):
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = NODES[name].node_class(load_case(ADAPTIVE).parameters[name], context)
    node.bring_up()
    loop = {topic.name for topic in LOOP_TOPICS}
    published = {publisher.topic_name for publisher in node.publishers} & loop
    node.destroy_node()
    rclpy.shutdown(context=context)
    assert published == {topic.name for topic in answers(name)}


def test_a_table_for_people(ahv, bags):
    result = ahv("replay", bags / "nominal_di", "--node", "inner_loop", "--node", "velocity")
    assert result.exit_code == 0
    assert "All 602 commands are alike to the last bit." in result.stdout
    assert "outer_intermediate" not in result.stdout
    result = ahv("replay", bags / "nominal_di", "--parameters", ADAPTIVE)
    assert result.exit_code == 1
    assert "commands differ, first at 0 s: Q on /ahv/rate_command was " in result.stdout
    assert "Not in the bag" in result.stdout


def test_figures_show_every_replayed_command(ahv, bags, tmp_path):
    out = tmp_path / "figures"
    arguments = ("--node", "outer_intermediate", "--parameters", "nominal_di", "--out", out)
    found = json.loads(ahv("replay", bags / ADAPTIVE, *arguments, "--json").stdout)
    commands = ("attitude", "rate")
    expected = [f"figure_{name}_command.{kind}" for name in commands for kind in ("png", "svg")]
    assert sorted(path.name for path in out.iterdir()) == sorted(expected)
    assert len(found["figures"]) == len(expected)
    with Image.open(out / "figure_rate_command.png") as image:
        assert image.size[0] > 1000 and len(image.convert("RGB").getcolors(1_000_000)) > 50


def test_a_bag_that_lacks_a_topic_is_named(ahv, bags, tmp_path):
    case = load_case(ADAPTIVE)
    for topic in (RATE_COMMAND, *LEARNER_TOPICS, STATE):
        target = tmp_path / topic.name.rpartition("/")[2]
        rewrite(
            bags / ADAPTIVE,
            target,
            lambda name, _, lost=topic: name != lost.name,
            load_case(ADAPTIVE),
        )
        result = ahv("replay", target)
        assert result.exit_code == 2
        assert f"{target} holds no messages on {topic.name}, without which" in result.stderr
        assert result.stderr.strip().count("\n") == 0
    assert ahv("replay", tmp_path / "rate_command", "--node", "velocity").exit_code == 0
    rewrite(bags / ADAPTIVE, tmp_path / "empty", lambda *_: False, case)
    assert "holds no messages on" in ahv("replay", tmp_path / "empty").stderr
    with pytest.raises(BagError, match="is not a bag"):
        read_recording(tmp_path)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ([], "is not a bag: a bag is a folder with a metadata.yaml"),
        (["--node", "plant"], "--node is 'plant', but the controllers of nominal_di are outer_"),
        (["--node", "disturbance_learner"], "the controllers of nominal_di are outer_"),
        (["--rate", "0"], "--rate is 0, but must be above 0"),
        (["--rate", "inf"], "--rate is inf, but must be above 0"),
        (["--parameters", "typo.yaml"], "case 'typo.yaml' is neither a YAML file nor one of"),
    ],
)
def test_wrong_input_is_named(ahv, bags, tmp_path, arguments, words):
    result = ahv("replay", bags / "nominal_di" if arguments else tmp_path, *arguments)
    assert result.exit_code == 2
    assert words in result.stderr and result.stderr.strip().count("\n") == 0


@pytest.fixture
def launch(monkeypatch):
    """The launch file: the command that it runs for given arguments."""
    names = ("launch", "launch.actions", "launch.substitutions", "launch.events.process")
    for name in names:
        module = ModuleType(name)
        module.__getattr__ = lambda _: Noted
        monkeypatch.setitem(sys.modules, name, module)
    description = runpy.run_path(str(ROOT / "launch" / "replay.launch.py"))
    *arguments, start = description["generate_launch_description"]().values[0]
    bag, *optional = arguments
    assert (bag.values, hasattr(bag, "default_value")) == (("bag",), False)  # must be given
    defaults = {argument.values[0]: argument.default_value for argument in optional}
    assert all(argument.description for argument in arguments)

    def run(**given):
        (process,) = start.function(defaults | given)
        context = SimpleNamespace(is_shutdown=False)
        assert process.on_exit(SimpleNamespace(returncode=0), context)
        for code in (1, 2):  # commands that differ, and a replay that was refused
            with pytest.raises(RuntimeError, match=f"the replay ended with exit code {code}"):
                process.on_exit(SimpleNamespace(returncode=code), context)
        return process.cmd

    return run


def test_launch_replays_where_tools_can_watch(launch):
    python, *command = launch(bag="flights/one/bag")
    assert python == sys.executable
    assert command[:4] == ["-P", "-m", "ahv_analysis.command.main", "replay"]
    assert command[4:] == ["flights/one/bag", "--rate", "1.0"]


def test_launch_hands_its_arguments_on(ahv, launch, bags, tmp_path):
    nodes, out = "velocity", tmp_path / "figures"
    *_, replay_word, bag = launch(bag="b", rate="")
    assert (replay_word, bag) == ("replay", "b")
    command = launch(
        bag=str(bags / "nominal_di"), nodes=nodes, parameters="nominal_di", rate="", out=str(out)
    )
    result = ahv(*command[4:])
    assert result.exit_code == 0
    assert "All 301 commands are alike" in result.stdout
    assert len(list(out.iterdir())) == 2
