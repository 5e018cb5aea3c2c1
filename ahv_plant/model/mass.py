# Copyright 2026 ahv developers, Apache-2.0
"""Inertia and centre of gravity as functions of the mass (section 2.1 and eq 2.14)."""

from typing import NamedTuple

from ahv_plant.numerics.elementwise import elementwise

MASS_MINIMUM = (
    60_000.0  # [kg] near the empty vehicle; the fits lose their positive inertia below 30 t
)
MASS_MAXIMUM = 140_000.0  # [kg] just above the 136 080 kg of Table 2.1


class Inertia(NamedTuple):
    """Principal moments of inertia about the body axes; the report sets I_xz = 0."""

    Ixx: float  # [kg m^2]
    Iyy: float  # [kg m^2]
    Izz: float  # [kg m^2]


@elementwise
def inertia(mass: float) -> Inertia:
    """Moments of inertia [kg m^2] at `mass` [kg], section 2.1 (fit by Zhang et al. 2010)."""
    Ixx = -7.8809e-5 * (mass * mass) + 25.88576 * mass - 6.9683e5
    Iyy = -8.2890e-4 * (mass * mass) + 265.9889 * mass - 7.3048e6
    return Inertia(Ixx, Iyy, Iyy)


@elementwise
def centre_of_gravity(mass: float) -> float:
    """X_cg [m] aft of the moment reference centre at `mass` [kg], eq 2.14."""
    return 1.6210e-10 * (mass * mass) - 5.5226e-5 * mass + 7.3578
