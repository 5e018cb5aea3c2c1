# Copyright 2026 ahv developers, Apache-2.0
"""A case somewhere else, as the options of `ahv linearise` say it."""

from typing import TYPE_CHECKING, Annotated

import typer

from ahv_analysis.command.console import UsageError, number_option
from ahv_analysis.command.fly import chosen_dispersion
from ahv_analysis.ranges import read_number
from ahv_msgs_py.topics import NAMESPACE
from ahv_plant.model.atmosphere import atmosphere

if TYPE_CHECKING:  # it takes long to load
    from ahv_analysis.flight.case import Case

Altitude = Annotated[
    str | None,
    typer.Option(metavar="NUMBER", help="Altitude [m], or in km; by default the case's."),
]
Speed = Annotated[float | None, number_option("m/s", "Forward speed u, by default the case's")]
Mach = Annotated[float | None, number_option("-", "Instead: Mach number of u")]
Mass = Annotated[
    str | None, typer.Option(metavar="NUMBER", help="Mass [kg], or in t; by default the case's.")
]
Dispersed = Annotated[
    str | None,
    typer.Option(
        "--dispersion",
        help="Dispersion of the vehicle: a YAML file, or a level like 0.3 to draw one.",
        metavar="FILE|LEVEL",
    ),
]


def case_at(
    case: str,
    altitude: str | None,
    speed: float | None,
    mach: float | None,
    mass: str | None,
    *,
    hardware: str | None = None,
    law: str | None = None,
    dispersion: str | None = None,
    seed: int = 0,
    run: int = 0,
) -> "Case":
    """Case where the options say, holding altitude and speed; UsageError where it cannot be."""
    from ahv_analysis.campaign.condition import at_condition
    from ahv_analysis.flight.case import make_case, read_case

    if speed is not None and mach is not None:
        raise UsageError("--speed and --mach both set the speed")
    changes, draw = chosen_dispersion(dispersion, seed, run, NAMESPACE)
    name, given = read_case(case, hardware=hardware, law=law)
    given["plant"] |= changes
    asked = {}
    if altitude is not None:
        asked["altitude"] = read_number("--altitude", altitude, "m")
    if mass is not None:
        asked["mass"] = read_number("--mass", mass, "kg")
    if speed is not None:
        own = make_case(name, given)
        height = asked.get("altitude", own.control.altitude)
        mach = speed / atmosphere(height, own.plant.truth.geometric).sound_speed
    if mach is not None:
        asked["mach"] = mach
    there, why = at_condition(name, given, asked) if asked else (given, "")
    if why:
        raise UsageError(f"there is no trim of the nominal vehicle there: {why}")
    return make_case(name, there, draw)
