# Copyright 2026 ahv developers, Apache-2.0
"""Intermediate loop: from attitude error to the body-rate command (section 3.2)."""

from typing import NamedTuple

from ahv_plant.model.vectors import Attitude, Rates, State
from ahv_plant.numerics.elementary import sin_cos
from ahv_plant.numerics.elementwise import elementwise


class IntermediateLoop(NamedTuple):
    """Settings of the intermediate loop."""

    k_phi: float  # [1/s]
    k_theta: float  # [1/s]
    k_psi: float  # [1/s]


@elementwise
def rate_command(
    state: State, command: Attitude, psi_rate: float, settings: IntermediateLoop
) -> Rates:
    """Body rates P*, Q*, R* that close the attitude error at the gains, section 3.2.

    `psi_rate` [rad/s] is that of the heading commanded, which the report takes as zero.

    The inverse of eq 2.4's matrix, written out: it has no singularity, unlike the matrix itself.
    """
    sin_phi, cos_phi = sin_cos(state.phi)
    sin_theta, cos_theta = sin_cos(state.theta)
    phi_dot = settings.k_phi * (command.phi - state.phi)
    theta_dot = settings.k_theta * (command.theta - state.theta)
    psi_dot = settings.k_psi * (command.psi - state.psi) + psi_rate
    return Rates(
        phi_dot - psi_dot * sin_theta,
        theta_dot * cos_phi + psi_dot * sin_phi * cos_theta,
        -theta_dot * sin_phi + psi_dot * cos_phi * cos_theta,
    )
