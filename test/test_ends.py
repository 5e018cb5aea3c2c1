# Copyright 2026 ahv developers, Apache-2.0
"""Processes end: with the command that started them, and in time."""

import fcntl
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from ahv_analysis.bag.reader import load_bag
from ahv_analysis.flight import process_per_node
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.process_per_node import ProcessGraph
from ahv_analysis.flight.shared_memory import FOLDER, LOCK, pieces, remove_abandoned
from ahv_msgs_py.config import config_folder
from ahv_msgs_py.node.network import DISCOVERY_RANGE, PROFILES, keep_to_this_machine
from ahv_msgs_py.topics import STATE
from test.processes import opened
from test.waiting import PATIENCE, wait_until

STATES = "the flight has states on disk"


def descendants(pid):
    """Every process that a process has started, and theirs."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return {int(child) for child in children}.union(*map(descendants, children))


def test_nodes_end_with_the_command_that_is_killed(tmp_path):
    """A stopped one too; and the recorder closes its bag."""
    command = [Path(sys.executable).parent / "ahv", "fly", "nominal_di", "--realtime"]
    command += ["--processes", "--duration", "1000", "--out", tmp_path, "--json"]
    program = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        files = partial(tmp_path.glob, "bag/*.mcap")
        wait_until(lambda: any(file.stat().st_size > 3e5 for file in files()), STATES)
        started = descendants(program.pid)
        assert len(started) >= 6  # tracker and server, plant, recorder, two controllers at least
        os.kill(max(started), signal.SIGSTOP)
    finally:
        program.kill()
        program.wait()
    wait_until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in started), "all have ended")
    assert (tmp_path / "bag" / "metadata.yaml").is_file()
    assert load_bag(tmp_path / "bag")[STATE.name].messages


def held_by(graph):
    """Locks of the pieces that the nodes of a graph own; tests beside this one have theirs."""
    links = [
        link
        for process in graph.processes.values()
        for link in opened(process.pid)
        if link.parent == FOLDER and link.name.startswith("fastrtps_")
    ]
    return {link for link in links if link.name.endswith(LOCK)}


def in_use(lock):
    try:
        with lock.open("r+") as held:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except FileNotFoundError:
        pass
    return False


def test_what_is_killed_leaves_no_shared_memory(monkeypatch):
    monkeypatch.setenv(DISCOVERY_RANGE, "LOCALHOST")
    monkeypatch.delenv(PROFILES)
    keep_to_this_machine(shared_memory=True)
    with ProcessGraph(load_case("nominal_di", {"duration": 1000.0}), None, False) as graph:
        wait_until(lambda: graph.report.step > 0, "the graph flies")
        held = held_by(graph)
        assert held
        remove_abandoned(held)
        assert held <= pieces()  # whoever lives keeps what it has
        for name in graph.values:
            graph.kill(name)
    ours = [lock for lock in held if not in_use(lock)]  # another may have a port's number since
    left = {file.name for lock in ours for file in lock.parent.glob(f"*{lock.name[:-3]}*")}
    assert ours and left == set()


def test_all_processes_together_have_one_deadline(monkeypatch):
    """However many do not hear."""
    monkeypatch.setattr(process_per_node, "LONGEST_REST", 0.5)
    monkeypatch.setattr(process_per_node, "LONGEST_END", 1.0)
    with ProcessGraph(load_case("nominal_di", {"duration": 1000.0}), None, True) as graph:
        wait_until(lambda: graph.report.step > 0, "the graph flies")
        monkeypatch.setattr(graph, "signal", lambda name, number: None)  # none of them hears
        processes = list(graph.processes.values())
    assert [process.exitcode for process in processes] == [-signal.SIGKILL] * len(processes)


# As Fast DDS hangs: the thread that leaves the graph waits under the lock of Python.
HANGS = """
import ctypes
import sys
from ahv_analysis.command.main import main
from ahv_analysis.flight import one_process
one_process._leave = lambda *graph: ctypes.PyDLL(None).sleep(600)
sys.argv = ["ahv", "fly", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize("way", ["--json", "--realtime"])
def test_a_command_ends_though_the_middleware_hangs(way, tmp_path):
    """With all that it had to say said, and its own exit code."""
    command = [sys.executable, "-c", HANGS, "nominal_di", "--duration", "0.5", way]
    flown = subprocess.run(
        [*command, "--out", tmp_path], capture_output=True, text=True, timeout=PATIENCE
    )
    assert flown.returncode == 0, flown.stderr
    assert "success" in flown.stdout
    assert (tmp_path / "summary.json").is_file()


def test_a_command_that_fails_has_said_all_before_it_ends():
    """Through a pipe, into which Python writes when it tidies up and not before."""
    lines = """
import os, typer
from ahv_analysis.command.app import errors_in_a_sentence
try:
    with errors_in_a_sentence(False):
        print("said")
        raise typer.Exit(1)
except typer.Exit:
    os._exit(1)
"""
    buffered = {key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"}
    failed = subprocess.run(
        [sys.executable, "-c", lines], capture_output=True, text=True, env=buffered
    )
    assert failed.stdout == "said\n"


def test_an_interrupted_command_ends_though_the_middleware_hangs(tmp_path):
    command = [sys.executable, "-c", HANGS, "nominal_di", "--duration", "1000", "--realtime"]
    flown = subprocess.Popen([*command, "--out", tmp_path], stderr=subprocess.PIPE, text=True)
    files = partial(tmp_path.glob, "bag/*.mcap")
    wait_until(lambda: any(file.stat().st_size > 3e5 for file in files()), STATES)
    flown.send_signal(signal.SIGINT)
    _, said = flown.communicate(timeout=PATIENCE)
    assert flown.returncode == 128 + signal.SIGINT
    assert "interrupted at" in said
    assert (tmp_path / "bag" / "metadata.yaml").is_file()


def test_a_signal_while_a_node_is_imported_ends_it_without_a_word():
    """From the first moment on that is a program's own, and whatever it is at."""
    command = [sys.executable, "-c", "from ahv_msgs_py.program import velocity; velocity()"]
    command = ["env", "--default-signal=INT", *command, "--ros-args", "--log-level", "error"]
    command += ["--params-file", config_folder() / "cases" / "nominal_di.yaml"]
    codes = []
    for moment in (0.0, 0.1, 0.2, 0.4, 0.8):
        node = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        wait_until(lambda node=node: catches(node.pid, signal.SIGHUP), "it answers signals")
        time.sleep(moment)
        node.send_signal(signal.SIGINT)
        _, said = node.communicate(timeout=PATIENCE)
        assert said == ""
        codes.append(node.returncode)
    assert codes[0] == 128 + signal.SIGINT
    assert {*codes} <= {128 + signal.SIGINT, 0}  # 0: it was a node already, and ended in order


def catches(pid, number):
    """Whether a process has a handler for a signal."""
    status = Path(f"/proc/{pid}/status").read_text()
    (caught,) = [line.split()[1] for line in status.splitlines() if line.startswith("SigCgt")]
    return bool(int(caught, 16) >> (number - 1) & 1)


def test_a_node_is_sent_two_signals_at_once():
    """The second comes while the first is answered."""
    node = "from ahv_control.velocity_node import main; main()"
    command = [sys.executable, "-c", node, "--ros-args", "-p", "realtime:=true"]
    parameters = config_folder() / "cases" / "nominal_di.yaml"
    process = subprocess.Popen(
        [*command, "--params-file", parameters], stderr=subprocess.PIPE, text=True
    )
    for line in process.stderr:
        if "active" in line:
            break
    process.send_signal(signal.SIGSTOP)
    for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT, signal.SIGCONT):
        process.send_signal(number)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
