# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv trim`."""

import sys
from math import nan
from pathlib import Path
from typing import Annotated, Any

import typer

from ahv_analysis.command.console import (
    Json,
    UsageError,
    print_json,
    show_table,
)
from ahv_analysis.command.envelope import ALTITUDES, MACHS, MASSES, make_envelope
from ahv_analysis.ranges import RANGE, read_number
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import (
    DEGREES,
    INITIAL_MASS,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
)
from ahv_plant.model.flight_condition import CRUISE_ALTITUDE, CRUISE_SPEED
from ahv_plant.model.limits import ALPHA, NOT_FOUND
from ahv_plant.trim import Trim

DECIMALS = 9  # of what is printed


def _number(help_text: str) -> Any:
    """Return an option that is a number, or with --map several."""
    return typer.Option(metavar="NUMBER", help=help_text)


def trim(
    altitude: Annotated[
        str | None,
        _number(f"Altitude [m], or in km; by default {CRUISE_ALTITUDE:g}, of a map {ALTITUDES}."),
    ] = None,
    speed: Annotated[
        str | None, _number(f"Forward speed u [m/s], by default {CRUISE_SPEED:g}.")
    ] = None,
    mach: Annotated[
        str | None, _number(f"Instead: Mach number of u; of a map by default {MACHS}.")
    ] = None,
    mass: Annotated[
        str | None,
        _number(f"Mass [kg], or in t; by default {INITIAL_MASS:g}, of a map {MASSES}."),
    ] = None,
    geometric: Annotated[
        bool, typer.Option("--geometric", help="The altitude is geometric, not geopotential.")
    ] = False,
    mapped: Annotated[
        bool,
        typer.Option(
            "--map",
            help="Trims over altitude, Mach number and mass, and the limits where there is none; "
            f"each is {RANGE} or A,B,C.",
        ),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the map, by default maps/trim.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Find level flight: section 3.5.1 of the report.

    With --map, find all of its envelope, and keep it as trim.png, trim.parquet and trim.json.
    """
    if mapped:
        if speed is not None:
            raise UsageError("--speed is for one trim; a map has --mach")
        if make_envelope(altitude, mach, mass, geometric, out, as_json) == 0:
            print("ahv: no point has a trim within the limits", file=sys.stderr)
            raise typer.Exit(1)
        return
    if out is not None:
        raise UsageError("--out is for a map: --map")
    if speed is not None and mach is not None:
        raise UsageError("--speed and --mach both set the speed")
    h = _one("--altitude", altitude, "m", CRUISE_ALTITUDE)
    u = _one("--speed", speed, "m/s", CRUISE_SPEED)
    if mach is not None:
        u = _one("--mach", mach, "", nan) * atmosphere(h, geometric).sound_speed
    _trim_once(h, u, _one("--mass", mass, "kg", INITIAL_MASS), geometric, as_json)


def _one(name: str, text: str | None, unit: str, default: float) -> float:
    """Number that an option gives, in its unit."""
    if text is None:
        return default
    if ":" in text or "," in text:
        raise UsageError(f"{name} is {text!r}, but must be one number without --map")
    return read_number(name, text, unit)


def _trim_once(altitude: float, speed: float, mass: float, geometric: bool, as_json: bool) -> None:
    from ahv_plant.dispersion import Truth
    from ahv_plant.trim import trim as solve

    try:
        found = solve(altitude, speed, mass, Truth(geometric))
    except ValueError as error:
        raise UsageError(error) from error
    values: dict[str, float | bool] = {
        "u_mps": found.state.u,
        "v_mps": found.state.v,
        "w_mps": found.state.w,
        "theta_deg": found.state.theta * DEGREES,
        "alpha_deg": found.alpha * DEGREES,
        "right_elevon_deg": found.surfaces.right_elevon * DEGREES,
        "left_elevon_deg": found.surfaces.left_elevon * DEGREES,
        "rudder_deg": found.surfaces.rudder * DEGREES,
        "throttle": found.throttle,
    }
    # the solver finds zeros to some 1e-15
    values = {name: round(value, DECIMALS) + 0.0 for name, value in values.items()}
    values |= {
        "residual": found.residual,
        "converged": found.converged,
        "within_limits": found.within_limits,
    }
    if as_json:
        print_json(values)
    else:
        rows = [
            (name, f"{value:.6g}" if isinstance(value, float) else str(value))
            for name, value in values.items()
        ]
        show_table(f"Trim at {altitude:g} m, {speed:g} m/s, {mass:g} kg", rows)
    if not found.converged:
        print(f"ahv: no trim was found: {NOT_FOUND}", file=sys.stderr)
    elif not found.within_limits:
        print(f"ahv: the trim is out of reach: {_beyond(found)}", file=sys.stderr)
    elif ALPHA.margin(found.alpha * DEGREES) < 0.0:
        print(
            f"ahv: the inlet unstarts there: alpha {found.alpha * DEGREES:.3f} deg "
            f"({ALPHA.low:g} to {ALPHA.high:g})",
            file=sys.stderr,
        )
    if not (found.converged and found.within_limits):
        raise typer.Exit(1)


def _beyond(found: Trim) -> str:
    """What a trim asks for beyond its stops."""
    low, high = SURFACE_MINIMUM * DEGREES, SURFACE_MAXIMUM * DEGREES
    angles = {
        name.replace("_", " "): angle * DEGREES for name, angle in found.surfaces._asdict().items()
    }
    beyond = [
        f"{name} {angle:.3f} deg ({low:g} to {high:g})"
        for name, angle in angles.items()
        if not low <= angle <= high
    ]
    if not THROTTLE_MINIMUM <= found.throttle <= THROTTLE_MAXIMUM:
        beyond.append(
            f"throttle {found.throttle:.4f} ({THROTTLE_MINIMUM:g} to {THROTTLE_MAXIMUM:g})"
        )
    return ", ".join(beyond)
