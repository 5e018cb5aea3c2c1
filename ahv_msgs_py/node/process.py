# Copyright 2026 ahv developers, Apache-2.0
"""A node as a process: start, spin, end."""

import signal
import sys
from collections.abc import Callable

import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.deadline import end_within
from ahv_msgs_py.node.log_folder import log_where_it_can
from ahv_msgs_py.node.managed_node import AUTOSTART
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.node.real_time import take_precedence
from ahv_msgs_py.parameter_file import given_files
from ahv_msgs_py.parameters import ParameterError
from ahv_msgs_py.program import SIGNALS

LOOK = 0.2  # [s] between looks for a signal; a finite time, or the executor spins
SETTLE = 0.05  # [s] of the executor at the end
LONGEST_TEARDOWN = 2.0  # [s] of a node that has done what it had to


def run(node_class: Callable[[], BaseNode]) -> None:
    """Entry point of a node: run it until its `finished` is set or a signal comes.

    It configures and activates itself; with `autostart` false the lifecycle services do that.
    """
    keep_to_this_machine()
    came: list[int] = []
    # Never in the middle of a message, and a second one changes nothing, nor does it wait for the
    # first, as it would for a lock: it may come while that is being answered.
    for number in SIGNALS:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        log_where_it_can()
        given_files(sys.argv)
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, ParameterError) as error:  # arguments that ROS itself refuses
        print(" ".join(str(error).split()), file=sys.stderr)
        sys.exit(2)
    code = 1  # if something happens that nobody thought of
    node = None
    executor = EventsExecutor()
    try:
        node = node_class()
        executor.add_node(node)
        if node.realtime:
            take_precedence()
        if node.refusal or node.settings[AUTOSTART.name]:
            node.bring_up()
        while not (node.finished.done() or came):
            executor.spin_until_future_complete(node.finished, LOOK)
        # what was begun is ended, or the executor holds the node and all that it has of DDS
        executor.spin_until_future_complete(Future(executor=None), SETTLE)
        code = 1 if node.finished.done() and node.finished.result() else 0
    except ParameterError as error:
        print(error, file=sys.stderr)
        code = 2
    finally:
        if node is not None:
            executor.remove_node(node)
            node.conclude()
        end_within(LONGEST_TEARDOWN, code)
        executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    sys.exit(code)
