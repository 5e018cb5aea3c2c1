"""Parameters of the controller nodes, by default those of section 3.5.2, and their settings."""

from collections.abc import Mapping

from ahv_control.inner_loop import InnerLoop
from ahv_control.intermediate_loop import IntermediateLoop
from ahv_control.outer_loop import OuterLoop
from ahv_control.velocity_loop import VelocityLoop
from ahv_msgs_py.parameters import Parameter, Value
from ahv_plant.parameters import GEOMETRIC_ALTITUDE

FASTEST = 50.0  # [1/s] gains above half the control rate cannot be meant


def _gain(name: str, default: float, description: str) -> Parameter:
    return Parameter(name, default, description, "1/s", 0.0, FASTEST)


OUTER_INTERMEDIATE_PARAMETERS = (
    Parameter("altitude", 24000.0, "altitude command h*", "m", 0.0, 48000.0),
    _gain("k_h", 0.01, "altitude gain, eq 3.1"),
    _gain("k_phi", 0.2, "roll-angle gain, section 3.2"),
    _gain("k_theta", 0.2, "pitch-angle gain, section 3.2"),
    _gain("k_psi", 0.2, "yaw-angle gain, section 3.2"),
)
INNER_LOOP_PARAMETERS = (
    _gain("k_P", 2.0, "roll-rate gain, section 3.3"),
    _gain("k_Q", 2.0, "pitch-rate gain, section 3.3"),
    _gain("k_R", 2.0, "yaw-rate gain, section 3.3"),
    GEOMETRIC_ALTITUDE,
)
VELOCITY_PARAMETERS = (
    Parameter("speed", 1786.4, "forward-speed command u*", "m/s", 0.0, 8000.0),
    _gain("k_u", 0.01, "speed gain, eq 3.2"),
    GEOMETRIC_ALTITUDE,
)

Values = Mapping[str, Value]


def outer_loop(values: Values) -> OuterLoop:
    """Outer-loop settings from checked parameters."""
    return OuterLoop(float(values["altitude"]), float(values["k_h"]))


def intermediate_loop(values: Values) -> IntermediateLoop:
    """Intermediate-loop settings from checked parameters."""
    return IntermediateLoop(*(float(values[name]) for name in IntermediateLoop._fields))


def inner_loop(values: Values) -> InnerLoop:
    """Inner-loop settings from checked parameters."""
    gains = (float(values[name]) for name in ("k_P", "k_Q", "k_R"))
    return InnerLoop(*gains, geometric=bool(values["geometric_altitude"]))


def velocity_loop(values: Values) -> VelocityLoop:
    """Velocity-loop settings from checked parameters."""
    return VelocityLoop(
        float(values["speed"]), float(values["k_u"]), bool(values["geometric_altitude"])
    )
