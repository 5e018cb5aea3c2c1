# Copyright 2026 ahv developers, Apache-2.0
"""Parameters of the hardware: by default all of it is perfect."""

from collections.abc import Mapping
from typing import Any

from ahv_msgs_py.parameters import Parameter, Value
from ahv_plant.hardware.sensors import PERFECT, AirVelocity, Sensor, Sensors
from ahv_plant.model.constants import RADIANS, STEP
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.numerics.elementary import exp_small
from ahv_plant.start import START_PARAMETERS

_MEASURED = {  # channel: what it measures, and in which unit
    **{
        parameter.name.removeprefix("initial."): (parameter.description, parameter.unit)
        for parameter in START_PARAMETERS
    },
    "right_elevon": ("deflection of the right elevon", "deg"),
    "left_elevon": ("deflection of the left elevon", "deg"),
    "rudder": ("deflection of the rudder", "deg"),
    "alpha": ("angle of attack", "deg"),
    "beta": ("sideslip angle", "deg"),
    "speed": ("speed", "m/s"),
}
_LARGEST = {"m/s": 500.0, "deg/s": 50.0, "deg": 50.0, "m": 5000.0, "kg": 50000.0}  # error, by unit
SHORTEST_LAG = 0.001  # [s] a shorter one is over within a sample, to 5e-5 of the way


def _of_sensor(channel: str) -> tuple[Parameter, ...]:
    measured, unit = _MEASURED[channel]
    name, largest = f"sensor.{channel}", _LARGEST[unit]
    return (
        Parameter(
            f"{name}.noise", 0.0, f"white noise of the {measured}, 1 sigma", unit, 0.0, largest
        ),
        Parameter(f"{name}.bias", 0.0, f"bias of the {measured}", unit, -largest, largest),
        Parameter(f"{name}.scale", 0.0, f"scale factor error of the {measured}", "", -0.9, 9.0),
        Parameter(f"{name}.quantum", 0.0, f"quantum of the {measured}", unit, 0.0, largest),
        Parameter(f"{name}.time_constant", 0.0, f"lag of the {measured}", "s", 0.0, 10.0),
    )


SENSOR_PARAMETERS = (
    *(parameter for channel in _MEASURED for parameter in _of_sensor(channel)),
    Parameter(
        "air_data_sensors",
        False,
        "u, v, w are measured by the sensors of alpha, beta and speed instead of their own",
    ),
)
NOISE_PARAMETERS = (
    Parameter("noise.seed", 0, "seed of the noise", "", 0, 2**63 - 1),
    Parameter("noise.run", 0, "number of the run whose noise it is", "", 0, 2**63 - 1),
)


def lag(time_constant: float) -> float:
    """Share [-] of the way that a lag of `time_constant` [s] goes in one sample of 10 ms.

    Exact for a held input. By our own exponential, so that it has the same bits on every machine.
    """
    return 1.0 if time_constant < SHORTEST_LAG else 1.0 - exp_small(-STEP / time_constant)


def sensor_settings(values: Mapping[str, Value], windy: bool = False) -> Sensors | None:
    """Sensors in SI units from checked parameters; None if they tell the state as it is.

    Where it is windy, perfect sensors of air data tell another velocity than that over the ground.
    """
    by_air = bool(values["air_data_sensors"])
    sensors: dict[str, Any] = {channel: _sensor(values, channel) for channel in _MEASURED}
    sensors |= dict.fromkeys("uvw" if by_air else AirVelocity._fields, PERFECT)
    against_air = by_air and windy
    if set(sensors.values()) == {PERFECT} and not against_air:
        return None
    air = [sensors[name] for name in AirVelocity._fields]
    return Sensors(
        State(*(sensors[name] for name in State._fields)),
        Surfaces(*(sensors[name] for name in Surfaces._fields)),
        # in still air perfect ones are the true u, v, w, without rounding on the way and back
        None if set(air) == {PERFECT} and not against_air else AirVelocity(*air),
    )


def _sensor(values: Mapping[str, Value], channel: str) -> Sensor:
    unit = RADIANS if _MEASURED[channel][1].startswith("deg") else 1.0

    def value(part: str) -> float:
        return float(values[f"sensor.{channel}.{part}"])

    return Sensor(
        unit * value("noise"),
        unit * value("bias"),
        value("scale"),
        unit * value("quantum"),
        lag(value("time_constant")),
    )
