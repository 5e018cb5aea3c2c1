# Copyright 2026 ahv developers, Apache-2.0
"""Where a flight starts (section 3.5.2), and which altitude h is: what plant and law both know."""

from ahv_msgs_py.parameters import Parameter
from ahv_plant.model.constants import INITIAL_MASS, RADIANS
from ahv_plant.model.mass import MASS_MAXIMUM, MASS_MINIMUM
from ahv_plant.model.vectors import State

GEOMETRIC_ALTITUDE = Parameter(
    "geometric_altitude", False, "h is geometric altitude; if false, geopotential as in the report"
)

START_PARAMETERS = (
    Parameter("initial.u", 1786.4, "body velocity forward", "m/s", 0.0, 8000.0),
    Parameter("initial.v", 0.0, "body velocity right", "m/s", -500.0, 500.0),
    Parameter("initial.w", 91.8, "body velocity down", "m/s", -500.0, 500.0),
    Parameter("initial.P", 0.0, "roll rate", "deg/s", -90.0, 90.0),
    Parameter("initial.Q", 0.0, "pitch rate", "deg/s", -90.0, 90.0),
    Parameter("initial.R", 0.0, "yaw rate", "deg/s", -90.0, 90.0),
    Parameter("initial.phi", 0.0, "roll angle", "deg", -180.0, 180.0),
    Parameter("initial.theta", 2.94, "pitch angle", "deg", -89.0, 89.0),
    Parameter("initial.psi", 0.0, "yaw angle", "deg", -180.0, 180.0),
    Parameter("initial.x", 0.0, "distance north", "m", -1e7, 1e7),
    Parameter("initial.y", 0.0, "distance east", "m", -1e7, 1e7),
    Parameter("initial.h", 24000.0, "altitude", "m", 0.0, 48000.0),
    Parameter("initial.mass", INITIAL_MASS, "mass", "kg", MASS_MINIMUM, MASS_MAXIMUM),
)

# Section 3.5.2: where flights start, and what a law is tried out on before it flies.
DEFAULT_START = State(
    **{
        name: float(parameter.default) * (RADIANS if parameter.unit.startswith("deg") else 1.0)
        for parameter in START_PARAMETERS
        for name in [parameter.name.removeprefix("initial.")]
    }
)
