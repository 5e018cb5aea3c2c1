# Copyright 2026 ahv developers, Apache-2.0
"""Parameters of the wind: by default there is none."""

from collections.abc import Mapping

from ahv_msgs_py.parameters import Parameter, Value
from ahv_plant.hardware.wind import Gust, SteadyWind, Turbulence, Wind, turbulence_of
from ahv_plant.model.constants import STEP

_HIGHEST = 48000.0  # [m]

WIND_PARAMETERS = (
    Parameter(
        "wind.north", 0.0, "steady wind towards the north at wind.altitude", "m/s", -200.0, 200.0
    ),
    Parameter(
        "wind.east", 0.0, "steady wind towards the east at wind.altitude", "m/s", -200.0, 200.0
    ),
    Parameter("wind.altitude", 24000.0, "altitude of wind.north and .east", "m", 0.0, _HIGHEST),
    Parameter("wind.shear_north", 0.0, "change of wind.north by altitude", "1/s", -0.1, 0.1),
    Parameter("wind.shear_east", 0.0, "change of wind.east by altitude", "1/s", -0.1, 0.1),
    Parameter("gust.u", 0.0, "peak of a gust forward", "m/s", -100.0, 100.0),
    Parameter("gust.v", 0.0, "peak of a gust to the right", "m/s", -100.0, 100.0),
    Parameter("gust.w", 0.0, "peak of a gust downward", "m/s", -100.0, 100.0),
    Parameter("gust.start", 0.0, "time at which the gust begins", "s", 0.0, 3600.0),
    Parameter("gust.duration", 1.0, "length of the gust, up and down again", "s", STEP, 3600.0),
    Parameter(
        "turbulence.sigma",
        0.0,
        "strength of the turbulence, 1 sigma on each axis",
        "m/s",
        0.0,
        50.0,
    ),
)


def wind_settings(values: Mapping[str, Value]) -> Wind | None:
    """Wind from checked parameters, None if the air is still.

    Turbulence is flown through at the speed that the flight starts with.
    """
    wind = Wind(_steady(values), _gust(values), _turbulence(values))
    return None if wind == Wind() else wind


def _steady(values: Mapping[str, Value]) -> SteadyWind | None:
    if not any(values[f"wind.{name}"] for name in SteadyWind._fields if name != "altitude"):
        return None
    return SteadyWind(*(float(values[f"wind.{name}"]) for name in SteadyWind._fields))


def _gust(values: Mapping[str, Value]) -> Gust | None:
    if not any(values[f"gust.{name}"] for name in "uvw"):
        return None
    return Gust(*(float(values[f"gust.{name}"]) for name in Gust._fields))


def _turbulence(values: Mapping[str, Value]) -> Turbulence | None:
    sigma = float(values["turbulence.sigma"])
    return turbulence_of(sigma, float(values["initial.u"])) if sigma else None
