# Copyright 2026 ahv developers, Apache-2.0
"""Node `plant`: the vehicle, in lockstep with its flight control or by the wall clock."""

import time
from array import array
from collections.abc import Callable
from functools import partial
from typing import Any

import rclpy
from geometry_msgs.msg import Point, Quaternion, TransformStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from visualization_msgs.msg import Marker

from ahv_msgs_py.layout import NANOSECONDS, clock_bytes
from ahv_msgs_py.node.base_node import BaseNode
from ahv_msgs_py.node.faults import HOLD, Fault
from ahv_msgs_py.node.health import ERROR, MILLISECONDS, OK, percentile
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.process import run
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.synchronizer import Values
from ahv_msgs_py.parameters import Value
from ahv_msgs_py.topics import (
    BODY_FRAME,
    CLOCK,
    EARTH_FRAME,
    ENDED_EARLY,
    FLIGHT,
    FLOWN,
    FLYING,
    HARDWARE_TOPICS,
    LOOP_TOPICS,
    MARKER,
    ODOMETRY,
    ODOMETRY_ENU,
    ROBOTICS_FRAMES,
    STATE,
    STATIC_TRANSFORM,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
    TRANSFORM,
    LoopTopic,
    ViewerTopic,
)
from ahv_plant.model.constants import STEP, STEP_NS
from ahv_plant.model.vectors import Controls, Surfaces
from ahv_plant.parameters import PLANT_PARAMETERS, plant_settings
from ahv_plant.plant_flight import PlantFlight, warm_up_plant
from ahv_plant.safe_command import SAFE_THROTTLE, safe_surfaces
from ahv_plant.termination import termination, termination_reason
from ahv_plant.viewer_pose import (
    FLU_IN_FRD,
    NED_IN_ENU,
    Pose,
    Vector,
    enu_pose,
    ned_pose,
)
from ahv_plant.winged_cone import body

LONGEST_WAIT = 2.0  # [s] for a listener that has stopped
VIEWER_PERIOD = 10  # steps between messages for viewers: 10 Hz


class Held:
    """The newest valid command of a topic, in real time."""

    def __init__(self, topic: LoopTopic, values: Values):
        """`values` stand in until the first command comes."""
        self.topic = topic
        self.stamp = -STEP_NS  # [ns] of the state that it answers
        self.values = values


class PlantNode(BaseNode):
    """Publishes state k at stamp k * 10 ms, as measured, and flies the plant to k + 1.

    In lockstep when both commands of k are there; in real time when the 10 ms are over, with the
    newest valid commands. `finished` holds the reason why the flight ended, which is empty when it
    was flown to its end.
    """

    laws = (termination,)  # and the plant's own, which depend on what there is of it

    def __init__(
        self, values: dict[str, Value] | None = None, context: rclpy.Context | None = None
    ):
        """`values` overrides parameters."""
        super().__init__("plant", PLANT_PARAMETERS, values, context)

    def prepare(self, settings: dict[str, Value]) -> None:
        """Set up the vehicle, its hardware and its flight."""
        self.flight = plant_settings(settings)
        warm_up_plant(self.flight)
        self.flown = PlantFlight(self.flight)
        self.step = 0
        self.plant = self.flown.start

    def start(self) -> None:
        """Open the topics; the flight starts, or goes on, when as many listen as should."""
        self._flying = False
        self._listeners: dict[bytes, str] = {}  # nodes that hear the state, by their GID
        self._surfaces = Held(SURFACE_COMMAND, (0.0, 0.0, 0.0))
        self._throttle = Held(THROTTLE_COMMAND, (SAFE_THROTTLE,))
        self._answered_state = self.plant.measured.state  # in real time, the last one
        self._latencies = array("q")  # [ns] from a state to both its commands
        self._published = 0  # [ns] when the newest state was
        if self.realtime:
            for held in (self._surfaces, self._throttle):
                self.receive(held.topic, partial(self._hold, held))
        else:
            topics = (SURFACE_COMMAND, THROTTLE_COMMAND)
            put = self.in_lockstep([self.full_name(topic) for topic in topics], self._answered)
            for topic in topics:
                self.receive(topic, partial(self._take, put, self.full_name(topic)))
        viewers = quality(True, self.sender_depth)
        self._send_clock = self.publisher(CLOCK.type_name, CLOCK.name, viewers)
        self._odometry = self.publisher(ODOMETRY.type_name, ODOMETRY.name, viewers)
        self._odometry_enu = self.publisher(ODOMETRY_ENU.type_name, ODOMETRY_ENU.name, viewers)
        self._marker = self.publisher(MARKER.type_name, MARKER.name, viewers)
        self._transform = self._transform_publisher(TRANSFORM, viewers)
        self._static_transform = self._transform_publisher(STATIC_TRANSFORM, quality(True, 1))
        self._send_flight = self.sender(FLIGHT)
        if self.flight.hardware is not None:
            self._send_surfaces, self._send_truth = map(self.sender, HARDWARE_TOPICS)
        self._send_state = self.sender(STATE, self._listeners_changed)

    def _transform_publisher(self, topic: ViewerTopic, qos: QoSProfile) -> Any:
        """Return what publishes transforms, at best: tf2_msgs is in ROS 2, but not on PyPI."""
        try:
            publisher = self.publisher(topic.type_name, topic.name, qos)
        except ModuleNotFoundError:
            return lambda transforms: None
        message_type = message_class(topic.type_name)
        return lambda transforms: publisher.publish(message_type(transforms=transforms))

    def _listeners_changed(self, matched: Any) -> None:
        """Start the flight when as many listen as should; say so when some have gone."""
        if self.finished.done():
            return
        if self._flying:
            self._check_listeners()
        elif matched.current_count >= int(self.settings["listeners"]):
            self._start_flight()

    def _start_flight(self) -> None:
        """Send the first state, unless nobody can know whose commands would be obeyed."""
        for topic in LOOP_TOPICS:
            name = self.full_name(topic)
            publishers = self.count_publishers(name)
            # a plant that was killed may yet have those of its own
            if publishers > 1 and topic not in (STATE, *HARDWARE_TOPICS):
                reason = f"{name} has {publishers} publishers: end all but one of them"
                self._finish(self.step * STEP_NS, ERROR, f"refused to fly: {reason}")
                return
        self._flying = True
        self.announce(self.step * STEP_NS, OK, "flying", steps=self.flight.steps)
        if self.realtime:
            timer = self.create_timer(STEP, self._tick)
            self._opened.append(partial(self.destroy_timer, timer))
            self._ticked = time.monotonic_ns()
        self._publish()

    def _check_listeners(self) -> None:
        """Name the nodes of the graph that do not listen to the state any more."""
        listeners = {
            bytes(one.endpoint_gid): one.node_name
            for one in self.get_subscriptions_info_by_topic(self.full_name(STATE))
            if one.node_namespace == self.get_namespace()
        }
        for gid in self._listeners.keys() - listeners.keys():
            name = self._listeners[gid]
            text = f"{name} does not listen to the state any more"
            self.fault(self.step * STEP_NS, Fault.LISTENER_LOST, text)
        self._listeners = listeners

    def _publish(self) -> None:
        stamp = self.step * STEP_NS
        self.now = stamp
        self._send_clock.publish(clock_bytes(stamp))
        if not self.realtime and stamp % NANOSECONDS == 0 and stamp:
            self.report_health(stamp)
        if self.realtime:
            self._published = time.monotonic_ns()
        self.health.state_came()
        measured = self.plant.measured
        if self.flight.hardware is not None:  # first: what is learned is learned at a state
            self._send_surfaces(stamp, measured.surfaces)
            self._send_truth(stamp, self.plant.state)
        self._send_state(stamp, measured.state)
        if self.step % VIEWER_PERIOD == 0:  # while the controllers are at work
            self._publish_for_viewers(stamp)
        if stamp % NANOSECONDS == 0:
            self._send_flight(stamp, (self.flight.steps, self.step, FLYING))
            self._check_listeners()

    # Lockstep

    def _take(
        self, put: Callable[[str, int, Values], None], name: str, stamp: int, values: Values
    ) -> None:
        """Take a command, unless it answers a state that was never sent: one of another flight."""
        if self.finished.done():
            return
        if self._flying and stamp <= self.step * STEP_NS:
            put(name, stamp, values)
        else:
            self._finish(
                0, ERROR, f"{name} has commands of another flight: restart the controllers"
            )

    def _answered(self, stamp: int, surfaces: Values, throttle: Values) -> None:
        """Integrate one step with the commands that answer the newest state."""
        if stamp == self.step * STEP_NS and not self.finished.done():
            self.health.answered()
            self._advance(surfaces, throttle)

    # Real time

    def _hold(self, held: Held, stamp: int, values: Values) -> None:
        """Keep a valid command; time the step if it is its last."""
        held.stamp, held.values = stamp, values
        if stamp == self.now and self._surfaces.stamp == self._throttle.stamp:
            self._latencies.append(time.monotonic_ns() - self._published)
            self.health.answered()

    def _tick(self) -> None:
        """Integrate one step with the commands that are held, however old they are."""
        if self.finished.done():
            return
        now = time.monotonic_ns()
        lost = (now - self._ticked) // STEP_NS - 1
        if lost > 0:
            self.fault(self.step * STEP_NS, Fault.TICK_MISSED, f"{lost} in a row", lost)
        self._ticked = now
        surfaces = self._command(self._surfaces)
        if surfaces is None:
            held = Surfaces(*self._surfaces.values)
            surfaces = safe_surfaces(held, self._answered_state, self.plant.measured.state)
        elif self._surfaces.stamp == self.now:
            self._answered_state = self.plant.measured.state
        throttle = self._command(self._throttle) or self._throttle.values
        self._advance(surfaces, throttle)

    def _command(self, held: Held) -> Values | None:
        """Return the held command, or None if it has been held for too long."""
        stamp = self.step * STEP_NS
        age = stamp - held.stamp
        if age == 0:
            return held.values
        name = self.full_name(held.topic)
        self.fault(stamp, Fault.LATE, f"{name}: the last one is {age * 1e-9:g} s old")
        if age <= HOLD:
            return held.values
        self.fault(stamp, Fault.COMMAND_LOST, f"{name}: none for {age * 1e-9:g} s")
        return None

    # Both

    def _advance(self, surfaces: Values, throttle: Values) -> None:
        """Integrate one step, or end the flight."""
        stamp = self.step * STEP_NS
        if self.step == self.flight.steps:
            self._finish(stamp, OK, "")
            return
        command = Controls(Surfaces(*surfaces), throttle[0])
        later = self.flown.later(self.plant, command, self.step)
        geometric = self.flight.truth.geometric
        reason = termination_reason(later.state, geometric, (self.step + 1) * STEP)
        if reason:
            self._finish(stamp, ERROR, reason)
            return
        self.plant = later
        self.step += 1
        self._publish()

    def _finish(self, stamp: int, level: bytes, reason: str) -> None:
        facts: dict[str, object] = {"steps": self.step, "over": True}
        facts |= {fault.name.lower(): count for fault, count in self.health.total.items()}
        if self.realtime and self._latencies:
            ordered = array("q", sorted(self._latencies))
            for name, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0)):
                facts[f"latency_ms_{name}"] = f"{percentile(ordered, share) * MILLISECONDS:.3f}"
        self.results = facts
        end = ENDED_EARLY if reason else FLOWN
        self._send_flight((self.step + 1) * STEP_NS, (self.flight.steps, self.step, end))
        self.announce(stamp, level, reason or "flown to the end", **facts)
        self.get_logger().info(
            f"flight over after {self.step} steps: {reason or 'flown to its end'}"
        )
        self.finished.set_result(reason)

    def conclude(self) -> None:
        """Wait until every listener has got everything."""
        until = time.monotonic() + LONGEST_WAIT
        for publisher in self.publishers:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, until - time.monotonic())))

    def _publish_for_viewers(self, stamp: int) -> None:
        """Send pose and velocity in both conventions; once what does not change."""
        state = self.plant.state
        ned, enu = ned_pose(state), enu_pose(state)
        self._odometry.publish(_odometry(stamp, ned, EARTH_FRAME, BODY_FRAME))
        self._odometry_enu.publish(_odometry(stamp, enu, *ROBOTICS_FRAMES))
        if self.step == 0:
            self._marker.publish(_marker(stamp))
            self._static_transform(static_transforms(stamp))
        moved = _transform(stamp, EARTH_FRAME, BODY_FRAME, ned.position, ned.attitude)
        self._transform([moved])


def _head(header: Any, stamp: int, frame: str) -> None:
    header.frame_id = frame
    header.stamp.sec, header.stamp.nanosec = divmod(stamp, NANOSECONDS)


def _odometry(stamp: int, pose: Pose, earth: str, body: str) -> Odometry:
    message = Odometry(child_frame_id=body)
    place, twist = message.pose.pose, message.twist.twist
    place.position.x, place.position.y, place.position.z = pose.position
    place.orientation = _attitude(pose.attitude)
    twist.linear.x, twist.linear.y, twist.linear.z = pose.velocity
    twist.angular.x, twist.angular.y, twist.angular.z = pose.rates
    _head(message.header, stamp, earth)
    return message


def _attitude(parts: tuple[float, float, float, float]) -> Quaternion:
    x, y, z, w = parts
    return Quaternion(x=x, y=y, z=z, w=w)


def _transform(
    stamp: int, parent: str, child: str, shift: Vector, turn: tuple[float, float, float, float]
) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    to = message.transform.translation
    to.x, to.y, to.z = shift
    message.transform.rotation = _attitude(turn)
    _head(message.header, stamp, parent)
    return message


def static_transforms(stamp: int) -> list[TransformStamped]:
    """Between the frames of aviation and those of robotics, at `stamp` [ns]."""
    earth, body = ROBOTICS_FRAMES
    still = (0.0, 0.0, 0.0)
    return [
        _transform(stamp, earth, EARTH_FRAME, still, NED_IN_ENU),
        _transform(stamp, BODY_FRAME, body, still, FLU_IN_FRD),
    ]


def _marker(stamp: int) -> Marker:
    """Return the winged cone as triangles that move with the body's frame."""
    message = Marker(ns="ahv", type=Marker.TRIANGLE_LIST, frame_locked=True)
    message.pose.orientation.w = 1.0
    message.scale.x = message.scale.y = message.scale.z = 1.0
    message.color.r, message.color.g, message.color.b, message.color.a = 0.45, 0.5, 0.6, 1.0
    message.points = [Point(x=x, y=y, z=z) for x, y, z in body()]
    _head(message.header, stamp, BODY_FRAME)
    return message


def main() -> None:
    """Run the node."""
    run(PlantNode)
