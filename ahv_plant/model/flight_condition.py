# Copyright 2026 ahv developers, Apache-2.0
"""Flight conditions: the cruise of section 3.5.1, and where the model of the vehicle holds."""

from ahv_plant.model.aerodynamics import MACH_MINIMUM
from ahv_plant.model.atmosphere import (
    ALTITUDE_MAXIMUM,
    ALTITUDE_MINIMUM,
    atmosphere,
    geopotential_altitude,
)
from ahv_plant.model.mass import MASS_MAXIMUM, MASS_MINIMUM

CRUISE_ALTITUDE = 24_000.0  # [m] h*, section 3.5.1
CRUISE_SPEED = 1786.4  # [m/s] u*, section 3.5.1
MACH_MAXIMUM = 24.0  # [-] end of the wind-tunnel and code data behind the fits


def check_flight_condition(altitude: float, speed: float, mass: float, geometric: bool) -> None:
    """Raise ValueError, naming field, value and range, where the vehicle model does not hold.

    `altitude` [m], `speed` [m/s], `mass` [kg]; `geometric` says which altitude it is.
    """
    height = geopotential_altitude(altitude, geometric)
    if not ALTITUDE_MINIMUM <= height <= ALTITUDE_MAXIMUM:
        raise ValueError(
            f"altitude {altitude:g} m is outside the atmosphere model, "
            f"which is valid from {ALTITUDE_MINIMUM:g} to {ALTITUDE_MAXIMUM:g} m"
        )
    sound = atmosphere(altitude, geometric).sound_speed
    if not MACH_MINIMUM * sound <= speed <= MACH_MAXIMUM * sound:
        raise ValueError(
            f"speed {speed:g} m/s is outside the aerodynamic fits, which are valid from Mach "
            f"{MACH_MINIMUM:g} to {MACH_MAXIMUM:g}: {MACH_MINIMUM * sound:.0f} to "
            f"{MACH_MAXIMUM * sound:.0f} m/s at {altitude:g} m"
        )
    if not MASS_MINIMUM <= mass <= MASS_MAXIMUM:
        raise ValueError(
            f"mass {mass:g} kg is outside the mass properties, "
            f"which are valid from {MASS_MINIMUM:g} to {MASS_MAXIMUM:g} kg"
        )
