# Copyright 2026 ahv developers, Apache-2.0
"""What the vehicle does when commands stay away: the stated safe command."""

from ahv_plant.model.vectors import Surfaces

SAFE_THROTTLE = 0.194  # [-] section 3.5.1: level flight, until the first command comes


def safe_surfaces(held: Surfaces) -> Surfaces:
    """Deflections [rad] to fall back on, from those that were held.

    Both elevons at the mean of the two keep the pitching moment that held the vehicle in trim,
    whatever its dispersion; a neutral rudder and equal elevons command no roll and no yaw. A trim
    deflection from the nominal model would not do: on a vehicle dispersed by 30 % it leads out of
    the 5 deg of the inlet within a second.
    """
    elevon = 0.5 * (held.right_elevon + held.left_elevon)
    return Surfaces(elevon, elevon, 0.0)
