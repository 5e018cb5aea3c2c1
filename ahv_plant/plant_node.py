"""Node `plant`: the vehicle in lockstep with its flight control."""

from functools import partial
from typing import Any

import rclpy
from geometry_msgs.msg import Quaternion, TransformStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from scipy.spatial.transform import Rotation

from ahv_msgs_py.base_node import ERROR, OK, QOS, BaseNode, message_class, run
from ahv_msgs_py.layout import NANOSECONDS, clock_bytes
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.stepwise import Stepwise, Values
from ahv_msgs_py.topics import (
    BODY_FRAME,
    CLOCK,
    EARTH_FRAME,
    ODOMETRY,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
    TRANSFORM,
)
from ahv_plant.constants import STEP, STEP_NS
from ahv_plant.departure import departure_reason
from ahv_plant.parameters import PLANT_PARAMETERS, plant_settings
from ahv_plant.state import State, Surfaces
from ahv_plant.vehicle import vehicle_step

LONGEST_WAIT = Duration(seconds=5.0)  # for a listener that has stopped, per topic
VIEWER_PERIOD = 10  # steps between messages for viewers: 10 Hz


class PlantNode(BaseNode):
    """Publishes state k at stamp k * 10 ms; integrates to k + 1 when both its commands are there.

    `finished` holds the reason why the flight ended, which is empty when it was flown to its end.
    """

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("plant", PLANT_PARAMETERS, values, context)
        self.flight = plant_settings(self.settings)
        self.step = 0
        self.state = self.flight.initial
        self._started = False
        topics = (SURFACE_COMMAND, THROTTLE_COMMAND)
        self._inputs = Stepwise([topic.name for topic in topics], self._advance)
        for topic in topics:
            self.receive(topic, partial(self._take, topic.name))
        self._clock = self.create_publisher(message_class(CLOCK.type_name), CLOCK.name, QOS)
        self._odometry = self.create_publisher(Odometry, ODOMETRY.name, QOS)
        self._transform = self._transform_publisher()
        self._send_state = self.sender(STATE, self._listeners_changed)

    def _transform_publisher(self) -> Any:
        """Return a publisher of /tf, or None: tf2_msgs is part of ROS 2, but not on PyPI."""
        try:
            return self.create_publisher(message_class(TRANSFORM.type_name), TRANSFORM.name, QOS)
        except ModuleNotFoundError:
            return None

    def _listeners_changed(self, matched: Any) -> None:
        """Start the flight when as many listen as should."""
        if not self._started and matched.current_count >= self.settings["listeners"]:
            self._started = True
            self.report(0, OK, "flying", steps=self.flight.steps)
            self._publish()

    def _publish(self) -> None:
        stamp = self.step * STEP_NS
        self._clock.publish(clock_bytes(stamp))
        if self.step % VIEWER_PERIOD == 0:
            self._publish_for_viewers(stamp)
        self._send_state(stamp, self.state)

    def _take(self, name: str, stamp: int, values: Values) -> None:
        """Take a command, unless it answers a state that was never sent: one of another flight."""
        if self.finished.done():
            return
        if self._started and stamp <= self.step * STEP_NS:
            self._inputs.put(name, stamp, values)
        else:
            self._finish(
                0, ERROR, f"{name} has commands of another flight: restart the controllers"
            )

    def _advance(self, stamp: int, surfaces: Values, throttle: Values) -> None:
        """Integrate one step, or end the flight."""
        if stamp != self.step * STEP_NS or self.finished.done():
            return
        if self.step == self.flight.steps:
            self._finish(stamp, OK, "")
            return
        truth = self.flight.truth
        later = State(
            *vehicle_step(self.state, Surfaces(*surfaces), throttle[0], self.step * STEP, truth)
        )
        reason = departure_reason(later, truth.geometric, (self.step + 1) * STEP)
        if reason:
            self._finish(stamp, ERROR, reason)
            return
        self.state = later
        self.step += 1
        self._publish()

    def _finish(self, stamp: int, level: bytes, reason: str) -> None:
        self.report(stamp, level, reason or "flown to the end", steps=self.step, over=True)
        self.get_logger().info(
            f"flight over after {self.step} steps: {reason or 'flown to its end'}"
        )
        self.finished.set_result(reason)

    def destroy_node(self) -> None:
        """Wait until every listener has got everything, then end."""
        for publisher in self.publishers:
            publisher.wait_for_all_acked(LONGEST_WAIT)
        super().destroy_node()

    def _publish_for_viewers(self, stamp: int) -> None:
        """Send pose and velocity as tools know them: a quaternion is good enough to look at."""
        state = self.state
        position = (state.x, state.y, -state.h)
        rotation = Rotation.from_euler("ZYX", (state.psi, state.theta, state.phi)).as_quat()
        x, y, z, w = (float(part) for part in rotation)
        attitude = Quaternion(x=x, y=y, z=z, w=w)

        odometry = Odometry(child_frame_id=BODY_FRAME)
        pose, twist = odometry.pose.pose, odometry.twist.twist
        pose.position.x, pose.position.y, pose.position.z = position
        pose.orientation = attitude
        twist.linear.x, twist.linear.y, twist.linear.z = state.u, state.v, state.w
        twist.angular.x, twist.angular.y, twist.angular.z = state.P, state.Q, state.R
        _head(odometry.header, stamp)
        self._odometry.publish(odometry)

        if self._transform is not None:
            transform = TransformStamped(child_frame_id=BODY_FRAME)
            shift = transform.transform.translation
            shift.x, shift.y, shift.z = position
            transform.transform.rotation = attitude
            _head(transform.header, stamp)
            self._transform.publish(message_class(TRANSFORM.type_name)(transforms=[transform]))


def _head(header: Any, stamp: int) -> None:
    header.frame_id = EARTH_FRAME
    header.stamp.sec, header.stamp.nanosec = divmod(stamp, NANOSECONDS)


def main() -> None:
    """Run the node."""
    run(PlantNode)
