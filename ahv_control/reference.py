# Copyright 2026 ahv developers, Apache-2.0
"""What the flight control is to follow: altitude, speed, bank and heading, and how they change.

Section 3.1 of the report holds one altitude and one speed, both parameters of its loops; the rates
of what it follows it takes as zero. `held` is that reference; guidance makes others (guidance.py).
"""

from typing import NamedTuple

from ahv_plant.numerics.elementwise import elementwise


class Reference(NamedTuple):
    """What is to be flown at one step."""

    altitude: float  # [m] h*
    speed: float  # [m/s] u*
    phi: float  # [rad] phi*, bank
    psi: float  # [rad] psi*, heading
    altitude_rate: float  # [m/s] of h*, zero without feed-forward
    speed_rate: float  # [m/s^2] of u*
    psi_rate: float  # [rad/s] of psi*


@elementwise
def held(altitude: float, speed: float) -> Reference:
    """Straight and level flight at `altitude` [m] and u = `speed` [m/s], section 3.1."""
    return Reference(altitude, speed, 0.0, 0.0, 0.0, 0.0, 0.0)
