# Copyright 2026 ahv developers, Apache-2.0
"""A flight on the ROS graph, all nodes in this process, in lockstep."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import rclpy
from rclpy.task import Future

from ahv_analysis.bag.recorder_node import STOP, RecorderNode
from ahv_analysis.errors import GraphError
from ahv_analysis.flight.case import Case, notes
from ahv_analysis.flight.library import INTERRUPTED
from ahv_analysis.interrupt import signals_wait
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.namespace import ros_arguments
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.log_folder import log_where_it_can
from ahv_msgs_py.node.managed_node import REALTIME
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.node.warm_up import warm_up_nodes
from ahv_msgs_py.topics import (
    HARDWARE_TOPICS,
    LEARNER_TOPICS,
    NAMESPACE,
    NOMINAL_TOPICS,
    REFERENCE,
    STATE,
    LoopTopic,
)
from ahv_plant.plant_node import PlantNode

LONGEST_SILENCE = 10.0  # [s] without a step, after which the graph has failed
LOOK = 0.2  # [s] of wall time between looks at the progress
Leave = Callable[[Callable[[], None]], object]  # calls what it is given, now or when all is said


def at_once(leave: Callable[[], None]) -> None:
    """Leave the graph as soon as it is flown."""
    leave()


def loop_topics(case: Case) -> Sequence[LoopTopic]:
    """Topics of the control loop of a case."""
    return (
        *NOMINAL_TOPICS,
        *((REFERENCE,) if case.control.guidance is not None else ()),
        *(LEARNER_TOPICS if case.control.learner is not None else ()),
        *(HARDWARE_TOPICS if case.plant.hardware is not None else ()),
    )


def fly_graph(
    case: Case,
    bag: Path | None,
    *,
    domain: int | None = None,
    namespace: str = NAMESPACE,
    realtime: bool = False,
    on_error: str = STOP,
    progress: Callable[[int], None] = lambda steps: None,
    leave: Leave = at_once,
) -> tuple[str, float]:
    """Fly `case` on a graph of its own context; record to `bag` unless that is None.

    Another vehicle may fly in the same `domain` at the same time, in another `namespace`. In
    lockstep, or with `realtime` at 100 Hz by the wall clock. `progress(steps)` is called now
    and then. Returns why the flight ended early (empty if it did not) and the seconds from the
    first state to the last command. Raises ParameterError for settings that a node refuses,
    GraphError if the graph stops and BagError if the disk fails; with `on_error` CONTINUE the
    flight goes on without a record then. A signal ends the flight in order: it has its effect once
    the bag is whole and the graph is gone. Fast DDS can wait for itself for ever when a graph is
    left: `leave` is given what does that, to be called within a deadline.
    """
    warm_up_nodes(("plant", *case.controllers))
    with signals_wait() as interrupted:
        return _fly_graph(
            case, bag, domain, namespace, realtime, on_error, progress, leave, interrupted
        )


def _fly_graph(
    case: Case,
    bag: Path | None,
    domain: int | None,
    namespace: str,
    realtime: bool,
    on_error: str,
    progress: Callable[[int], None],
    leave: Leave,
    interrupted: Callable[[], bool],
) -> tuple[str, float]:
    keep_to_this_machine()
    log_where_it_can()
    context = rclpy.Context()
    # the terminal is the program's: no word on what goes as it should
    quiet = [*ros_arguments(namespace), "--log-level", "warn"]
    rclpy.init(args=quiet, context=context, domain_id=domain)
    executor = EventsExecutor(context=context)
    nodes: list[BaseNode] = []
    recorder = None
    mode = {REALTIME.name: realtime}
    try:
        if bag is not None:
            settings = {"bag": str(bag), "notes": notes(case), "on_error": on_error} | mode
            recorder = RecorderNode(settings, context)
            nodes.append(recorder)
        nodes += [
            NODES[name].node_class(case.parameters[name] | mode, context)
            for name in case.controllers
        ]
        listeners = len(nodes)
        plant = PlantNode(case.parameters["plant"] | mode | {"listeners": listeners}, context)
        nodes.append(plant)
        for node in nodes:
            node.bring_up()
            executor.add_node(node)
        started = time.perf_counter()
        _spin(executor, plant, recorder, progress, interrupted)
        wall = time.perf_counter() - started
        if interrupted():
            return INTERRUPTED, wall
        if plant.now is None:  # it has sent no state
            raise GraphError(plant.finished.result())
        if plant.count_publishers(plant.full_name(STATE)) > 1:
            raise GraphError(
                f"another plant flew in the namespace {namespace} of this ROS domain: "
                "set ROS_DOMAIN_ID to one of your own"
            )
        if recorder is not None:
            _drain(executor, recorder, loop_topics(case), plant.step)
    finally:
        for node in nodes:
            executor.remove_node(node)
            node.conclude()
        leave(partial(_leave, context, executor, nodes))
    if recorder is not None and recorder.failure is not None and on_error == STOP:
        raise recorder.failure
    return plant.finished.result(), wall


def _leave(context: rclpy.Context, executor: EventsExecutor, nodes: list[BaseNode]) -> None:
    executor.shutdown()
    for node in reversed(nodes):
        node.destroy_node()
    rclpy.shutdown(context=context)


def _spin(
    executor: EventsExecutor,
    plant: PlantNode,
    recorder: RecorderNode | None,
    progress: Callable[[int], None],
    interrupted: Callable[[], bool],
) -> None:
    """Run the graph until the flight is over or interrupted, or until the recorder gives it up.

    The executor looks at the time only when nothing waits for it: in lockstep hardly ever. So
    progress comes by a timer, and the end by a future.
    """
    over = Future(executor=None)
    for node in (plant, recorder):
        if node is not None:
            node.finished.add_done_callback(lambda _: over.done() or over.set_result(None))

    def look() -> None:
        progress(plant.step)
        if interrupted() and not over.done():
            over.set_result(None)

    plant.create_timer(LOOK, look)
    last, since = -1, time.monotonic()
    while not over.done():
        executor.spin_until_future_complete(over, LOOK)
        if plant.step != last:
            last, since = plant.step, time.monotonic()
        elif time.monotonic() - since > LONGEST_SILENCE:
            raise GraphError(
                f"the graph stopped at step {plant.step}: no answer for {LONGEST_SILENCE:g} s"
            )
    if recorder is not None and recorder.failure is not None and recorder.finished.done():
        raise recorder.failure
    progress(plant.step)


def _drain(
    executor: EventsExecutor, recorder: RecorderNode, topics: Sequence[LoopTopic], steps: int
) -> None:
    """Let the recorder take what is still under way."""
    executor.spin_until_future_complete(recorder.finished, LONGEST_SILENCE)
    if recorder.realtime or recorder.failure is not None:
        return  # messages may be missing, and are counted
    missing = recorder.missing(topics, steps)
    if missing:
        raise GraphError(f"the recorder missed {missing} messages")
    surplus = -recorder.balance(topics, steps)
    if surplus:
        raise GraphError(
            f"the bag holds {surplus} messages of another flight: "
            "set ROS_DOMAIN_ID to one of your own"
        )
