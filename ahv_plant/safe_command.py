# Copyright 2026 ahv developers, Apache-2.0
"""What the vehicle does when commands stay away: the stated safe command."""

from math import atan2

from ahv_plant.model.vectors import State, Surfaces, limit_surfaces

SAFE_THROTTLE = 0.194  # [-] section 3.5.1: level flight, until the first command comes
# An elevon moves the pitch rate of the trimmed vehicle by 0.70 1/s^2 per radian, and what is off
# trim doubles in 0.65 s: by 1.13 1/s^2 times itself. These bring it to 2 rad/s, damped by 0.7; 1
# and 3 rad/s keep the same vehicles, as do half and twice the gains.
ALPHA_GAIN = 7.3  # [-] elevon per angle of attack
RATE_GAIN = 4.0  # [s] elevon per pitch rate


def level_surfaces(held: Surfaces) -> Surfaces:
    """Deflections [rad] that keep the pitching moment of those that were `held`.

    Both elevons at the mean of the two, which held the vehicle in trim whatever its dispersion;
    equal elevons and a neutral rudder command no roll and no yaw. A trim deflection from the
    nominal model would not do: on a vehicle dispersed by 30 % it leads out of the 5 deg of the
    inlet within a second.
    """
    elevon = 0.5 * (held.right_elevon + held.left_elevon)
    return Surfaces(elevon, elevon, 0.0)


def safe_surfaces(held: Surfaces, answered: State, measured: State) -> Surfaces:
    """Deflections [rad] to fall back on, from those that were held and the `measured` state.

    The vehicle is unstable: what is off its trim doubles in 0.65 s. So the elevons do not only
    hold; they bring it back to the angle of attack of the last state that was `answered`.
    """
    level = level_surfaces(held)
    away = atan2(measured.w, measured.u) - atan2(answered.w, answered.u)
    elevon = level.right_elevon - ALPHA_GAIN * away - RATE_GAIN * measured.Q
    return limit_surfaces(Surfaces(elevon, elevon, level.rudder))
