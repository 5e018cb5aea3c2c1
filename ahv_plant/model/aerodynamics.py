# Copyright 2026 ahv developers, Apache-2.0
"""Aerodynamic coefficients, forces and moments (section 2.2, eqs 2.7-2.13)."""

from math import sqrt
from typing import NamedTuple

from ahv_plant.model.aerodynamic_fits import (
    CD_basic,
    CD_elevon,
    CD_rudder,
    CL_basic,
    Cl_beta,
    CL_elevon,
    Cl_elevon,
    Cl_p,
    Cl_r,
    Cl_rudder,
    Cm_basic,
    Cm_elevon,
    Cm_q,
    Cm_rudder,
    Cn_beta,
    Cn_elevon,
    Cn_p,
    Cn_r,
    Cn_rudder,
    CY_beta,
    CY_elevon,
    CY_rudder,
)
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import DEGREES, MEAN_CHORD, WING_AREA, WING_SPAN
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.numerics.elementary import atan2, atan_ratio
from ahv_plant.numerics.elementwise import elementwise

MACH_MINIMUM = 4.0  # [-] the fits hold above


class AirData(NamedTuple):
    """What the air sees of the vehicle."""

    speed: float  # [m/s] V_t
    alpha: float  # [rad] angle of attack
    beta: float  # [rad] sideslip angle
    mach: float  # [-] eq 2.7
    dynamic_pressure: float  # [Pa] q-bar
    sin_alpha: float  # [-]
    cos_alpha: float  # [-]


class Coefficients(NamedTuple):
    """The six aerodynamic coefficients [-], moments about the moment reference centre."""

    CL: float
    CD: float
    CY: float
    Cl: float
    Cm: float
    Cn: float


class Loads(NamedTuple):
    """Forces [N] and moments about the centre of gravity [N m] in body axes."""

    Fx: float
    Fy: float
    Fz: float
    L: float
    M: float
    N: float


@elementwise
def air_data(state: State, geometric: bool) -> AirData:
    """Air data of a state (section 2.1); `geometric` says which altitude h is."""
    air = atmosphere(state.h, geometric)
    in_plane = sqrt(state.u * state.u + state.w * state.w)
    per_in_plane = 1.0 / in_plane
    speed = sqrt(state.u * state.u + state.v * state.v + state.w * state.w)
    return AirData(
        speed,
        atan2(state.w, state.u),
        atan_ratio(state.v, in_plane),  # = asin(v / V_t)
        speed / air.sound_speed,
        0.5 * air.density * speed * speed,
        state.w * per_in_plane,
        state.u * per_in_plane,
    )


@elementwise
def clean_coefficients(air: AirData, state: State) -> Coefficients:
    """Return what no surface changes of the coefficients: basic, sideslip and damping parts."""
    a = air.alpha * DEGREES
    m = air.mach
    per_speed = 0.5 / air.speed
    p_hat = state.P * WING_SPAN * per_speed
    q_hat = state.Q * MEAN_CHORD * per_speed
    r_hat = state.R * WING_SPAN * per_speed
    return Coefficients(
        CL_basic(a, m),
        CD_basic(a, m),
        CY_beta(a, m) * air.beta,
        Cl_beta(a, m) * air.beta + Cl_p(a, m) * p_hat + Cl_r(a, m) * r_hat,
        Cm_basic(a, m) + Cm_q(a, m) * q_hat,
        Cn_beta(a, m) * air.beta + Cn_p(a, m) * p_hat + Cn_r(a, m) * r_hat,
    )


@elementwise
def control_coefficients(
    air: AirData, surfaces: Surfaces
) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
    """Increments of the coefficients due to the surfaces, their slopes by each surface [1/rad].

    The order of the slopes is right elevon (delta_e), left elevon (delta_a), rudder (delta_r). The
    right elevon's roll, yaw and side force count positive, the left one's negative.
    """
    a = air.alpha * DEGREES
    m = air.mach
    e = surfaces.right_elevon * DEGREES
    l = surfaces.left_elevon * DEGREES  # noqa: E741
    r = surfaces.rudder * DEGREES
    CL_e, CL_e_slope = CL_elevon(a, m, e)
    CL_l, CL_l_slope = CL_elevon(a, m, l)
    CD_e, CD_e_slope = CD_elevon(a, m, e)
    CD_l, CD_l_slope = CD_elevon(a, m, l)
    CD_r, CD_r_slope = CD_rudder(a, m, r)
    CY_e, CY_e_slope = CY_elevon(a, m, e)
    CY_l, CY_l_slope = CY_elevon(a, m, l)
    CY_r, CY_r_slope = CY_rudder(a, m, r)
    Cl_e, Cl_e_slope = Cl_elevon(a, m, e)
    Cl_l, Cl_l_slope = Cl_elevon(a, m, l)
    Cl_r_, Cl_r_slope = Cl_rudder(a, m, r)
    Cm_e, Cm_e_slope = Cm_elevon(a, m, e)
    Cm_l, Cm_l_slope = Cm_elevon(a, m, l)
    Cm_r, Cm_r_slope = Cm_rudder(a, m, r)
    Cn_e, Cn_e_slope = Cn_elevon(a, m, e)
    Cn_l, Cn_l_slope = Cn_elevon(a, m, l)
    Cn_r_, Cn_r_slope = Cn_rudder(a, m, r)
    increments = Coefficients(
        CL_e + CL_l,
        CD_e + CD_l + CD_r,
        CY_e - CY_l + CY_r,
        Cl_e - Cl_l + Cl_r_,
        Cm_e + Cm_l + Cm_r,
        Cn_e - Cn_l + Cn_r_,
    )
    by_right_elevon = Coefficients(
        CL_e_slope * DEGREES,
        CD_e_slope * DEGREES,
        CY_e_slope * DEGREES,
        Cl_e_slope * DEGREES,
        Cm_e_slope * DEGREES,
        Cn_e_slope * DEGREES,
    )
    by_left_elevon = Coefficients(
        CL_l_slope * DEGREES,
        CD_l_slope * DEGREES,
        -CY_l_slope * DEGREES,
        -Cl_l_slope * DEGREES,
        Cm_l_slope * DEGREES,
        -Cn_l_slope * DEGREES,
    )
    by_rudder = Coefficients(
        0.0,
        CD_r_slope * DEGREES,
        CY_r_slope * DEGREES,
        Cl_r_slope * DEGREES,
        Cm_r_slope * DEGREES,
        Cn_r_slope * DEGREES,
    )
    return increments, by_right_elevon, by_left_elevon, by_rudder


@elementwise
def add_coefficients(one: Coefficients, other: Coefficients) -> Coefficients:
    """Sum of two sets of coefficients."""
    return Coefficients(
        one.CL + other.CL,
        one.CD + other.CD,
        one.CY + other.CY,
        one.Cl + other.Cl,
        one.Cm + other.Cm,
        one.Cn + other.Cn,
    )


@elementwise
def aerodynamic_coefficients(air: AirData, state: State, surfaces: Surfaces) -> Coefficients:
    """All six coefficients [-] at a state with the surfaces [rad] deflected, section 2.2."""
    increments, _, _, _ = control_coefficients(air, surfaces)
    return add_coefficients(clean_coefficients(air, state), increments)


@elementwise
def loads(air: AirData, coefficients: Coefficients, X_cg: float) -> Loads:
    """Loads [N, N m] about the centre of gravity at X_cg [m], eqs 2.8-2.13 and moment transfer.

    Linear in the coefficients, so the slopes of the loads are the loads of the slopes.
    """
    force = air.dynamic_pressure * WING_AREA
    lift = force * coefficients.CL
    drag = force * coefficients.CD
    Fy = force * coefficients.CY
    Fz = -drag * air.sin_alpha - lift * air.cos_alpha
    return Loads(
        lift * air.sin_alpha - drag * air.cos_alpha,
        Fy,
        Fz,
        force * WING_SPAN * coefficients.Cl,
        force * MEAN_CHORD * coefficients.Cm - X_cg * Fz,
        force * WING_SPAN * coefficients.Cn + X_cg * Fy,
    )
