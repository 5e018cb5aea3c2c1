# Copyright 2026 ahv developers, Apache-2.0
"""The topics of the graph: names, message types, layouts, units and frames.

Frames: `base_link_frd` are body axes forward-right-down, `map_ned` is the flat Earth
north-east-down (REP-103 suffixes). Every answer carries the stamp of the state that it answers.
Quality of service in lockstep: reliable, transient local, the last 200 s of flight kept, so that
a node that joins late gets what it missed, and a recorder that is slow gets everything. In real
time: volatile, short queues, receivers that do not wait for what was lost, for old messages would
not be obeyed; a recorder listens reliably.
"""

from sys import float_info
from typing import NamedTuple

from ahv_msgs_py.layout import Layout, NamedVector, StampedAcceleration, StampedVector

NAMESPACE = "/ahv"  # of a vehicle, unless it is given another: then its topics are there
BODY_FRAME = "base_link_frd"
EARTH_FRAME = "map_ned"
ROBOTICS_FRAMES = ("map", "base_link")  # east-north-up, forward-left-up, for tools that assume it
QUEUE_DEPTH = 20_000  # messages kept per topic, sender and receiver: 200 s of flight

STATE_NAMES = ("u", "v", "w", "P", "Q", "R", "phi", "theta", "psi", "x", "y", "h", "mass")
BASIS_NAMES = ("one", "P", "P2", "Q", "Q2", "P2Q2", "R", "R2", "P2R2", "Q2R2", "P2Q2R2")
LEARNER_NAMES = (
    *(f"{plant}.{rate}" for plant in ("X_a", "X_d") for rate in "PQR"),
    *(f"W_{rate}.{term}" for rate in "PQR" for term in BASIS_NAMES),
)
SURFACE_NAMES = ("right_elevon", "left_elevon", "rudder")


def relative(name: str) -> str:
    """Name of a topic as nodes open it: within their namespace, or absolute as `/clock`."""
    return name.removeprefix(f"{NAMESPACE}/")


def within(namespace: str, name: str) -> str:
    """Name that a topic has in a namespace."""
    return name if relative(name) == name else f"{namespace.rstrip('/')}/{relative(name)}"


class LoopTopic(NamedTuple):
    """A topic of the control loop: fixed layout, exact doubles."""

    name: str  # in the default namespace
    layout: Layout
    units: str
    bounds: tuple[tuple[float, float], ...]  # of every field: beyond, a value cannot be meant
    description: str


class ViewerTopic(NamedTuple):
    """A topic for people and their tools; no step of the loop waits for it."""

    name: str
    type_name: str
    stamp_offset: int | None  # bytes from the start of the message to its stamp in simulated time
    description: str
    durable: bool = True  # transient local; ROS's own parameter events are not


# Bounds: beyond them a value cannot be meant. What has no bound of its own must be finite.
FINITE = (-float_info.max, float_info.max)
_DEFLECTION = (-0.7, 0.55)  # [rad] a little beyond the stops
_THROTTLE = (0.0, 1.0)  # [-]
_MASS = (1.0, 1e7)  # [kg]
_RIGHT_ANGLE = 1.5708  # [rad] a little more, of a bank


STATE = LoopTopic(
    "/ahv/state",
    NamedVector(BODY_FRAME, STATE_NAMES),
    "m/s, m/s, m/s, rad/s, rad/s, rad/s, rad, rad, rad, m, m, m, kg",
    (FINITE,) * 12 + (_MASS,),
    "vehicle state at 100 Hz, as the flight software is told it",
)
ATTITUDE_COMMAND = LoopTopic(
    "/ahv/attitude_command",
    StampedVector(EARTH_FRAME, ("phi", "theta", "psi")),
    "rad",
    (FINITE,) * 3,
    "attitude command phi*, theta*, psi* of the outer loop",
)
RATE_COMMAND = LoopTopic(
    "/ahv/rate_command",
    StampedVector(BODY_FRAME, ("P", "Q", "R")),
    "rad/s",
    (FINITE,) * 3,
    "body-rate command P*, Q*, R* of the intermediate loop",
)
SURFACE_COMMAND = LoopTopic(
    "/ahv/surface_command",
    NamedVector(BODY_FRAME, SURFACE_NAMES),
    "rad",
    (_DEFLECTION,) * 3,
    "deflections delta_e, delta_a, delta_r of the inner loop",
)
THROTTLE_COMMAND = LoopTopic(
    "/ahv/throttle_command",
    NamedVector(BODY_FRAME, ("throttle",)),
    "1",
    (_THROTTLE,),
    "throttle sigma_T of the velocity loop",
)
REFERENCE = LoopTopic(
    "/ahv/reference",
    NamedVector(
        EARTH_FRAME,
        ("altitude", "speed", "phi", "psi", "altitude_rate", "speed_rate", "psi_rate"),
    ),
    "m, m/s, rad, rad, m/s, m/s^2, rad/s",
    ((-1e3, 1e5), (0.0, 1e4), (-_RIGHT_ANGLE, _RIGHT_ANGLE)) + (FINITE,) * 4,
    "what the loops are to follow: h*, u*, phi*, psi* and rates, of flights with guidance",
)
NOMINAL_TOPICS = (STATE, ATTITUDE_COMMAND, RATE_COMMAND, SURFACE_COMMAND, THROTTLE_COMMAND)

DISTURBANCE_ESTIMATE = LoopTopic(
    "/ahv/disturbance_estimate",
    StampedAcceleration(BODY_FRAME, ("x", "y", "z", "P", "Q", "R")),
    "m/s^2, m/s^2, m/s^2, rad/s^2, rad/s^2, rad/s^2",
    (FINITE,) * 6,
    "learned disturbance d-hat of the rates of P, Q, R, as angular acceleration; no linear part",
)
LEARNER = LoopTopic(
    "/ahv/learner",
    NamedVector(BODY_FRAME, LEARNER_NAMES),
    ", ".join(["rad/s"] * 6 + ["deg/s^2 by that of the term in deg/s"] * (3 * len(BASIS_NAMES))),
    (FINITE,) * len(LEARNER_NAMES),
    "state of the disturbance learner: approximate plant, desired plant, weights of every term",
)
LEARNER_TOPICS = (DISTURBANCE_ESTIMATE, LEARNER)

SURFACES = LoopTopic(
    "/ahv/surfaces",
    NamedVector(BODY_FRAME, SURFACE_NAMES),
    "rad",
    (FINITE,) * 3,  # a sensor may show what no surface can do
    "positions of the surfaces as measured, of flights whose hardware is not ideal",
)
TRUTH = LoopTopic(
    "/ahv/truth",
    STATE.layout,
    STATE.units,
    STATE.bounds,
    "true state, of flights whose hardware is not ideal; then /ahv/state is as measured",
)
HARDWARE_TOPICS = (SURFACES, TRUTH)
SPECIAL_TOPICS = (REFERENCE, *HARDWARE_TOPICS)  # of flights with guidance, or with hardware
LOOP_TOPICS = (*NOMINAL_TOPICS, REFERENCE, *LEARNER_TOPICS, *HARDWARE_TOPICS)
BY_NAME = {relative(topic.name): topic for topic in LOOP_TOPICS}  # as the graph has them

# Not of every step: once a second, and at the end of the flight.
FLYING, FLOWN, ENDED_EARLY = range(3)
FLIGHT = LoopTopic(
    "/ahv/flight",
    NamedVector(EARTH_FRAME, ("planned", "steps", "end")),
    "1, 1, 1",
    ((0.0, 1e9), (0.0, 1e9), (FLYING, ENDED_EARLY)),
    "steps planned and flown; end is 0 in flight, 1 flown to the end, 2 ended early",
)

CLOCK = ViewerTopic("/clock", "rosgraph_msgs/msg/Clock", 4, "simulated time at 100 Hz")
ODOMETRY = ViewerTopic(
    "/ahv/odometry",
    "nav_msgs/msg/Odometry",
    4,
    "pose and velocity at 10 Hz, map_ned, base_link_frd",
)
ODOMETRY_ENU = ViewerTopic(
    "/ahv/odometry_enu",
    "nav_msgs/msg/Odometry",
    4,
    "the same in the frames of REP-103, map, base_link",
)
MARKER = ViewerTopic(
    "/ahv/vehicle_marker",
    "visualization_msgs/msg/Marker",
    4,
    "the winged cone as triangles in base_link_frd, once",
)
TRANSFORM = ViewerTopic(
    "/tf",
    "tf2_msgs/msg/TFMessage",
    8,
    "map_ned to base_link_frd, at 10 Hz",
)
STATIC_TRANSFORM = ViewerTopic(
    "/tf_static",
    "tf2_msgs/msg/TFMessage",
    8,
    "map to map_ned and base_link_frd to base_link, which do not change, once",
)
SETTINGS = ViewerTopic(
    "/ahv/settings",
    "std_msgs/msg/String",
    None,
    "parameters of every node as JSON, once and again when it starts again",
)
SELECTION = ViewerTopic(
    "/ahv/selection",
    "sensor_msgs/msg/JointState",
    None,
    "altitude [m], speed [m/s], psi [rad], or some of these, for guidance to fly; by anybody",
    False,
)
DIAGNOSTICS = ViewerTopic(
    "/diagnostics",
    "diagnostic_msgs/msg/DiagnosticArray",
    4,
    "health of the nodes, at 1 Hz and on every change",
)
LOG = ViewerTopic("/rosout", "rcl_interfaces/msg/Log", None, "log of all nodes")
PARAMETER_EVENTS = ViewerTopic(
    "/parameter_events", "rcl_interfaces/msg/ParameterEvent", None, "changes of parameters", False
)
VIEWER_TOPICS = (
    CLOCK,
    ODOMETRY,
    ODOMETRY_ENU,
    MARKER,
    TRANSFORM,
    STATIC_TRANSFORM,
    SETTINGS,
    SELECTION,
    DIAGNOSTICS,
    LOG,
    PARAMETER_EVENTS,
)
