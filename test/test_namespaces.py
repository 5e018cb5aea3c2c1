# Copyright 2026 ahv developers, Apache-2.0
"""Two vehicles in one ROS domain, each in a namespace of its own, do not hear each other."""

import json
import multiprocessing

import pytest

from ahv_analysis.bag.reader import read, read_bag
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.one_process import fly_graph
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    CLOCK,
    RATE_COMMAND,
    STATE,
    SURFACE_COMMAND,
    relative,
    within,
)
from test.test_command import ahv as command
from test.test_replay import ahv  # noqa: F401  the command in this process
from test.waiting import PATIENCE

CASES = {"/uav1": "nominal_di", "/fleet/uav2": "neuro_adaptive_di"}


DURATION = {"duration": 5.0}


def fly_one(name, namespace, bag, both):
    both.wait()
    fly_graph(load_case(name, DURATION), bag, namespace=namespace)


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """Bags of two vehicles that flew at once, by namespace."""
    folder = tmp_path_factory.mktemp("fleet")
    spawn = multiprocessing.get_context("spawn")
    both = spawn.Barrier(len(CASES))
    flights = {}
    for number, (namespace, name) in enumerate(CASES.items()):
        bag = folder / str(number)
        process = spawn.Process(target=fly_one, args=(name, namespace, bag, both))
        process.start()
        flights[namespace] = (process, bag)
    for process, _ in flights.values():
        process.join(PATIENCE)  # compiles first, where nobody has
        assert process.exitcode == 0
    return {namespace: bag for namespace, (_, bag) in flights.items()}


@pytest.mark.parametrize("namespace", CASES)
def test_each_flies_the_bits_of_its_flight_alone(bags, namespace):
    alone = list(fly(load_case(CASES[namespace], DURATION)))
    flown = read_bag(bags[namespace])
    assert flown.steps == 500
    assert flown.states.tolist() == [list(step.state) for step in alone]
    assert flown.surfaces.tolist() == [list(step.commands.surfaces) for step in alone]
    assert (flown.learner is None) == (namespace == "/uav1")


@pytest.mark.parametrize("namespace", CASES)
def test_each_has_its_topics_and_its_clock_in_its_bag(bags, namespace):
    bag = read(bags[namespace])
    assert bag.namespace == namespace
    assert f"{namespace}/state" in bag.topics
    assert bag.topics[f"{namespace}/clock"].messages == 501
    assert not {name for name in bag.topics if name.startswith("/ahv/")}


@pytest.mark.parametrize("namespace", CASES)
def test_each_replays_without_a_difference(bags, namespace, ahv):  # noqa: F811
    done = ahv("replay", bags[namespace], "--json")
    result = json.loads(done.stdout)
    assert (done.exit_code, result["differences"], result["missing"]) == (0, 0, 0)
    assert result["compared"] == 501 * (4 if namespace == "/uav1" else 6)


def test_a_difference_is_told_by_the_names_of_the_vehicle(bags, tmp_path, ahv):  # noqa: F811
    """With a case file for nodes of its namespace, which is read as they would read it."""
    other = tmp_path / "other.yaml"
    shared = "/**:\n  ros__parameters:\n    base: nominal_di\n"
    other.write_text(f"{shared}/uav1/velocity:\n  ros__parameters:\n    k_u: 0.02\n")
    done = ahv("replay", bags["/uav1"], "--parameters", other, "--json")
    result = json.loads(done.stdout)
    assert (done.exit_code, result["differences"]) == (1, 501)
    assert result["first"]["topic"] == "/uav1/throttle_command"
    assert result["nodes"]["velocity"]["largest"]["topic"] == "/uav1/throttle_command"


def test_reports_of_both_are_of_their_cases(bags, tmp_path, ahv):  # noqa: F811
    assert ahv("report", *bags.values(), "--out", tmp_path).exit_code == 0
    pages = [path.read_text() for path in sorted(tmp_path.glob("*.html"))]
    assert len(pages) == 3 and all(any(name in page for page in pages) for name in CASES.values())


def write_bag(path, topics, names):
    bag = BagWriter(path, names=names)
    for topic in topics:
        bag.write(topic, bytes(40))
    bag.close()
    return path


def test_a_bag_of_two_vehicles_names_them(tmp_path):
    """As `ros2 bag record --all` makes one; here of the channels of one, renamed."""
    neighbour = {ATTITUDE_COMMAND.name: "/uav1/state", RATE_COMMAND.name: "/uav1/surface_command"}
    state = [STATE.name, SURFACE_COMMAND.name, ATTITUDE_COMMAND.name]
    bag = write_bag(tmp_path / "one", state, neighbour)
    assert read(bag).namespace == "/ahv", "a neighbour that commands nothing is no vehicle"
    bag = write_bag(tmp_path / "two", [*state, RATE_COMMAND.name], neighbour)
    with pytest.raises(BagError, match=r"the flights of 2 vehicles, /ahv and /uav1: record each"):
        read(bag)


def test_names_within_a_namespace():
    assert (relative(STATE.name), relative(CLOCK.name)) == ("state", "/clock")
    assert within("/uav1", STATE.name) == "/uav1/state"
    assert within("/", STATE.name) == "/state"
    assert within("/uav1", CLOCK.name) == "/clock"


@pytest.mark.parametrize("way", [(), ("--processes",)])
def test_the_command_flies_in_a_namespace(way, tmp_path, domain):
    flight = ("fly", "nominal_di", "--duration", 5, "--namespace", "fleet/uav1", *way)
    flown = command(*flight, "--out", tmp_path, ROS_DOMAIN_ID=str(domain))
    assert flown.returncode == 0, flown.stderr
    bag = read(tmp_path / "bag")
    assert bag.namespace == "/fleet/uav1"
    assert not {name for name in bag.topics if name.startswith("/ahv/")}
    alone = [list(step.state) for step in fly(load_case("nominal_di", DURATION))]
    assert read_bag(tmp_path / "bag").states.tolist() == alone
