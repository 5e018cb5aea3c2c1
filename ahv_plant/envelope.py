# Copyright 2026 ahv developers, Apache-2.0
"""The envelope of level flight: how far the trims of section 3.5.1 are from every limit."""

from math import cos, nan
from typing import NamedTuple

from ahv_plant.dispersion import NOMINAL, Truth
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import DEGREES, RADIANS
from ahv_plant.model.limits import ALPHA, ELEVON, LIMITS, NOT_FOUND, THROTTLE
from ahv_plant.trim import Trim, trim


class EnvelopePoint(NamedTuple):
    """A flight condition, its trim and the margins to the limits; nan where there is no trim."""

    altitude_m: float  # [m]
    mach: float  # [-] of u
    mass_kg: float  # [kg]
    speed_mps: float  # [m/s] u
    dynamic_pressure_pa: float  # [Pa]
    alpha_deg: float  # [deg]
    elevon_deg: float  # [deg]
    throttle: float  # [-]
    alpha_margin_deg: float  # [deg] to the nearer limit; negative beyond it
    elevon_margin_deg: float  # [deg]
    throttle_margin: float  # [-]
    nearest_limit: str  # by its margin's share of half the range
    relative_margin: float  # [-] to that limit
    within_limits: bool
    why_not: str  # limits that are passed, or that no trim was found; empty within them
    residual: float  # [m/s^2, rad/s^2, m/s]


def limited_values(found: Trim) -> tuple[float, float, float]:
    """What `LIMITS` limit of a trim: alpha [deg], elevons [deg] and throttle [-]."""
    return found.alpha * DEGREES, found.surfaces.right_elevon * DEGREES, found.throttle


def why_no_trim(found: Trim) -> str:
    """Which limits of `LIMITS` a trim passes, or that it is none; empty for one within them."""
    if not found.converged:
        return NOT_FOUND
    values = zip(LIMITS, limited_values(found), strict=True)
    return ", ".join(filter(None, (limit.passed_by(value) for limit, value in values)))


def envelope_point(
    altitude: float, mach: float, mass: float, truth: Truth = NOMINAL
) -> EnvelopePoint:
    """Trim at `altitude` [m], u = `mach` [-] times the speed of sound and `mass` [kg] (3.5.1).

    Raises ValueError outside the range of the model.
    """
    air = atmosphere(altitude, truth.geometric)
    speed = mach * air.sound_speed
    found = trim(altitude, speed, mass, truth)
    why = why_no_trim(found)
    values = limited_values(found) if found.converged else (nan, nan, nan)
    alpha, elevon, throttle = values
    shares = [limit.relative_margin(value) for limit, value in zip(LIMITS, values, strict=True)]
    nearest = shares.index(min(shares))
    pressure = 0.5 * air.density * (speed / cos(alpha * RADIANS)) ** 2
    return EnvelopePoint(
        altitude,
        mach,
        mass,
        speed,
        pressure,
        alpha,
        elevon,
        throttle,
        ALPHA.margin(alpha),
        ELEVON.margin(elevon),
        THROTTLE.margin(throttle),
        LIMITS[nearest].name,
        shares[nearest],
        not why,
        why,
        found.residual,
    )
