# Copyright 2026 ahv developers, Apache-2.0
"""One process per node: the same bits in lockstep, and flight through faults in real time."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from socket import SO_RCVBUF, SOCK_DGRAM, SOL_SOCKET, socket
from textwrap import wrap
from xml.etree import ElementTree

import numpy as np
import pytest
from rclpy.qos import ReliabilityPolicy

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.errors import GraphError
from ahv_analysis.faults.campaign import (
    CONTROLLERS,
    EXPECTED,
    REFUSED,
    Spectator,
    draw_injections,
    run_campaign,
)
from ahv_analysis.faults.faulty_node import wrong_messages
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.process_per_node import (
    ProcessGraph,
    fly_processes,
)
from ahv_msgs_py.node.faults import PERIOD
from ahv_msgs_py.node.network import DISCOVERY_RANGE, PROFILES, keep_to_this_machine
from ahv_msgs_py.node.real_time import PRIORITY
from ahv_msgs_py.topics import STATE, SURFACE_COMMAND
from ahv_plant.model.constants import DEGREES, STEP_NS
from test.ends import beside
from test.ends import fly as fly_by_command
from test.processes import opened
from test.waiting import wait_until

CASE = "neuro_adaptive_sc_gdi"
DDS = "{http://www.eprosima.com}"  # namespace of Fast DDS's profiles
TRACKING = 0.5  # [deg], [deg/s] within which a disturbed flight is back
LONGEST_OUTAGE = 2.0  # [s] that a vehicle is safe without a controller
RECOVERY = 30.0  # [s] of flight for that: the pitch loop's time constant is 10 s


@pytest.fixture(autouse=True)
def private(monkeypatch, domain):
    """Every test in a domain of its own, with the transport that it sets."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    monkeypatch.setenv(DISCOVERY_RANGE, "LOCALHOST")  # and as it was, afterwards
    monkeypatch.delenv(PROFILES)


def shared_memory(domain):
    """What DDS holds of shared memory for the ports of a domain."""
    ports = range(7400 + 250 * domain, 7400 + 250 * (domain + 1))
    return {path for port in ports for path in Path("/dev/shm").glob(f"*fastrtps_port{port}*")}


def test_processes_in_lockstep_fly_the_same_bits_and_leave_nothing(tmp_path, domain):
    case = load_case(CASE, {"duration": 5.0})
    before = shared_memory(domain)
    ended_early, _ = fly_processes(case, tmp_path / "bag")
    assert ended_early == ""
    assert shared_memory(domain) <= before
    flown, computed = read_bag(tmp_path / "bag"), record_of(fly(case), False)
    for name in ("stamps", "states", "surfaces", "throttle", "learner", "estimates"):
        assert np.array_equal(getattr(flown, name), getattr(computed, name)), name


def test_what_lies_in_the_working_directory_does_not_fly(tmp_path):
    """Another checkout, say: the processes run the code that their command belongs to."""
    (tmp_path / "ahv_plant").mkdir()
    (tmp_path / "ahv_plant" / "__init__.py").write_text("open('flew', 'w')\n")
    command = [Path(sys.executable).parent / "ahv", "fly", "nominal_di", "--processes"]
    flown = subprocess.run([*command, "--duration", "0.1", "--out", "flight"], cwd=tmp_path)
    assert flown.returncode == 0
    assert not (tmp_path / "flew").exists()


def test_a_controller_that_dies_in_lockstep_ends_the_flight(tmp_path):
    case = load_case(CASE, {"duration": 3000.0})
    killed = []

    def kill(steps):
        if steps > 0 and not killed:
            killed.append(steps)
            os.kill(node_pids()["velocity"], signal.SIGKILL)

    with pytest.raises(GraphError, match="velocity ended in flight"):
        fly_processes(case, None, progress=kill)
    assert killed


@contextmanager
def watched(name, until, realtime=True):
    """A flight that has got to a step and goes on for ever: its processes and a spectator."""
    keep_to_this_machine(shared_memory=not realtime)
    spectator = Spectator()
    try:
        case = load_case(name, {"duration": 3600.0})
        graph = ProcessGraph(case, None, realtime, spectators=1)
        with spectator.looking_on(), graph:
            wait_until(
                lambda: spectator.stamp >= until * STEP_NS,
                f"the flight is at step {until}",
                partial(spectator.look, 0.1),
            )
            yield graph, spectator
            graph.end_flight()
    finally:
        spectator.close()


def node_pids():
    """Process of every node, from the family of this one's server."""
    import multiprocessing

    return {child.name: child.pid for child in multiprocessing.active_children()}


def reference(seconds):
    """The flight that nothing disturbs."""
    return record_of(fly(load_case(CASE, {"duration": seconds})), False)


def away(spectator, calm):
    """How far a flight is from the calm one, in parts of what is allowed."""
    state, then = spectator.state, calm.states[spectator.stamp // STEP_NS]
    angles = (state.theta - then[7], state.Q - then[4])
    parts = [abs(angle) * DEGREES / TRACKING for angle in angles]
    return max(*parts, abs(state.u - then[0]) / 5.0, abs(state.h - then[11]) / 100.0)


def longest_outage(statuses):
    """Longest time [s] without a command, as the plant said."""
    texts = [text for _, name, _, text, _ in statuses if name == "plant"]
    return max((float(t.split()[-2]) for t in texts if "none for" in t), default=0.0)


def test_every_controller_can_be_killed_and_started_again(tmp_path):
    """Within a second, in flight: the flight comes back to where it would have been."""
    calm = reference(150.0)
    with watched(CASE, 100) as (graph, spectator):
        for name in CONTROLLERS:
            spectator.max_abs_alpha = 0.0
            graph.kill(name)
            graph.start(name)
            until, seen = spectator.stamp + RECOVERY * 1e9, len(spectator.statuses)
            spectator.look(3.0)
            while away(spectator, calm) > 1.0 and spectator.stamp < until:
                spectator.look(0.5)
            outage = longest_outage(spectator.statuses[seen:])
            safe = spectator.max_abs_alpha * DEGREES < 5.0
            if outage > LONGEST_OUTAGE and not (safe and away(spectator, calm) < 1.0):
                pytest.skip(f"this machine took {outage:g} s to start {name} again")
            assert away(spectator, calm) < 1.0, name
            assert safe, name
            assert graph.ended() == {}, name


def listening(pid):
    """Addresses that a process can be sent something at."""
    sockets = {path.name for path in opened(pid)}
    for table in ("udp", "udp6", "tcp", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if f"socket:[{fields[9]}]" in sockets:
                words = wrap(fields[1].partition(":")[0], 8)  # each with its last byte first
                yield ip_address(b"".join(bytes.fromhex(word)[::-1] for word in words))


@pytest.mark.parametrize("realtime", [False, True])
def test_nobody_on_another_machine_is_heard(realtime):
    """A socket that is bound to a group of multicast gets what is sent to the group alone."""
    with watched("nominal_di", 1, realtime) as (graph, _):
        for name, process in graph.processes.items():
            addresses = set(listening(process.pid))
            assert addresses, name
            assert all(one.is_loopback or one.is_multicast for one in addresses), name


def test_a_node_that_joins_has_room_for_all_that_it_is_told_at_once():
    """Linux by itself has room for half: the rest came a second later, on a busy machine."""
    permitted = int(Path("/proc/sys/net/core/rmem_max").read_text())
    wanted = 2 * min(permitted, 4 << 20)  # the kernel doubles it for its own needs
    keep_to_this_machine()
    spectator, rooms = Spectator(), []
    try:
        for descriptor in Path("/proc/self/fd").iterdir():
            with suppress(OSError), socket(fileno=os.dup(int(descriptor.name))) as one:
                if one.type == SOCK_DGRAM:
                    rooms.append(one.getsockopt(SOL_SOCKET, SO_RCVBUF))
    finally:
        spectator.close()
    assert sum(room >= wanted for room in rooms) >= 3, rooms  # multicast, discovery, messages


def may_take_precedence():
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        os.sched_setscheduler(0, *before)
    except PermissionError:
        return False
    return True


@pytest.mark.parametrize("realtime", [False, True])
def test_in_real_time_every_thread_of_a_node_goes_before_ordinary_ones(realtime):
    """Where the system permits it; in lockstep there is no hurry."""
    fifo = realtime and may_take_precedence()
    with watched("nominal_di", 1, realtime) as (graph, _):
        for name, process in graph.processes.items():
            policies = set()
            for task in Path(f"/proc/{process.pid}/task").iterdir():
                with suppress(ProcessLookupError):  # it has ended since
                    policies.add(os.sched_getscheduler(int(task.name)))
            assert policies == {os.SCHED_FIFO if fifo else os.SCHED_OTHER}, name


def test_in_real_time_nobody_waits_for_what_is_lost():
    """Controllers hear the newest state at best effort; writers ask 20 times a second for losses.

    Reliable, and asked every 3 s as Fast DDS would by itself, a node that was held up is deaf
    until it is asked.
    """
    with watched("nominal_di", 1) as (graph, spectator):
        profile = Path(os.environ[PROFILES])  # of this process and of all that it starts
        hears = {}

        def all_are_known():  # to the spectator: it hears of each by itself, and in any order
            for listener in spectator._node.get_subscriptions_info_by_topic(STATE.name):
                hears[listener.node_name] = listener.qos_profile.reliability
            return hears.keys() >= {*graph.controllers}

        look = partial(spectator.look, 0.1)
        wait_until(all_are_known, "every controller is seen to hear the state", look)
    assert {hears[name] for name in graph.controllers} == {ReliabilityPolicy.BEST_EFFORT}
    (writer,) = ElementTree.parse(profile).iter(f"{DDS}data_writer")
    assert writer.get("is_default_profile") == "true"
    (period,) = writer.iter(f"{DDS}heartbeatPeriod")
    seconds, nanoseconds = (int(period.find(f"{DDS}{unit}").text) for unit in ("sec", "nanosec"))
    assert seconds + 1e-9 * nanoseconds <= 0.05


def minor_faults(pid):
    """How often a process has met a page of memory that it did not have."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[7])


def test_in_real_time_no_step_asks_the_system_for_memory():
    """From the first second on: a page that is new can cost more than a step's work."""
    with watched(CASE, 100) as (graph, spectator):
        before = {name: minor_faults(node.pid) for name, node in graph.processes.items()}
        first = spectator.stamp // STEP_NS
        spectator.look(5.0)
        steps = spectator.stamp // STEP_NS - first
        for name, node in graph.processes.items():
            assert minor_faults(node.pid) - before[name] < steps / 10, name


def test_a_short_fault_campaign_passes(tmp_path):
    report = run_campaign(8, 2017, tmp_path / "faults", whole_flights=False)
    assert report["unnoticed"] == []
    assert report["passed"], report["flights"]
    assert report["injections"] == 10  # and the loss of recorder and plant
    assert (tmp_path / "faults" / "faults.json").is_file()


def test_every_kind_of_fault_is_drawn():
    from random import Random

    every = [*EXPECTED, *REFUSED]
    kinds = [kind for kind, _, _ in draw_injections(Random(0), len(every))]
    assert sorted(kinds) == sorted(every)


def test_wrong_messages_are_wrong():
    whole = SURFACE_COMMAND.layout.encode(7 * PERIOD, (0.1, 0.1, 0.0))
    before = SURFACE_COMMAND.layout.encode(6 * PERIOD, (0.1, 0.1, 0.0))
    for kind in EXPECTED:
        if kind not in ("killed", "stopped", "second publisher"):
            assert wrong_messages(SURFACE_COMMAND, kind, whole, before) != [whole], kind


@pytest.mark.slow
def test_every_end_comes_within_ten_seconds(tmp_path):
    """With somebody who looks on, and both cores busy: `python -m test.ends` flies 200 times."""
    with beside(observers=1, busy=os.cpu_count()):
        for number in range(5):
            end = fly_by_command(tmp_path / str(number), 3.0)
            assert end.code == 0
            assert end.summed_up
            assert end.seconds < 10.0
