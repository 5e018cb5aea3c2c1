# Copyright 2026 ahv developers, Apache-2.0
"""A flight on the ROS graph, one process per node."""

import gc
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.experimental import EventsExecutor

from ahv_analysis.errors import GraphError
from ahv_analysis.faults.faulty_node import faulty
from ahv_analysis.flight.case import Case, config_folder, notes
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.node.managed_node import REALTIME
from ahv_msgs_py.node.process import DISCOVERY_RANGE, run
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.real_time import take_precedence
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import DIAGNOSTICS, NAMESPACE
from ahv_plant.model.constants import STEP_NS

PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
LONGEST_START = 30.0  # [s] until the first state
LONGEST_SILENCE = 10.0  # [s] without a sign of the plant, after which the graph has failed
LONGEST_END = 10.0  # [s] for a process to end by itself
EXPECTED_ENDS = {"plant": (0, 1), "recorder": (0,)}  # exit codes when the flight is over
LOOK = 0.05  # [s] between looks at the processes


def _run_node(
    name: str, values: dict[str, Value], can_fail: bool, environment: dict[str, str]
) -> None:
    """Be the process of a node; the server has the environment of when it was started."""
    os.environ.update(environment)
    sys.argv = [name]
    if values[REALTIME.name]:
        take_precedence()  # at once: a node that is started again in flight is missed
    kind = NODES[name].node_class
    if can_fail and NODES[name].sends:
        kind = faulty(kind)
    code: object = 0
    try:
        run(lambda: kind(values))
    except SystemExit as end:
        code = end.code
    # A forked process ends without finalizing Python, and what holds DDS would stay in /dev/shm.
    gc.unfreeze()
    gc.collect()
    rclpy.get_default_context().destroy()
    sys.exit(code)


def set_transport(realtime: bool) -> None:
    """Choose how the processes to be started find and hear each other, unless it is chosen.

    They keep to this machine. In real time by a profile of Fast DDS, UDP on the loopback, since
    through shared memory a node that was killed and started again is not heard for seconds; ROS's
    own word for this machine alone must not be said then, for it adds shared memory.
    """
    here = os.environ.setdefault(DISCOVERY_RANGE, "LOCALHOST") == "LOCALHOST"
    if realtime and here and PROFILES not in os.environ:
        os.environ[DISCOVERY_RANGE] = "SYSTEM_DEFAULT"  # of the profile
        os.environ[PROFILES] = str(config_folder() / "fastdds" / "realtime.xml")


class ProcessGraph:
    """The processes of a graph: started in order, watched, ended; leaves none behind.

    They are forked off a server that has loaded everything, so that a node starts in a tenth of
    the time that a fresh interpreter takes.
    """

    def __init__(
        self,
        case: Case,
        bag: Path | None,
        realtime: bool,
        spectators: int = 0,
        can_fail: bool = False,
    ):
        """Prepare the nodes of `case`; nothing runs yet.

        `spectators` listen to the state from outside; nodes that `can_fail` do so when told to.
        """
        self._can_fail = can_fail
        self.controllers = case.controllers
        listeners = len(self.controllers) + (bag is not None) + spectators
        mode: dict[str, Value] = {REALTIME.name: realtime}
        # in the order of their start: who listens comes first
        self.values: dict[str, dict[str, Value]] = {}
        if bag is not None:
            self.values["recorder"] = {"bag": str(bag), "notes": notes(case)} | mode
        self.values |= {name: case.parameters[name] | mode for name in self.controllers}
        self.values["plant"] = case.parameters["plant"] | mode | {"listeners": listeners}
        self.processes: dict[str, BaseProcess] = {}
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(
            [node.module for node in NODES.values()] + ["ahv_analysis.flight.node_server"]
        )

    def __enter__(self) -> "ProcessGraph":
        for name in self.values:
            self.start(name)
        return self

    def start(self, name: str) -> None:
        """Start the process of a node."""
        environment = {
            key: value
            for key, value in os.environ.items()
            if key.startswith(("ROS_", "FASTDDS_", "FASTRTPS_"))
        }
        process = self._context.Process(
            target=_run_node,
            args=(name, self.values[name], self._can_fail, environment),
            name=name,
            daemon=True,
        )
        process.start()
        self.processes[name] = process

    def signal(self, name: str, number: int) -> None:
        """Send a signal to the process of a node."""
        pid = self.processes[name].pid
        assert pid is not None
        os.kill(pid, number)

    def kill(self, name: str) -> None:
        """End the process of a node as a crash would, and wait until it has gone."""
        self.processes[name].kill()
        self.processes[name].join()

    def end_flight(self) -> None:
        """End a flight before its time; the bag is closed."""
        for name in ({"plant", "recorder"} & self.processes.keys()) - self.ended().keys():
            self.signal(name, signal.SIGINT)

    def ended(self) -> dict[str, int]:
        """Exit codes of the processes that have ended, by node."""
        codes = {name: process.exitcode for name, process in self.processes.items()}
        return {name: code for name, code in codes.items() if code is not None}

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let plant and recorder finish, interrupt the others, kill what does not hear."""
        if error is None:
            for name in ("plant", "recorder"):  # end by themselves when all is said
                if name in self.processes:
                    self.processes[name].join(LONGEST_END)
        for name, process in self.processes.items():
            if process.exitcode is None:
                self.signal(name, signal.SIGCONT)
                self.signal(name, signal.SIGINT)
        deadline = time.monotonic() + LONGEST_END
        for process in self.processes.values():
            process.join(max(0.1, deadline - time.monotonic()))
            if process.exitcode is None:
                process.kill()
                process.join()


class Watcher:
    """Listens to the diagnostics of the graph from outside it."""

    def __init__(self) -> None:
        """Start to listen; no flight has been seen yet."""
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self._node = rclpy.create_node("watcher", namespace=NAMESPACE, context=self.context)
        self._executor = EventsExecutor(context=self.context)
        self._executor.add_node(self._node)
        self._node.create_subscription(
            DiagnosticArray, DIAGNOSTICS.name, self._take, quality(durable=True)
        )
        self.step = -1  # of the newest report of the plant
        self.over: dict[str, str] | None = None  # what the plant said at the end
        self.reason = ""  # why it ended early
        self.statuses: list[tuple[int, str, int, str, dict[str, str]]] = []

    def _take(self, message: DiagnosticArray) -> None:
        stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
        for status in message.status:
            facts = {fact.key: fact.value for fact in status.values}
            name = status.name.rpartition("/")[2]
            self.statuses.append((stamp, name, status.level[0], status.message, facts))
            if name == "plant":
                self.step = stamp // STEP_NS
                if "over" in facts:
                    self.over = facts
                    self.reason = "" if status.level == b"\x00" else status.message

    def look(self, seconds: float) -> None:
        """Listen for so long."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            self._executor.spin_once(left)

    def close(self) -> None:
        """Stop listening."""
        self._executor.remove_node(self._node)
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self.context)


def fly_processes(
    case: Case,
    bag: Path | None,
    *,
    realtime: bool = False,
    progress: Callable[[int], None] = lambda steps: None,
) -> tuple[str, float]:
    """Fly `case` with one process per node, as `fly_graph` does in this one.

    In real time a controller that ends is started again at once. Returns why the flight ended
    early (empty if it did not) and the seconds that it took. Raises GraphError if the graph stops.
    """
    set_transport(realtime)
    watcher = Watcher()
    try:
        with ProcessGraph(case, bag, realtime) as graph:
            wall = _watch(watcher, graph, realtime, progress)
    finally:
        watcher.close()
    return watcher.reason, wall


def _watch(
    watcher: Watcher, graph: ProcessGraph, realtime: bool, progress: Callable[[int], None]
) -> float:
    """Look on until the plant says that the flight is over; returns the seconds that it took."""
    last, since, started = -1, time.monotonic() + LONGEST_START, 0.0
    while watcher.over is None:
        watcher.look(LOOK)
        progress(watcher.step)
        now = time.monotonic()
        if watcher.step != last:
            started = started or now
            last, since = watcher.step, now
        elif now - since > LONGEST_SILENCE:
            raise GraphError(f"the graph stopped at step {watcher.step}")
        for name, code in graph.ended().items():
            if realtime and name in graph.controllers and code != 2:
                graph.start(name)
            elif code not in EXPECTED_ENDS.get(name, ()) and watcher.over is None:
                raise GraphError(f"{name} ended in flight with exit code {code}")
    return time.monotonic() - started
