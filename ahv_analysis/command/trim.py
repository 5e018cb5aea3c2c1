# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv trim`."""

import sys
from typing import Annotated

import typer

from ahv_analysis.command.console import (
    Json,
    UsageError,
    number_option,
    print_json,
    show_table,
)
from ahv_plant.model.constants import (
    DEGREES,
    INITIAL_MASS,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
)
from ahv_plant.trim import CRUISE_ALTITUDE, CRUISE_SPEED, Trim

DECIMALS = 9  # of what is printed


def trim(
    altitude: Annotated[float, number_option("m", "Altitude")] = CRUISE_ALTITUDE,
    speed: Annotated[float, number_option("m/s", "Forward speed u")] = CRUISE_SPEED,
    mass: Annotated[float, number_option("kg", "Mass")] = INITIAL_MASS,
    geometric: Annotated[
        bool, typer.Option("--geometric", help="The altitude is geometric, not geopotential.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Find level flight: section 3.5.1 of the report."""
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
        print("ahv: no trim was found: the solver did not converge", file=sys.stderr)
    elif not found.within_limits:
        print(f"ahv: the trim is out of reach: {_beyond(found)}", file=sys.stderr)
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
