# Copyright 2026 ahv developers, Apache-2.0
"""Parameters of the plant node: start, duration, and what the air and the graph are like."""

from collections.abc import Mapping
from typing import NamedTuple

from ahv_msgs_py.parameters import Parameter, ParameterError, Value
from ahv_plant.dispersion import (
    AxisDisturbance,
    Dispersion,
    Disturbance,
    FurtherDispersion,
    Truth,
)
from ahv_plant.hardware.actuator_parameters import (
    ACTUATOR_PARAMETERS,
    LATENCY_PARAMETERS,
    actuators,
    delay_steps,
)
from ahv_plant.hardware.parameters import (
    NOISE_PARAMETERS,
    SENSOR_PARAMETERS,
    sensor_settings,
)
from ahv_plant.hardware.wind import is_turbulent
from ahv_plant.hardware.wind_parameters import WIND_PARAMETERS, wind_settings
from ahv_plant.level_trim import LevelTrim, level_trim
from ahv_plant.model.constants import DEGREES, RADIANS, STEP
from ahv_plant.model.flight_condition import check_flight_condition
from ahv_plant.model.vectors import Controls, State, Surfaces
from ahv_plant.plant import Hardware
from ahv_plant.safe_command import SAFE_THROTTLE
from ahv_plant.start import GEOMETRIC_ALTITUDE, START_PARAMETERS

FLIGHT_PARAMETERS = (
    Parameter("duration", 150.0, "length of the flight", "s", STEP, 3600.0),
    *START_PARAMETERS,
    GEOMETRIC_ALTITUDE,
    Parameter(
        "listeners", 3, "subscribers of the state to wait for before the first step", "", 1, 100
    ),
)

_DISTURBANCE_PARTS = (
    ("constant", "constant disturbance", "deg/s^2", 100.0),
    ("step", "disturbance from step_time on", "deg/s^2", 100.0),
    ("step_time", "time of the step", "s", 3600.0),
    ("amplitude", "amplitude of a sine", "deg/s^2", 100.0),
    ("frequency", "frequency of the sine", "rad/s", 100.0),
    *((rate, f"disturbance by {rate}", "1/s", 10.0) for rate in "PQR"),
    *((f"{rate}2", f"disturbance by {rate}^2", "1/deg", 10.0) for rate in "PQR"),
)
DISPERSION_PARAMETERS = tuple(
    Parameter(f"dispersion.{name}", 1.0, f"multiplier of the true {name}", "", 0.05, 5.0)
    for name in Dispersion._fields
)
_FURTHER = {  # what of it is multiplied
    "mass": "mass, against that of the state",
    "density": "density of the air",
    "temperature": "temperature of the air",
    "thrust": "thrust",
    "right_elevon": "effectiveness of the right elevon",
    "left_elevon": "effectiveness of the left elevon",
    "rudder": "effectiveness of the rudder",
}
FURTHER_PARAMETERS = (
    *(
        Parameter(f"dispersion.{name}", 1.0, f"multiplier of the true {words}", "", 0.05, 5.0)
        for name, words in _FURTHER.items()
    ),
    Parameter("dispersion.X_cg", 0.0, "shift aft of the true centre of gravity", "m", -5.0, 5.0),
)
DISTURBANCE_PARAMETERS = tuple(
    Parameter(f"disturbance.{axis}.{part}", 0.0, f"rate of {axis}: {words}", unit, -limit, limit)
    for axis in Disturbance._fields
    for part, words, unit, limit in _DISTURBANCE_PARTS
)
HARDWARE_PARAMETERS = ACTUATOR_PARAMETERS + LATENCY_PARAMETERS + SENSOR_PARAMETERS
PLANT_PARAMETERS = (
    FLIGHT_PARAMETERS
    + DISPERSION_PARAMETERS
    + FURTHER_PARAMETERS
    + DISTURBANCE_PARAMETERS
    + WIND_PARAMETERS
    + HARDWARE_PARAMETERS
    + NOISE_PARAMETERS
)


class PlantSettings(NamedTuple):
    """What the plant flies: in SI units."""

    initial: State
    steps: int  # number of integration steps of 0.01 s
    truth: Truth
    hardware: Hardware | None  # None is ideal, in air without turbulence
    noise: tuple[int, int]  # seed of the campaign and run, of which its numbers are


def plant_settings(values: Mapping[str, Value]) -> PlantSettings:
    """Settings from checked parameters; ParameterError where the model does not hold."""
    degrees = ("P", "Q", "R", "phi", "theta", "psi")
    initial = State(
        **{
            name: float(values[f"initial.{name}"]) * (RADIANS if name in degrees else 1.0)
            for name in State._fields
        }
    )
    geometric = bool(values["geometric_altitude"])
    try:
        check_flight_condition(initial.h, initial.u, initial.mass, geometric)
    except ValueError as error:
        raise ParameterError(f"plant: initial {error}") from error
    truth = Truth(
        geometric,
        _dispersion(values),
        _disturbance(values),
        _further_dispersion(values),
        wind_settings(values),
    )
    duration = float(values["duration"])
    steps = round(duration / STEP)
    if abs(steps * STEP - duration) > 1e-9:
        raise ParameterError(
            f"plant: duration is {duration!r} s, but must be whole steps of {STEP:g} s"
        )
    hardware = _hardware(values, initial, truth)
    noise = int(values["noise.seed"]), int(values["noise.run"])
    return PlantSettings(initial, steps, truth, hardware, noise)


def _hardware(values: Mapping[str, Value], initial: State, truth: Truth) -> Hardware | None:
    """Hardware in SI units; None where every part is ideal and the air is not turbulent."""
    ideal = {parameter.name: parameter.default for parameter in HARDWARE_PARAMETERS}
    as_ideal = all(values[name] == ideal[name] for name in ideal if name != "failure.time")
    if as_ideal and not is_turbulent(truth.wind):
        return None
    calm = Truth(truth.geometric)
    trim = LevelTrim(*level_trim(initial.h, initial.u, initial.mass, calm))
    start = Controls(Surfaces(0.0, 0.0, 0.0), SAFE_THROTTLE)
    if trim.exists:
        start = Controls(Surfaces(trim.elevon, trim.elevon, 0.0), trim.throttle)
    return Hardware(
        actuators(values),
        delay_steps(values),
        float(values["latency.jitter"]),
        sensor_settings(values, windy=truth.wind is not None),
        start,
    )


def _dispersion(values: Mapping[str, Value]) -> Dispersion:
    return Dispersion(*(float(values[parameter.name]) for parameter in DISPERSION_PARAMETERS))


def _further_dispersion(values: Mapping[str, Value]) -> FurtherDispersion | None:
    """None where all is nominal."""
    further = FurtherDispersion(
        *(float(values[f"dispersion.{name}"]) for name in FurtherDispersion._fields)
    )
    return None if further == FurtherDispersion() else further


def _disturbance(values: Mapping[str, Value]) -> Disturbance | None:
    """Disturbance in radians; None where every part is zero."""
    if not any(values[parameter.name] for parameter in DISTURBANCE_PARAMETERS):
        return None
    scales = {"deg/s^2": RADIANS, "1/deg": DEGREES}
    return Disturbance(
        *(
            AxisDisturbance(
                *(
                    float(values[f"disturbance.{axis}.{part}"]) * scales.get(unit, 1.0)
                    for part, _, unit, _ in _DISTURBANCE_PARTS
                )
            )
            for axis in Disturbance._fields
        )
    )
