# Copyright 2026 ahv developers, Apache-2.0
"""The graph flies what the library flies, to the last bit, and leaves nothing behind."""

import threading
from pathlib import Path

import numpy as np
import pytest
import rclpy
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.errors import BagError, GraphError
from ahv_analysis.flight.case import case_names, load_case
from ahv_analysis.flight.library import fly, fly_library
from ahv_analysis.flight.one_process import fly_graph
from ahv_msgs_py.parameters import ParameterError
from ahv_msgs_py.topics import CLOCK, LOOP_TOPICS, NOMINAL_TOPICS, ODOMETRY, STATE
from ahv_plant.model.vectors import State

STEPS = 15000
ARRAYS = ("stamps", "states", "attitude_commands", "rate_commands", "surfaces", "throttle")


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    """Bag of the nominal case, flown for 150 s on the graph."""
    bag = tmp_path_factory.mktemp("nominal") / "bag"
    ended_early, _ = fly_graph(load_case("nominal_di"), bag)
    assert ended_early == ""
    return bag


def same_bits(one, other):
    return np.asarray(one).tobytes() == np.asarray(other).tobytes()


def test_graph_and_library_agree_to_the_last_bit(nominal):
    case = load_case("nominal_di")
    flown, computed = read_bag(nominal), record_of(fly(case), case.plant.truth.geometric)
    assert flown.steps == STEPS
    for name in ARRAYS:
        assert same_bits(getattr(flown, name), getattr(computed, name)), name


@pytest.mark.parametrize("name", case_names())
def test_every_case_flies_on_the_graph_as_in_the_library(name, tmp_path, domain):
    case = load_case(name, {"duration": 20.0})
    ended_early, _ = fly_graph(case, tmp_path / "bag", domain=domain)
    flown, computed = read_bag(tmp_path / "bag"), record_of(fly(case), False)
    assert bool(ended_early) == (flown.steps < case.plant.steps)
    for array in ARRAYS:
        assert same_bits(getattr(flown, array), getattr(computed, array)), array
    for array in ("learner", "estimates"):
        if case.control.learner is None:
            assert getattr(flown, array) is None
        else:
            assert same_bits(getattr(flown, array), getattr(computed, array)), array


@pytest.mark.parametrize("name", ["nominal_di", "neuro_adaptive_di"])
def test_graph_and_library_write_the_same_messages(name, tmp_path, domain):
    case = load_case(name, {"duration": 1.0})
    fly_graph(case, tmp_path / "graph", domain=domain)
    fly_library(case, tmp_path / "library")

    def messages(path):
        with Reader(path) as reader:
            names = {topic.name for topic in LOOP_TOPICS} | {CLOCK.name}
            wanted = [connection for connection in reader.connections if connection.topic in names]
            return sorted(
                (time, connection.topic, data)
                for connection, time, data in reader.messages(wanted)
            )

    assert messages(tmp_path / "graph") == messages(tmp_path / "library")


def test_the_bag_is_complete_in_rosbags(nominal):
    store = get_typestore(Stores.ROS2_JAZZY)
    stamps = {topic.name: [] for topic in NOMINAL_TOPICS}
    with Reader(nominal) as reader:
        for connection, time, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            if connection.topic in stamps:
                stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
                assert stamp == time
                stamps[connection.topic].append(stamp)
    expected = [step * 10_000_000 for step in range(STEPS + 1)]
    assert all(sorted(found) == expected for found in stamps.values())


def test_the_bag_is_complete_in_mcap(nominal):
    stamps = {topic.name: [] for topic in NOMINAL_TOPICS}
    schemas = {topic.name: topic.layout.type_name for topic in NOMINAL_TOPICS}
    with open(next(nominal.glob("*.mcap")), "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert schema.encoding == "ros2msg" and schema.data
            if channel.topic in stamps:
                assert schema.name == schemas[channel.topic]
                stamp = decoded.header.stamp.sec * 10**9 + decoded.header.stamp.nanosec
                assert message.log_time == stamp
                stamps[channel.topic].append(stamp)
            if channel.topic == STATE.name:
                assert tuple(decoded.name) == State._fields
    expected = [step * 10_000_000 for step in range(STEPS + 1)]
    assert all(found == expected for found in stamps.values())


def test_viewers_see_the_vehicle_at_ten_hertz(nominal):
    flown = read_bag(nominal)
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(nominal) as reader:
        wanted = [link for link in reader.connections if link.topic == ODOMETRY.name]
        seen = [
            (time, store.deserialize_cdr(data, link.msgtype))
            for link, time, data in reader.messages(wanted)
        ]
    assert [time for time, _ in seen] == [k * 100_000_000 for k in range(STEPS // 10 + 1)]
    for (_, odometry), state in zip(seen, flown.states[::10], strict=True):
        state = State(*state)
        position = odometry.pose.pose.position
        assert (position.x, position.y, position.z) == (state.x, state.y, -state.h)
        assert odometry.header.frame_id == "map_ned"
        assert odometry.child_frame_id == "base_link_frd"


def test_nominal_flight_is_as_section_3_5_2_describes_it(nominal):
    flown = read_bag(nominal)
    alpha, beta = np.degrees(flown.air.alpha), np.degrees(flown.air.beta)
    assert np.max(np.abs(alpha)) < 3.7
    assert flown.inlet_started
    assert abs(beta[-1]) < 1e-3  # "sideslip angle is zero after sometimes"
    assert abs(np.degrees(flown.climb_angle[-1])) < 0.05
    for name in ("phi", "psi"):  # "perfectly tracking zero"
        assert abs(np.degrees(flown.column(name)[-1])) < 1e-4
    assert np.degrees(flown.column("theta")[-1]) == pytest.approx(2.85, abs=0.1)
    for name in "PQR":  # "stabilized at zero", faster than the angles
        assert np.max(np.abs(np.degrees(flown.column(name)[flown.time > 100]))) < 0.01
    # "Velocity ... takes times to track": monotone towards u*
    speed = flown.column("u")
    assert np.all(np.diff(speed) < 0) and 1786.4 < speed[-1] < 1800.0
    assert np.all(np.diff(flown.column("mass")) < 0)
    assert abs(flown.column("h")[-1] - 24000.0) < 100.0
    surfaces = np.degrees(flown.surfaces)
    assert surfaces.min() > -40 and surfaces.max() < 30
    assert flown.throttle.min() > 0.1 and flown.throttle.max() < 0.9


def sockets():
    return sum(path.is_socket() for path in Path("/proc/self/fd").iterdir())


def test_a_graph_leaves_nothing_behind(tmp_path, domain):
    case = load_case("nominal_di", {"duration": 0.2})
    fly_graph(case, None, domain=domain)  # what a process loads once
    threads, opened = threading.active_count(), sockets()
    for number in range(3):
        ended_early, _ = fly_graph(case, tmp_path / str(number), domain=domain)
        assert ended_early == ""
        assert read_bag(tmp_path / str(number)).steps == 20
    assert threading.active_count() == threads
    assert sockets() <= opened  # no participant of the domain stays
    assert not rclpy.ok()  # the default context was never touched


def test_two_graphs_of_one_process_do_not_meet(tmp_path, domain, other_domain):
    cases = [
        load_case("nominal_di", {"duration": 0.5}),
        load_case("nominal_di", {"duration": 0.7}),
    ]
    flights = [
        threading.Thread(
            target=fly_graph, args=(case, tmp_path / str(n)), kwargs={"domain": its_domain}
        )
        for n, (case, its_domain) in enumerate(zip(cases, (domain, other_domain), strict=True))
    ]
    for flight in flights:
        flight.start()
    for flight in flights:
        flight.join()
    assert [read_bag(tmp_path / str(n)).steps for n in range(2)] == [50, 70]


def test_a_vehicle_that_leaves_the_atmosphere_ends_the_flight(tmp_path, domain):
    dive = {"initial.h": 50.0, "initial.theta": -30.0, "initial.w": 0.0}
    case = load_case("nominal_di", dive | {"duration": 20.0})
    ended_early, _ = fly_graph(case, tmp_path / "bag", domain=domain)
    assert "atmosphere" in ended_early
    flown = read_bag(tmp_path / "bag")
    assert 0 < flown.steps < 100
    assert 0.0 < flown.column("h")[-1] < 20.0


def test_a_bag_is_never_overwritten(tmp_path, domain):
    case = load_case("nominal_di", {"duration": 0.1})
    fly_graph(case, tmp_path / "bag", domain=domain)
    before = read_bag(tmp_path / "bag").states
    with pytest.raises(ParameterError, match="exists already"):
        fly_graph(case, tmp_path / "bag", domain=domain)
    with pytest.raises(BagError, match="exists already"):
        fly_library(case, tmp_path / "bag")
    assert same_bits(read_bag(tmp_path / "bag").states, before)


def test_a_silent_graph_is_reported(domain, monkeypatch):
    monkeypatch.setattr("ahv_analysis.flight.one_process.LONGEST_SILENCE", 0.5)
    monkeypatch.setattr("ahv_control.velocity_node.VelocityNode._answer", lambda *arguments: None)
    with pytest.raises(GraphError, match="stopped at step 0"):
        fly_graph(load_case("nominal_di", {"duration": 0.1}), None, domain=domain)
