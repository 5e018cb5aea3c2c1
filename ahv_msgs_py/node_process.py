"""A node as a process: start, spin, end."""

import os
import signal
import sys
from collections.abc import Callable

import rclpy
from rclpy.experimental import EventsExecutor

from ahv_msgs_py.base_node import AUTOSTART, BaseNode
from ahv_msgs_py.parameters import ParameterError

FOREVER = 1e6  # [s] the executor must wait with a finite time, or it spins and is deaf to signals


def run(node_class: Callable[[], BaseNode]) -> None:
    """Entry point of a node: run it until its `finished` is set or a signal comes.

    It configures and activates itself; with `autostart` false the lifecycle services do that.
    """
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    try:
        rclpy.init()
    except RuntimeError as error:  # arguments that ROS itself refuses
        print(" ".join(str(error).split()), file=sys.stderr)
        sys.exit(2)
    code = 0
    node = None
    executor = EventsExecutor()
    try:
        node = node_class()
        executor.add_node(node)
        if node.refusal or node.settings[AUTOSTART.name]:
            node.bring_up()
        executor.spin_until_future_complete(node.finished, FOREVER)
        code = 1 if node.finished.result() else 0
    except ParameterError as error:
        print(error, file=sys.stderr)
        code = 2
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    finally:
        # a second Ctrl-C must not cut the ending short
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if node is not None:
            executor.remove_node(node)
        executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    sys.exit(code)
