# Copyright 2026 ahv developers, Apache-2.0
"""A flight on the ROS graph, one process per node."""

import gc
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable
from multiprocessing import forkserver, resource_tracker
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType

import rclpy

from ahv_analysis.errors import GraphError
from ahv_analysis.flight.case import Case, notes
from ahv_analysis.flight.library import INTERRUPTED
from ahv_analysis.flight.shared_memory import pieces, remove_abandoned
from ahv_analysis.interrupt import SIGNALS, signals_wait
from ahv_analysis.versions import source_hash
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.namespace import ros_arguments
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.deadline import end_with_parent
from ahv_msgs_py.node.log_folder import log_where_it_can
from ahv_msgs_py.node.managed_node import REALTIME
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.real_time import take_precedence
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import NAMESPACE
from ahv_plant.plant_flight import warm_up_plant
from ahv_plant.plant_node import PlantNode

SAFE_PATH = "PYTHONSAFEPATH"
NodeChange = Callable[[type[BaseNode]], type[BaseNode]]  # goes to the processes by its name

LONGEST_START = 30.0  # [s] until the first state
LONGEST_SILENCE = 10.0  # [s] without a sign of the plant, after which the graph has failed
LONGEST_REST = (
    6.0  # [s] from the end of a flight until plant and recorder have ended by themselves
)
LONGEST_END = 8.0  # [s] from there until the last process has been killed
LOOK = 0.05  # [s] between looks at the processes, and of the plant at its progress


class FlightReport:
    """What the process of the plant tells the one that started the graph, past the middleware.

    So that one takes part in no ROS graph: no one else's word ends a flight, and nothing of the
    middleware can hold up the end of a command.
    """

    def __init__(self, context: ForkServerContext):
        """Make what both processes share."""
        self._step = context.RawValue("q", -1)
        self._told, self._tell = context.Pipe(duplex=False)

    def report(self, plant: PlantNode) -> None:
        """In the plant's process: tell of the step now and then, and of the end."""

        def progress() -> None:
            if plant.now is not None:  # it flies, and does not wait for listeners any more
                self._step.value = plant.step

        plant.create_timer(LOOK, progress)
        plant.finished.add_done_callback(lambda end: self._tell.send(end.result()))

    @property
    def step(self) -> int:
        """The newest step that is known of; -1 if there was none."""
        return int(self._step.value)

    def ended(self, seconds: float) -> str | None:
        """Wait so long for the end: why it came early, empty if it did not; None if none came."""
        return self._told.recv() if self._told.poll(seconds) else None


def _run_node(
    name: str,
    namespace: str,
    values: dict[str, Value],
    change: NodeChange | None,
    environment: dict[str, str],
    report: FlightReport,
    source: str,
) -> None:
    """Be the process of a node; the server has the environment of when it was started.

    It has to run the code of `source`, which is filed with the flight.
    """
    # loaded by the server; compiles all laws
    from ahv_analysis.flight.node_server import SERVER, SOURCE

    # The server ends when the last one who may ask it for processes has: that is its client alone.
    os.close(forkserver._forkserver._forkserver_alive_fd)  # type: ignore[attr-defined]
    end_with_parent(SERVER)
    if source != SOURCE:
        print(f"{name}: the code in {Path(__file__).parents[2]} has changed", file=sys.stderr)
        sys.exit(2)
    os.environ.update(environment)
    sys.argv = [name, *ros_arguments(namespace)]
    if values[REALTIME.name]:
        take_precedence()  # at once: a node that is started again in flight is missed
    kind = NODES[name].node_class
    if change is not None and NODES[name].sends:
        kind = change(kind)

    def make() -> BaseNode:
        node = kind(values)
        if isinstance(node, PlantNode):
            report.report(node)
        return node

    code: object = 0
    try:
        run(make)
    except SystemExit as end:
        code = end.code
    # A forked process ends without finalizing Python, and what holds DDS would stay in /dev/shm.
    gc.unfreeze()
    gc.collect()
    rclpy.get_default_context().destroy()
    sys.exit(code)


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
        change: NodeChange | None = None,
        namespace: str = NAMESPACE,
    ):
        """Prepare the nodes of `case` in a namespace; nothing runs yet.

        `spectators` listen to the state from outside; `change` makes others of the
        classes of the nodes that send in the loop.
        """
        self._change, self._namespace = change, namespace
        warm_up_plant(case.plant)  # whose process then finds its machine code
        self._source = source_hash()
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
        self._pieces = pieces()
        self._context = multiprocessing.get_context("forkserver")
        os.environ[SAFE_PATH] = "1"  # or the server imports what lies in the working directory
        self.report = FlightReport(self._context)
        self._context.set_forkserver_preload(
            [
                "ahv_analysis.flight.node_server_signals",
                *(node.module for node in NODES.values()),
                "ahv_analysis.flight.node_server",
            ]
        )
        self._start_server()

    def _start_server(self) -> None:
        """Start what processes are forked off, and wait until it has loaded everything."""
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # until it is ready for one
        try:
            forkserver.ensure_running()
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        first = self._context.Process(target=int)
        first.start()
        first.join()

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
            args=(
                name,
                self._namespace,
                self.values[name],
                self._change,
                environment,
                self.report,
                self._source,
            ),
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
        begun = time.monotonic()

        def left(longest: float) -> float:
            return max(0.0, begun + longest - time.monotonic())

        if error is None:
            for name in ("plant", "recorder"):  # end by themselves when all is said
                if name in self.processes:
                    self.processes[name].join(left(LONGEST_REST))
        for name, process in self.processes.items():
            if process.exitcode is None:
                self.signal(name, signal.SIGCONT)
                self.signal(name, signal.SIGINT)
        for process in self.processes.values():
            process.join(left(LONGEST_END))
            if process.exitcode is None:
                process.kill()
                process.join()
        remove_abandoned(pieces() - self._pieces)


def fly_processes(
    case: Case,
    bag: Path | None,
    *,
    namespace: str = NAMESPACE,
    realtime: bool = False,
    progress: Callable[[int], None] = lambda steps: None,
) -> tuple[str, float]:
    """Fly `case` with one process per node, as `fly_graph` does in this one.

    In real time a controller that ends is started again at once. Returns why the flight ended
    early (empty if it did not) and the seconds that it took. Raises GraphError if the graph stops.
    A signal ends the flight in order, as there.
    """
    keep_to_this_machine(shared_memory=not realtime)
    log_where_it_can()
    graph = ProcessGraph(case, bag, realtime, namespace=namespace)
    with signals_wait() as interrupted:
        with graph:
            flown = _watch(graph, realtime, progress, interrupted)
        progress(graph.report.step)  # it goes on until its processes have heard of an interruption
        return flown


def _watch(
    graph: ProcessGraph,
    realtime: bool,
    progress: Callable[[int], None],
    interrupted: Callable[[], bool],
) -> tuple[str, float]:
    """Look on until the plant says that the flight is over: why, and the seconds that it took."""
    last, since, started = -1, time.monotonic() + LONGEST_START, 0.0
    while True:
        ended = graph.ended()  # first: who has ended may have said something before
        reason = graph.report.ended(LOOK)
        step, now = graph.report.step, time.monotonic()
        progress(step)
        if reason is not None:
            return reason, now - started
        if interrupted():
            graph.end_flight()
            return INTERRUPTED, now - started
        if step != last:
            started = started or now
            last, since = step, now
        elif now - since > LONGEST_SILENCE:
            raise GraphError(f"the graph stopped at step {step}")
        for name, code in ended.items():
            if realtime and name in graph.controllers and code != 2:
                graph.start(name)
            elif (name, code) != ("recorder", 0):  # it may hear of the end before this one does
                raise GraphError(f"{name} ended in flight with exit code {code}")
