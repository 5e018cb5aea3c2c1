# Copyright 2026 ahv developers, Apache-2.0
"""Linear-quadratic regulator with integral action, scheduled over mass and Mach number.

P. C. Young and J. C. Willems, "An Approach to the Linear Multivariable Servomechanism Problem",
International Journal of Control 15(5), 1972; for the schedule see _lqi_schedule.py.

One law for everything, with no loops inside: altitude, speed and heading come straight from the
surfaces and the throttle. Its gains are those of the linearised nominal vehicle at four corners,
trimmed at 24 km (`studies/lqi_gains.py` computes them); between the corners the commands are
interpolated. What the surfaces do goes by the air's density, so away from 24 km they move the more
the thinner it is.

It has no targets for attitude and rates: it tells the trim's pitch, bank and heading of the
reference, and rates of zero.
"""

from typing import NamedTuple

from ahv_control.law import Commands
from ahv_control.laws._lqi_gains import ALTITUDE, CORNERS
from ahv_control.laws._lqi_schedule import Answer, Corners, Lateral, Longitudinal, blended
from ahv_control.reference import Reference
from ahv_plant.model.aerodynamics import air_data
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import STEP, THROTTLE_MAXIMUM, THROTTLE_MINIMUM
from ahv_plant.model.vectors import (
    Attitude,
    Measurement,
    Rates,
    State,
    Surfaces,
    clamp,
    limit_surfaces,
    limit_throttle,
)
from ahv_plant.numerics.elementwise import elementwise, select


class Settings(NamedTuple):
    """Settings of the law: how much of an error it takes for an error."""

    altitude_error: float = 200.0  # [m] largest that is acted on
    speed_error: float = 20.0  # [m/s] largest that is acted on
    geometric_altitude: bool = False  # h is a geometric altitude, not a geopotential one


class Integrals(NamedTuple):
    """Memory of the law."""

    altitude: float  # [m s]
    speed: float  # [m]
    heading: float  # [rad s]


class Design(NamedTuple):
    """What is flown with."""

    settings: Settings
    corners: Corners
    density: float  # [kg/m^3] of the air that the gains are for


def design(settings: Settings) -> Design:
    """Return what is flown with: the gains and the air [kg/m^3] that they are for."""
    return Design(settings, CORNERS, atmosphere(ALTITUDE, settings.geometric_altitude).density)


@elementwise
def errors(state: State, reference: Reference, settings: Settings) -> Integrals:
    """Errors of altitude [m], speed [m/s] and heading [rad], as far as they are acted on."""
    return Integrals(
        clamp(state.h - reference.altitude, -settings.altitude_error, settings.altitude_error),
        clamp(state.u - reference.speed, -settings.speed_error, settings.speed_error),
        state.psi - reference.psi,
    )


@elementwise
def summed(
    sums: Integrals, state: State, commands: Commands, reference: Reference, settings: Settings
) -> Integrals:
    """Integrals a step later [m s, m, rad s]; what stands at its stops does not integrate."""
    was, power, turns = errors(state, reference, settings), commands.throttle, commands.status == 0
    driven = (power > THROTTLE_MINIMUM) & (power < THROTTLE_MAXIMUM)
    return Integrals(
        sums.altitude + select(turns, STEP * was.altitude, 0.0),
        sums.speed + select(driven, STEP * was.speed, 0.0),
        sums.heading + select(turns, STEP * was.heading, 0.0),
    )


@elementwise
def felt(
    state: State, sums: Integrals, reference: Reference, settings: Settings
) -> tuple[Longitudinal, Lateral, float]:
    """States of the schedule, of both motions, and the Mach number [-]."""
    air, now = air_data(state, settings.geometric_altitude), errors(state, reference, settings)
    climb = state.theta - air.alpha - reference.altitude_rate / air.speed
    x = Longitudinal(now.speed, climb, air.alpha, state.Q, now.altitude, sums.altitude, sums.speed)
    bank, turn = state.phi - reference.phi, state.R - reference.psi_rate
    return x, Lateral(air.beta, state.P, turn, bank, now.heading, sums.heading), air.mach


@elementwise
def commands_of(told: Answer, state: State, reference: Reference, design: Design) -> Commands:
    """All commands [rad, -]: by the air's density, and within the stops."""
    thinner = design.density / atmosphere(state.h, design.settings.geometric_altitude).density
    mean, difference = thinner * told.elevons, thinner * told.difference
    asked = Surfaces(mean + difference, mean - difference, thinner * told.rudder)
    held = limit_surfaces(asked)
    free = (
        (held.right_elevon == asked.right_elevon)
        & (held.left_elevon == asked.left_elevon)
        & (held.rudder == asked.rudder)
    )
    none = 0.0 * state.P
    attitude = Attitude(reference.phi + none, told.alpha, reference.psi + none)
    throttle = limit_throttle(told.throttle)
    return Commands(attitude, Rates(none, none, none), held, throttle, select(free, 0, 1))


@elementwise
def answer(state: State, sums: Integrals, reference: Reference, design: Design) -> Commands:
    """Commands to a state with the integrals of the errors up to it."""
    x, y, mach = felt(state, sums, reference, design.settings)
    told = blended(x, y, state.mass, mach, design.corners)
    return commands_of(told, state, reference, design)


@elementwise
def start(
    measured: Measurement, reference: Reference, settings: Design
) -> tuple[Integrals, Commands]:
    """Integrals of zero, and the commands to the first measurement."""
    sums = Integrals(0.0, 0.0, 0.0)
    return sums, answer(measured.state, sums, reference, settings)


@elementwise
def step(
    memory: Integrals,
    before: Measurement,
    commands: Commands,
    measured: Measurement,
    reference: Reference,
    settings: Design,
) -> tuple[Integrals, Commands]:
    """Integrals and commands one step later."""
    sums = summed(memory, before.state, commands, reference, settings.settings)
    return sums, answer(measured.state, sums, reference, settings)
