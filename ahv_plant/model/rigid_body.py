# Copyright 2026 ahv developers, Apache-2.0
"""Rigid-body equations over a flat Earth (eqs 2.1, 2.3-2.5, corrected in docs/errata.md)."""

from ahv_plant.model.aerodynamics import Loads
from ahv_plant.model.constants import GRAVITY
from ahv_plant.model.mass import Inertia
from ahv_plant.model.vectors import State
from ahv_plant.numerics.elementary import sin_cos
from ahv_plant.numerics.elementwise import elementwise


@elementwise
def angular_acceleration(
    P: float, Q: float, R: float, L: float, M: float, N: float, body: Inertia
) -> tuple[float, float, float]:
    """Rates of P, Q, R [rad/s^2] under the moments L, M, N [N m], eq 2.3.

    With I_xz = 0, c2 = c4 = c6 = 0 and the others are the quotients below.
    """
    return (
        ((body.Iyy - body.Izz) * Q * R + L) / body.Ixx,
        ((body.Izz - body.Ixx) * P * R + M) / body.Iyy,
        ((body.Ixx - body.Iyy) * P * Q + N) / body.Izz,
    )


@elementwise
def motion(state: State, total: Loads, mass_rate: float, body: Inertia) -> State:
    """Rates of all states [their units per s] under the total loads, eqs 2.1 and 2.3-2.6."""
    u, v, w = state.u, state.v, state.w
    P, Q, R = state.P, state.Q, state.R
    sin_phi, cos_phi = sin_cos(state.phi)
    sin_theta, cos_theta = sin_cos(state.theta)
    sin_psi, cos_psi = sin_cos(state.psi)
    P_dot, Q_dot, R_dot = angular_acceleration(P, Q, R, total.L, total.M, total.N, body)
    psi_dot = (Q * sin_phi + R * cos_phi) / cos_theta
    per_mass = 1.0 / state.mass
    down = v * sin_phi + w * cos_phi  # velocity along the vertical plane's normal to u
    across = v * cos_phi - w * sin_phi
    ahead = u * cos_theta + down * sin_theta
    return State(
        R * v - Q * w - GRAVITY * sin_theta + total.Fx * per_mass,
        P * w - R * u + GRAVITY * cos_theta * sin_phi + total.Fy * per_mass,
        Q * u - P * v + GRAVITY * cos_theta * cos_phi + total.Fz * per_mass,
        P_dot,
        Q_dot,
        R_dot,
        P + psi_dot * sin_theta,
        Q * cos_phi - R * sin_phi,
        psi_dot,
        ahead * cos_psi - across * sin_psi,
        ahead * sin_psi + across * cos_psi,
        u * sin_theta - down * cos_theta,
        mass_rate,
    )
