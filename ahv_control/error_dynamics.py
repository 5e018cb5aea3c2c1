# Copyright 2026 ahv developers, Apache-2.0
"""How a rate error should decay: linear, or state-constrained (eqs 5.4-5.12). One law for both.

With the barrier Lyapunov function of eq 5.4, e_dot = -k / (k_s^2 - e^2)^(lambda - 1) e, eq 5.11.
Here the same is written with the gain at zero error, K = k k_s^(2 - 2 lambda):

    e_dot = -K (1 - e^2 / k_s^2)^(1 - lambda) e

lambda = 1 is plain dynamic inversion; with lambda > 1 the gain grows towards the bound k_s, as
that of a barrier should; with lambda < 1 it falls. From e^2 = (1 - FLOOR) k_s^2 on, inside the
bound and beyond it, the gain stays as it is there: the law is defined, continuous and restoring
everywhere.
"""

from typing import NamedTuple

from ahv_plant.model.vectors import Rates
from ahv_plant.numerics.elementary import power
from ahv_plant.numerics.elementwise import elementwise, select

FLOOR = 0.1  # [-] least value of 1 - e^2 / k_s^2 that the gain follows


class ErrorDynamics(NamedTuple):
    """Settings of the error dynamics of P, Q, R."""

    gain: Rates  # [1/s] K at zero error
    bound: Rates  # [rad/s] k_s
    exponent: float  # [-] lambda


@elementwise
def decay(error: float, gain: float, bound: float, exponent: float) -> float:
    """e_dot [rad/s^2] of one channel, eq 5.11."""
    ratio = error * (1.0 / bound)
    room = 1.0 - ratio * ratio
    room = select(room > FLOOR, room, FLOOR)
    return -gain * power(room, 1.0 - exponent) * error


@elementwise
def error_decay(value: Rates, target: Rates, settings: ErrorDynamics) -> Rates:
    """Rates [rad/s^2] at which `value` should approach `target` [rad/s], eq 5.12."""
    k, k_s, exponent = settings.gain, settings.bound, settings.exponent
    return Rates(
        decay(value.P - target.P, k.P, k_s.P, exponent),
        decay(value.Q - target.Q, k.Q, k_s.Q, exponent),
        decay(value.R - target.R, k.R, k_s.R, exponent),
    )
