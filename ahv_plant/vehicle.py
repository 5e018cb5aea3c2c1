# Copyright 2026 ahv developers, Apache-2.0
"""The vehicle: eqs 2.1-2.14 under held controls, and one Runge-Kutta step of them."""

from ahv_plant.dispersion import (
    Truth,
    disperse_air,
    disperse_centre,
    disperse_coefficients,
    disperse_inertia,
    disperse_surfaces,
    disperse_thrust,
    disperse_weight,
    disturbance_acceleration,
)
from ahv_plant.hardware.wind import TurbulentAir, through_air
from ahv_plant.model.aerodynamics import Loads, aerodynamic_coefficients, air_data, loads
from ahv_plant.model.constants import GRAVITY, MAXIMUM_THRUST, SPECIFIC_IMPULSE, STEP
from ahv_plant.model.mass import centre_of_gravity, inertia
from ahv_plant.model.rigid_body import motion
from ahv_plant.model.vectors import State, Surfaces, limit_surfaces, limit_throttle
from ahv_plant.numerics.elementwise import elementwise


@elementwise
def state_rate(
    state: State,
    surfaces: Surfaces,
    throttle: float,
    time: float,
    truth: Truth,
    turbulence: TurbulentAir | None = None,
) -> State:
    """Rates of the 13 states, eqs 2.1-2.14, with surfaces [rad] and sigma_T [-] as they are.

    `truth` is what sets the true vehicle and its air apart from the nominal ones, at `time` [s];
    `turbulence` is that of the step, if there is any.
    """
    further = truth.further
    moving = through_air(state, time, turbulence, truth.wind)
    air = disperse_air(air_data(moving, truth.geometric), further)
    nominal = aerodynamic_coefficients(air, state, disperse_surfaces(surfaces, further))
    coefficients = disperse_coefficients(nominal, truth.dispersion)
    aero = loads(air, coefficients, disperse_centre(centre_of_gravity(state.mass), further))
    thrust = disperse_thrust(throttle * MAXIMUM_THRUST, further)
    total = Loads(aero.Fx + thrust, aero.Fy, aero.Fz, aero.L, aero.M, aero.N)
    mass_rate = -thrust / (SPECIFIC_IMPULSE * GRAVITY)  # eq 2.6
    body = disperse_inertia(inertia(state.mass), truth.dispersion)
    rate = motion(state, disperse_weight(total, further), mass_rate, body)
    d_P, d_Q, d_R = disturbance_acceleration(
        truth.disturbance, time, state.P, state.Q, state.R
    )  # eq 4.2
    return State(
        rate.u,
        rate.v,
        rate.w,
        rate.P + d_P,
        rate.Q + d_Q,
        rate.R + d_R,
        rate.phi,
        rate.theta,
        rate.psi,
        rate.x,
        rate.y,
        rate.h,
        rate.mass,
    )


@elementwise
def along(state: State, rate: State, time: float) -> State:
    """The state moved along its rate for `time` [s]."""
    return State(
        state.u + time * rate.u,
        state.v + time * rate.v,
        state.w + time * rate.w,
        state.P + time * rate.P,
        state.Q + time * rate.Q,
        state.R + time * rate.R,
        state.phi + time * rate.phi,
        state.theta + time * rate.theta,
        state.psi + time * rate.psi,
        state.x + time * rate.x,
        state.y + time * rate.y,
        state.h + time * rate.h,
        state.mass + time * rate.mass,
    )


@elementwise
def vehicle_step(
    state: State,
    surfaces: Surfaces,
    throttle: float,
    time: float,
    truth: Truth,
    turbulence: TurbulentAir | None = None,
) -> State:
    """The state 0.01 s after `time` [s]: Runge-Kutta of fourth order.

    Controls and turbulence are held.
    """
    held = limit_surfaces(surfaces)
    power = limit_throttle(throttle)
    half = 0.5 * STEP
    k1 = state_rate(state, held, power, time, truth, turbulence)
    k2 = state_rate(along(state, k1, half), held, power, time + half, truth, turbulence)
    k3 = state_rate(along(state, k2, half), held, power, time + half, truth, turbulence)
    k4 = state_rate(along(state, k3, STEP), held, power, time + STEP, truth, turbulence)
    ends = along(along(state, k1, STEP / 6.0), k4, STEP / 6.0)
    return along(along(ends, k2, STEP / 3.0), k3, STEP / 3.0)
