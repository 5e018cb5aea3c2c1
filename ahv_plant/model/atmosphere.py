# Copyright 2026 ahv developers, Apache-2.0
"""International Standard Atmosphere, 0 to 47 km geopotential altitude (ISO 2533:1975).

The report's trim fits the table entered with h as geopotential altitude, so that is the default;
`geometric` converts a geometric altitude first.
"""

from math import sqrt
from typing import NamedTuple

from ahv_plant.model.vectors import clamp
from ahv_plant.numerics.elementary import exp_small, log_near_one
from ahv_plant.numerics.elementwise import elementwise, select

GAS_CONSTANT = 287.05287  # [J/(kg K)] of dry air
STANDARD_GRAVITY = 9.80665  # [m/s^2]
HEAT_RATIO = 1.4  # [-]
EARTH_RADIUS = 6_356_766.0  # [m] nominal, for geopotential altitude
ALTITUDE_MINIMUM = 0.0  # [m] geopotential
ALTITUDE_MAXIMUM = 47_000.0  # [m] geopotential

# Layer bases: altitude [m], temperature [K], lapse rate [K/m], pressure [Pa].
H1, T1, LAPSE1, P1 = 0.0, 288.15, -0.0065, 101325.0
H2, T2, LAPSE2, P2 = 11_000.0, 216.65, 0.0, 22632.04009500781
H3, T3, LAPSE3, P3 = 20_000.0, 216.65, 0.001, 5474.8774242810505
H4, T4, LAPSE4, P4 = 32_000.0, 228.65, 0.0028, 868.015776620216

# Exponents of the pressure in the layers with a lapse.
POWER1, POWER3, POWER4 = (
    -STANDARD_GRAVITY / (GAS_CONSTANT * lapse) for lapse in (LAPSE1, LAPSE3, LAPSE4)
)


class Air(NamedTuple):
    """The air at an altitude."""

    temperature: float  # [K]
    pressure: float  # [Pa]
    density: float  # [kg/m^3] rho
    sound_speed: float  # [m/s] a


@elementwise
def geopotential_altitude(h: float, geometric: bool) -> float:
    """Geopotential altitude [m] of `h` [m], which is geometric or already geopotential."""
    return h * EARTH_RADIUS / (EARTH_RADIUS + h) if geometric else h


@elementwise
def atmosphere(h: float, geometric: bool) -> Air:
    """The standard air at altitude `h` [m]; beyond 0 to 47 km it stays as at the edge."""
    H = clamp(geopotential_altitude(h, geometric), ALTITUDE_MINIMUM, ALTITUDE_MAXIMUM)
    above1, above2, above3 = H > H2, H > H3, H > H4
    base = select(above3, H4, select(above2, H3, select(above1, H2, H1)))
    T_base = select(above3, T4, select(above2, T3, select(above1, T2, T1)))
    p_base = select(above3, P4, select(above2, P3, select(above1, P2, P1)))
    lapse = select(above3, LAPSE4, select(above2, LAPSE3, select(above1, LAPSE2, LAPSE1)))
    isothermal = lapse == 0.0
    T = T_base + lapse * (H - base)
    power = select(above3, POWER4, select(above2, POWER3, POWER1))
    per_T = select(above3, 1.0 / T4, select(above1, 1.0 / T3, 1.0 / T1))
    fall = -STANDARD_GRAVITY / (GAS_CONSTANT * T2) * (H - base)
    p = p_base * exp_small(select(isothermal, fall, power * log_near_one(T * per_T)))
    return Air(T, p, p / (GAS_CONSTANT * T), sqrt(HEAT_RATIO * GAS_CONSTANT * T))
