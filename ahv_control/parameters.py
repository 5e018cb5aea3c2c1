# Copyright 2026 ahv developers, Apache-2.0
"""Parameters of the controller nodes, by default those of section 3.5.2, and their settings."""

from collections.abc import Mapping
from math import inf

from ahv_control.disturbance_learner import LearnerSettings
from ahv_control.error_dynamics import ErrorDynamics
from ahv_control.guidance_parameters import GUIDED
from ahv_control.inner_loop import InnerLoop
from ahv_control.intermediate_loop import IntermediateLoop
from ahv_control.outer_loop import AltitudeIntegral, OuterLoop
from ahv_control.servo_model import ServoModel
from ahv_control.velocity_loop import VelocityLoop
from ahv_msgs_py.parameters import Parameter, Value
from ahv_plant.model.constants import RADIANS
from ahv_plant.model.vectors import Rates
from ahv_plant.start import GEOMETRIC_ALTITUDE

FASTEST = 50.0  # [1/s] gains above half the control rate cannot be meant
# the surfaces that the observer of eq 4.3 hears
COMMANDED, MODELLED, MEASURED = "commanded", "modelled", "measured"


def _gain(name: str, default: float, description: str, in_flight: bool = True) -> Parameter:
    return Parameter(name, default, description, "1/s", 0.0, FASTEST, in_flight)


OUTER_INTERMEDIATE_PARAMETERS = (
    Parameter(
        "altitude",
        24000.0,
        "altitude command h* without guidance",
        "m",
        0.0,
        48000.0,
        in_flight=True,
    ),
    _gain("k_h", 0.01, "altitude gain, eq 3.1"),
    _gain("k_phi", 0.2, "roll-angle gain, section 3.2"),
    _gain("k_theta", 0.2, "pitch-angle gain, section 3.2"),
    _gain("k_psi", 0.2, "yaw-angle gain, section 3.2"),
    Parameter(
        "alpha_limit",
        180.0,
        "angle of attack that commands stay within; 180 is off",
        "deg",
        0.1,
        180.0,
        in_flight=True,
    ),
    Parameter(
        "climb_limit",
        90.0,
        "climb angle that is never exceeded by what is asked for; 90 is off",
        "deg",
        0.1,
        90.0,
        in_flight=True,
    ),
    Parameter(
        "k_i_h",
        0.0,
        "rate at which integral action takes out an altitude error that stays; 0 is off",
        "1/s",
        0.0,
        1.0,
    ),
    Parameter(
        "integral_limit",
        10.0,
        "rate of climb that the integral action never exceeds",
        "m/s",
        0.001,
        1000.0,
        in_flight=True,
    ),
    GUIDED,
)


def _bound(name: str) -> Parameter:
    return Parameter(
        name, 5.0, f"bound k_s of the {name[-1]} error, eq 5.4", "deg/s", 0.001, 1000.0
    )


def _shared_gain(name: str, default: float, description: str) -> Parameter:
    # two nodes have it and must agree at every step, so it cannot be changed in flight
    return _gain(name, default, description, in_flight=False)


_TRACKING = (
    _shared_gain("k_P", 2.0, "roll-rate gain, section 3.3"),
    _shared_gain("k_Q", 2.0, "pitch-rate gain, section 3.3"),
    _shared_gain("k_R", 2.0, "yaw-rate gain, section 3.3"),
    *(_bound(f"k_s_{rate}") for rate in "PQR"),
    Parameter("lambda", 1.0, "exponent of eq 5.8: 1 is plain dynamic inversion", "", 0.0, 3.0),
)
_OBSERVER = (
    _shared_gain("k_ap_P", 15.0, "observer gain of the roll channel, eq 4.3"),
    _shared_gain("k_ap_Q", 18.0, "observer gain of the pitch channel, eq 4.3"),
    _shared_gain("k_ap_R", 15.0, "observer gain of the yaw channel, eq 4.3"),
)
INNER_LOOP_PARAMETERS = (
    Parameter("adaptive", False, "follow the disturbance learner (chapters 4 and 5)"),
    *_TRACKING,
    *_OBSERVER,
    _gain("k_ad_P", 5.0, "roll gain of the approximate to the desired plant, eq 4.4"),
    _gain("k_ad_Q", 7.0, "pitch gain of the approximate to the desired plant, eq 4.4"),
    _gain("k_ad_R", 5.0, "yaw gain of the approximate to the desired plant, eq 4.4"),
    GEOMETRIC_ALTITUDE,
)
LEARNER_PARAMETERS = (
    *_TRACKING,
    *_OBSERVER,
    Parameter("k_b", 0.7, "bound on the observer error, eq 4.11", "deg/s", 0.01, 100.0),
    Parameter("gamma", 40.0, "learning rate, eq 4.11", "deg^2/s^4", 0.1, 1e4),
    Parameter("theta", 0.01, "weight of the Jacobian's error, eq 4.11", "s^2", 0.0, 1e3),
    Parameter(
        "first_estimate",
        0.0,
        "pitch disturbance assumed before the first measurement, nose up positive",
        "deg/s^2",
        -100.0,
        100.0,
    ),
    Parameter(
        "observer_surfaces",
        COMMANDED,
        "surfaces that the observer of eq 4.3 hears: as commanded, as the servo_model moves on "
        "these commands, or as measured, which takes a plant of hardware that is not ideal",
        choices=(COMMANDED, MODELLED, MEASURED),
    ),
    Parameter("servo_model.order", 1, "order of the model; 0 moves at once", "", 0, 2),
    Parameter(
        "servo_model.bandwidth", 30.0, "bandwidth, or natural frequency", "rad/s", 0.1, 200.0
    ),
    Parameter("servo_model.damping", 0.7, "damping of a model of second order", "", 0.0, 5.0),
    Parameter("servo_model.rate_limit", 60.0, "rate limit; 0 is off", "deg/s", 0.0, 1000.0),
    Parameter("servo_model.lower_stop", -40.0, "stop, trailing edge up", "deg", -90.0, 0.0),
    Parameter("servo_model.upper_stop", 30.0, "stop, trailing edge down", "deg", 0.0, 90.0),
    GEOMETRIC_ALTITUDE,
)
VELOCITY_PARAMETERS = (
    Parameter(
        "speed",
        1786.4,
        "forward-speed command u* without guidance",
        "m/s",
        0.0,
        8000.0,
        in_flight=True,
    ),
    _gain("k_u", 0.01, "speed gain, eq 3.2"),
    GUIDED,
    GEOMETRIC_ALTITUDE,
)

FLIGHT_CONTROL_PARAMETERS = (
    Parameter("law", "", "law of your own: its name, or its file; empty: the loops fly"),
    Parameter("altitude", 24000.0, "altitude to hold without guidance", "m", 0.0, 48000.0),
    Parameter("speed", 1786.4, "forward speed to hold without guidance", "m/s", 0.0, 8000.0),
    Parameter(
        "surfaces_measured",
        False,
        "the plant measures its surfaces, as it does if its hardware is not ideal; if false, they "
        "are taken to be where they were commanded to be",
    ),
    GUIDED,
)

ParameterValues = Mapping[str, Value]


def outer_loop(values: ParameterValues) -> OuterLoop:
    """Outer-loop settings from checked parameters."""
    gain = float(values["k_i_h"])
    return OuterLoop(
        float(values["altitude"]),
        float(values["k_h"]),
        float(values["alpha_limit"]) * RADIANS,
        float(values["climb_limit"]) * RADIANS,
        AltitudeIntegral(gain, float(values["integral_limit"])) if gain > 0.0 else None,
    )


def intermediate_loop(values: ParameterValues) -> IntermediateLoop:
    """Intermediate-loop settings from checked parameters."""
    return IntermediateLoop(*(float(values[name]) for name in IntermediateLoop._fields))


def _rates(values: ParameterValues, prefix: str, scale: float = 1.0) -> Rates:
    return Rates(*(float(values[f"{prefix}_{rate}"]) * scale for rate in "PQR"))


def _error_dynamics(values: ParameterValues, prefix: str) -> ErrorDynamics:
    """Error dynamics with the gains of a prefix; the bounds and the exponent are shared."""
    bound = _rates(values, "k_s", RADIANS)
    return ErrorDynamics(_rates(values, prefix), bound, float(values["lambda"]))


def inner_loop(values: ParameterValues) -> InnerLoop:
    """Inner-loop settings from checked parameters."""
    return InnerLoop(
        _error_dynamics(values, "k"),
        _error_dynamics(values, "k_ad"),
        _rates(values, "k_ap"),
        bool(values["geometric_altitude"]),
    )


def _servo_model(values: ParameterValues) -> ServoModel:
    """Model of the servos in SI units from checked parameters."""

    def value(part: str) -> float:
        return float(values[f"servo_model.{part}"])

    return ServoModel(
        int(value("order")),
        value("bandwidth"),
        value("damping"),
        value("rate_limit") * RADIANS or inf,
        value("lower_stop") * RADIANS,
        value("upper_stop") * RADIANS,
    )


def learner_settings(values: ParameterValues) -> LearnerSettings:
    """Disturbance-learner settings from checked parameters."""
    return LearnerSettings(
        _error_dynamics(values, "k"),
        _rates(values, "k_ap"),
        float(values["k_b"]),
        float(values["gamma"]),
        float(values["theta"]),
        bool(values["geometric_altitude"]),
        float(values["first_estimate"]),
        values["observer_surfaces"] == MEASURED,
        _servo_model(values) if values["observer_surfaces"] == MODELLED else None,
    )


def velocity_loop(values: ParameterValues) -> VelocityLoop:
    """Velocity-loop settings from checked parameters."""
    return VelocityLoop(
        float(values["speed"]), float(values["k_u"]), bool(values["geometric_altitude"])
    )
