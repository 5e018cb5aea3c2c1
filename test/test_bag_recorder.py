# Copyright 2026 ahv developers, Apache-2.0
"""The recorder loses next to nothing to kill -9, and says in one sentence if the disk fails."""

import os
import random
import resource
import subprocess
from pathlib import Path

import pytest
import rclpy
from mcap.exceptions import McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader

from ahv_analysis.bag.reader import flight_of, read, read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.bag.recorder_node import CONTINUE, RecorderNode
from ahv_analysis.bag.recovery import recover
from ahv_analysis.bag.writer import BagWriter
from ahv_analysis.errors import BagError
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly, fly_library
from ahv_analysis.flight.one_process import fly_graph
from ahv_msgs_py.layout import clock_bytes
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.parameters import ParameterError
from ahv_msgs_py.topics import CLOCK, STATE
from test.bags import mcap_of
from test.kill_recorder import RECORDER, kill_recorders
from test.waiting import wait_until

SMALL = 600_000  # [bytes] a disk that takes a few chunks, and what DDS wants of memory


def messages_in(file):
    """Messages in the whole chunks of a file that is not closed, read by the mcap package."""
    found = []
    with file.open("rb") as stream:
        try:
            for one in StreamReader(stream, validate_crcs=True).records:
                if isinstance(one, Message):
                    found.append(one.data)
        except (McapError, ValueError):
            pass
    return found


def test_a_message_is_on_disk_soon_though_nothing_follows_it(tmp_path, domain):
    """As in a paused flight: neither a later message nor the end of the bag is needed."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    recorder = RecorderNode({"bag": str(tmp_path / "bag")}, context)
    executor = EventsExecutor(context=context)
    executor.add_node(recorder)
    recorder.bring_up()
    sender = recorder.publisher(CLOCK.type_name, CLOCK.name, quality(durable=True))

    def clocks_on_disk(*stamps):
        executor.spin_once(0.01)
        found = messages_in(mcap_of(tmp_path / "bag"))
        return [data for data in found if len(data) == len(clock_bytes(0))] == [
            clock_bytes(stamp) for stamp in stamps
        ]

    sender.publish(clock_bytes(10))
    wait_until(lambda: clocks_on_disk(10), "the first message is on disk")
    sender.publish(clock_bytes(20))
    sender.publish(clock_bytes(30))
    wait_until(
        lambda: clocks_on_disk(10, 20, 30) and recorder.now == 30,  # of its diagnostics
        "all messages are on disk",
    )
    executor.remove_node(recorder)
    executor.shutdown()
    recorder.destroy_node()
    rclpy.shutdown(context=context)


def test_killed_recorders_leave_bags_that_recover(tmp_path, domain):
    """Three at random moments of one flight; `python -m test.kill_recorder` times the loss."""
    draw = random.Random(5)
    moments = [draw.uniform(0.3, 1.5) for _ in range(3)]
    case = load_case("nominal_di", {"duration": 150.0})
    flown = record_of(fly(case), False)
    for kill in kill_recorders(tmp_path, moments, domain):
        bag = read(kill.recovered)
        assert bag.notes.planned == 150.0 and "versions" in bag.notes.content
        assert bag.notes.parameters["inner_loop"] == case.parameters["inner_loop"]
        kept = flight_of(bag)
        assert 0 < kill.left <= kept.steps <= kill.step + 1
        assert kept.stamps.tolist() == flown.stamps[: kept.steps + 1].tolist()
        assert kept.states.tobytes() == flown.states[: kept.steps + 1].tobytes()


@pytest.fixture
def small_disk():
    """No file of this process grows beyond `SMALL`, as if the disk were full then."""
    case = load_case("nominal_di", {"duration": 0.1})
    list(fly(case))  # compiled code is cached before
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def check_what_is_left(bag, error):
    """The sentence names bag, time and cause; what the bag has can be recovered."""
    assert str(bag) in error and "File too large" in error and error.count("\n") == 0
    with pytest.raises(BagError, match="ahv bag recover"):
        read_bag(bag)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    recover(bag, bag.with_name("new"))
    kept, flown = read_bag(bag.with_name("new")), record_of(fly(load_case("nominal_di")), False)
    assert 0 < kept.steps < flown.steps
    assert kept.states.tobytes() == flown.states[: kept.steps + 1].tobytes()


def test_a_full_disk_ends_a_library_flight(tmp_path, small_disk):
    with pytest.raises(BagError) as error:
        fly_library(load_case("nominal_di"), tmp_path / "bag")
    check_what_is_left(tmp_path / "bag", str(error.value))


def test_a_full_disk_ends_a_flight_on_the_graph(tmp_path, domain, small_disk):
    steps = []
    with pytest.raises(BagError) as error:
        fly_graph(load_case("nominal_di"), tmp_path / "bag", domain=domain, progress=steps.append)
    assert steps[-1] < 15000
    check_what_is_left(tmp_path / "bag", str(error.value))


def test_a_flight_goes_on_without_a_disk_if_it_is_set_so(tmp_path, domain, small_disk, capfd):
    steps = []
    ended_early, _ = fly_graph(
        load_case("nominal_di", {"duration": 30.0}),
        tmp_path / "bag",
        domain=domain,
        on_error=CONTINUE,
        progress=steps.append,
    )
    assert ended_early == "" and steps[-1] == 3000
    said = [line for line in capfd.readouterr().err.splitlines() if "File too large" in line]
    assert len(said) == 1
    check_what_is_left(tmp_path / "bag", said[0])


def test_a_bag_that_cannot_be_ended_says_so(tmp_path, small_disk):
    bag = BagWriter(tmp_path / "bag")
    bag.write(STATE.name, *(os.urandom(800) for _ in range(1000)))
    with pytest.raises(BagError, match=r"bag ends at .* s of the flight: File too large"):
        bag.close()
    assert not (tmp_path / "bag" / "metadata.yaml").exists()


@pytest.mark.parametrize("folder", ["/proc/bag", "/sys/bag", "/dev/null/bag"])
def test_a_folder_that_takes_no_bag_is_named(folder):
    with pytest.raises(BagError, match=f"cannot write a bag to {folder}: [A-Z]"):
        BagWriter(Path(folder))


def test_the_recorder_as_a_program_names_what_is_wrong(tmp_path):
    (tmp_path / "bag").mkdir()
    options = ["--ros-args", "-p", f"bag:={tmp_path / 'bag'}"]
    result = subprocess.run([*RECORDER, *options], capture_output=True, text=True)
    assert result.returncode == 2
    assert f"recorder: bag: cannot write a bag to {tmp_path / 'bag'}: it exists already" in (
        result.stderr.splitlines()
    )
    assert list((tmp_path / "bag").iterdir()) == []


def test_on_error_is_one_of_two_words(tmp_path, domain):
    with pytest.raises(ParameterError, match="on_error is 'panic', but must be stop or continue"):
        fly_graph(load_case("nominal_di"), tmp_path / "bag", domain=domain, on_error="panic")
    assert not (tmp_path / "bag").exists()
