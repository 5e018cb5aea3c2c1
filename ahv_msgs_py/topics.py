"""The topics of the graph: names, message types, layouts, units and frames.

Frames: `base_link_frd` are body axes forward-right-down, `map_ned` is the flat Earth
north-east-down (REP-103 suffixes). Quality of service, the same for all: reliable, transient
local, keep last 100. Every answer carries the stamp of the state that it answers; transient local
gives a node that joins late the state that it has to answer, so that no order of starting can lose
a step.
"""

from typing import NamedTuple

from ahv_msgs_py.layout import Layout, NamedVector, StampedVector

NAMESPACE = "/ahv"
BODY_FRAME = "base_link_frd"
EARTH_FRAME = "map_ned"
QUEUE_DEPTH = 100  # messages kept per topic, sender and receiver

STATE_NAMES = ("u", "v", "w", "P", "Q", "R", "phi", "theta", "psi", "x", "y", "h", "mass")
SURFACE_NAMES = ("right_elevon", "left_elevon", "rudder")


class LoopTopic(NamedTuple):
    """A topic of the control loop: fixed layout, exact doubles."""

    name: str
    layout: Layout
    units: str
    description: str


class ViewerTopic(NamedTuple):
    """A topic for people and their tools; nothing in the loop reads it."""

    name: str
    type_name: str
    stamp_offset: int | None  # bytes from the start of the message to its stamp in simulated time
    description: str
    durable: bool = True  # transient local; ROS's own parameter events are not


STATE = LoopTopic(
    "/ahv/state",
    NamedVector(BODY_FRAME, STATE_NAMES),
    "m/s, m/s, m/s, rad/s, rad/s, rad/s, rad, rad, rad, m, m, m, kg",
    "vehicle state at 100 Hz",
)
ATTITUDE_COMMAND = LoopTopic(
    "/ahv/attitude_command",
    StampedVector(EARTH_FRAME, ("phi", "theta", "psi")),
    "rad",
    "attitude command phi*, theta*, psi* of the outer loop",
)
RATE_COMMAND = LoopTopic(
    "/ahv/rate_command",
    StampedVector(BODY_FRAME, ("P", "Q", "R")),
    "rad/s",
    "body-rate command P*, Q*, R* of the intermediate loop",
)
SURFACE_COMMAND = LoopTopic(
    "/ahv/surface_command",
    NamedVector(BODY_FRAME, SURFACE_NAMES),
    "rad",
    "deflections delta_e, delta_a, delta_r of the inner loop",
)
THROTTLE_COMMAND = LoopTopic(
    "/ahv/throttle_command",
    NamedVector(BODY_FRAME, ("throttle",)),
    "1",
    "throttle sigma_T of the velocity loop",
)
LOOP_TOPICS = (STATE, ATTITUDE_COMMAND, RATE_COMMAND, SURFACE_COMMAND, THROTTLE_COMMAND)

CLOCK = ViewerTopic("/clock", "rosgraph_msgs/msg/Clock", 4, "simulated time at 100 Hz")
ODOMETRY = ViewerTopic(
    "/ahv/odometry",
    "nav_msgs/msg/Odometry",
    4,
    "pose and velocity at 10 Hz, map_ned, base_link_frd",
)
TRANSFORM = ViewerTopic("/tf", "tf2_msgs/msg/TFMessage", 8, "map_ned to base_link_frd at 10 Hz")
DIAGNOSTICS = ViewerTopic(
    "/diagnostics",
    "diagnostic_msgs/msg/DiagnosticArray",
    4,
    "health of the nodes, on every change",
)
LOG = ViewerTopic("/rosout", "rcl_interfaces/msg/Log", None, "log of all nodes")
PARAMETER_EVENTS = ViewerTopic(
    "/parameter_events", "rcl_interfaces/msg/ParameterEvent", None, "changes of parameters", False
)
VIEWER_TOPICS = (CLOCK, ODOMETRY, TRANSFORM, DIAGNOSTICS, LOG, PARAMETER_EVENTS)
