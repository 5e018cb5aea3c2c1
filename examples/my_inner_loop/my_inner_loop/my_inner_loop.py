# Copyright 2026 ahv developers, Apache-2.0
"""An inner loop of one's own: body rates to surfaces by proportional and integral feedback.

All it knows of the vehicle is how much angular acceleration a surface gives in cruise.
"""

from collections import defaultdict
from contextlib import suppress
from functools import partial

import rclpy
from geometry_msgs.msg import Vector3Stamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState

QOS = QoSProfile(depth=20_000, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # as docs/messages.md
NAMES = ["right_elevon", "left_elevon", "rudder"]
ROLL, PITCH, YAW = 5.11, 1.146, -0.668  # [1/s^2] by elevons opposed, elevons together, rudder
TRIM = -0.126  # [rad] both elevons in cruise
K, K_I, STEP = 2.0, 4.0, 0.01  # [1/s], [1/s^2], [s]


class MyInnerLoop(Node):
    """Answers every state and its rate command with a surface command of the same stamp."""

    def __init__(self):
        """Start with nothing learned."""
        super().__init__("inner_loop", namespace="/ahv")
        self.inputs = defaultdict(dict)  # of every step that is not answered yet
        self.integral = [0.0, 0.0, 0.0]  # [rad] of the rate errors
        self.publisher = self.create_publisher(JointState, "surface_command", QOS)
        for name, kind in (("state", JointState), ("rate_command", Vector3Stamped)):
            self.create_subscription(kind, name, partial(self.collect, name), QOS)

    def collect(self, name, message):
        """Keep an input until the other one of its step is there: they come in any order."""
        stamp = message.header.stamp.sec, message.header.stamp.nanosec
        self.inputs[stamp][name] = message
        if len(self.inputs[stamp]) == 2:
            self.answer(**self.inputs.pop(stamp))

    def answer(self, state, rate_command):
        """Ask the surfaces for the angular acceleration that closes the errors of P, Q, R."""
        demand = []  # [rad/s^2]
        for axis, (name, rate) in enumerate(zip("xyz", state.position[3:6], strict=True)):
            error = getattr(rate_command.vector, name) - rate
            self.integral[axis] += STEP * error
            demand.append(K * error + K_I * self.integral[axis])
        together, opposed = TRIM + demand[1] / PITCH, demand[0] / ROLL
        surfaces = [together + opposed, together - opposed, demand[2] / YAW]
        surfaces = [min(max(surface, -0.69), 0.52) for surface in surfaces]  # inside the stops
        self.publisher.publish(JointState(header=state.header, name=NAMES, position=surfaces))


def main():
    """Run the node until Ctrl-C."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(MyInnerLoop())


if __name__ == "__main__":
    main()
