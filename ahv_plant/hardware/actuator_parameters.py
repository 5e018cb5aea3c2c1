# Copyright 2026 ahv developers, Apache-2.0
"""Parameters of actuators and latency; by default both are ideal."""

from collections.abc import Mapping
from math import inf
from typing import NamedTuple

from ahv_msgs_py.parameters import Parameter, ParameterError, Value
from ahv_plant.hardware.actuators import Actuator, Failure
from ahv_plant.hardware.delay import LONGEST
from ahv_plant.hardware.motion import Actuators
from ahv_plant.model.constants import (
    RADIANS,
    STEP,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
)

FASTEST = 200.0  # [rad/s] what the step of 0.01 s can integrate


class _Kind(NamedTuple):
    unit: str
    scale: float  # to SI
    lower: float
    upper: float
    fastest: float  # rate limit, in the unit


_KINDS = {
    "elevons": _Kind("deg", RADIANS, SURFACE_MINIMUM, SURFACE_MAXIMUM, 1000.0),
    "rudder": _Kind("deg", RADIANS, SURFACE_MINIMUM, SURFACE_MAXIMUM, 1000.0),
    "engine": _Kind("", 1.0, THROTTLE_MINIMUM, THROTTLE_MAXIMUM, 100.0),
}
_ACTUATORS = {  # what each control is moved by
    "right_elevon": "elevons",
    "left_elevon": "elevons",
    "rudder": "rudder",
    "throttle": "engine",
}


def _of_actuator(name: str) -> tuple[Parameter, ...]:
    kind = _KINDS[name]
    widest = kind.upper / kind.scale
    return tuple(
        Parameter(f"actuator.{name}.{part}", default, f"{name}: {words}", unit, low, high)
        for part, default, words, unit, low, high in (
            ("order", 0, "order of the servo; 0 moves at once", "", 0, 2),
            ("bandwidth", 30.0, "bandwidth, or natural frequency", "rad/s", 0.1, FASTEST),
            ("damping", 0.7, "damping of a servo of second order", "", 0.0, 5.0),
            ("rate_limit", 0.0, "rate limit; 0 is off", f"{kind.unit or 1}/s", 0.0, kind.fastest),
            ("dead_zone", 0.0, "error that it does not notice", kind.unit, 0.0, widest),
            ("backlash", 0.0, "play, end to end", kind.unit, 0.0, widest),
        )
    )


FAILURES = tuple(failure.name.lower() for failure in Failure)
ACTUATOR_PARAMETERS = (
    *(parameter for name in _KINDS for parameter in _of_actuator(name)),
    *(
        Parameter(
            f"failure.{control}",
            "none",
            f"what fails: {', '.join(FAILURES)}",
            choices=FAILURES,
        )
        for control in _ACTUATORS
    ),
    Parameter("failure.time", 0.0, "time of the failures", "s", 0.0, 3600.0),
)
LATENCY_PARAMETERS = (
    Parameter(
        "latency.delay",
        0.0,
        "from a measured state to the arrival of its commands, in whole steps",
        "s",
        0.0,
        LONGEST * STEP,
    ),
    Parameter("latency.jitter", 0.0, "share of commands that take a step longer", "", 0.0, 1.0),
)


def failures_in(values: Mapping[str, Value]) -> dict[str, str]:
    """What fails in flight, in words, by control."""
    return {
        control: f"{str(values[f'failure.{control}']).replace('_', ' ')} "
        f"from {values['failure.time']:g} s on"
        for control in _ACTUATORS
        if values[f"failure.{control}"] != FAILURES[0]
    }


def actuators(values: Mapping[str, Value]) -> Actuators:
    """Actuators in SI units from checked parameters."""
    return Actuators(**{control: _actuator(values, control) for control in _ACTUATORS})


def _actuator(values: Mapping[str, Value], control: str) -> Actuator:
    name = _ACTUATORS[control]
    kind = _KINDS[name]

    def value(part: str) -> float:
        return float(values[f"actuator.{name}.{part}"])

    return Actuator(
        int(value("order")),
        value("bandwidth"),
        value("damping"),
        value("rate_limit") * kind.scale or inf,
        kind.lower,
        kind.upper,
        value("dead_zone") * kind.scale,
        value("backlash") * kind.scale,
        FAILURES.index(str(values[f"failure.{control}"])),
        float(values["failure.time"]),
    )


def delay_steps(values: Mapping[str, Value]) -> int:
    """Latency in whole steps; ParameterError if it is none."""
    delay = float(values["latency.delay"])
    steps = round(delay / STEP)
    if abs(steps * STEP - delay) > 1e-9:
        raise ParameterError(
            f"plant: latency.delay is {delay!r} s, but must be whole steps of {STEP:g} s"
        )
    return steps
