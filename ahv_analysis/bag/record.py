# Copyright 2026 ahv developers, Apache-2.0
"""A flight as arrays, whether it comes from a bag or from memory, and what is derived from it."""

from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_control.disturbance_learner import LearnerState, disturbance_estimate
from ahv_control.law import Commands
from ahv_control.learner_message import learner_values
from ahv_control.newton_raphson import SolverStatus, nominal_response
from ahv_msgs_py.layout import NANOSECONDS
from ahv_plant.model.aerodynamics import AirData, air_data
from ahv_plant.model.constants import UNSTART_ALPHA
from ahv_plant.model.vectors import Rates, State, Surfaces
from ahv_plant.numerics.elementwise import kernel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FlightRecord:
    """N + 1 states and the commands that answer them."""

    stamps: NDArray[np.int64]  # (N+1,) [ns]
    states: Array  # (N+1, 13) in the order and units of State
    attitude_commands: Array  # (N+1, 3) [rad]
    rate_commands: Array  # (N+1, 3) [rad/s]
    surfaces: Array  # (N+1, 3) [rad]
    throttle: Array  # (N+1,) [-]
    geometric: bool  # h is a geometric altitude
    learner: Array | None = None  # (N+1, 39) X_a, X_d [rad/s] and weights, of an adaptive flight
    estimates: Array | None = None  # (N+1, 3) d-hat [rad/s^2], of an adaptive flight
    surfaces_lost_at: int | None = None  # [ns] when the surfaces first could not turn the vehicle

    @property
    def steps(self) -> int:
        """Number of integration steps N."""
        return len(self.stamps) - 1

    @property
    def time(self) -> Array:
        """Time (N+1,) [s]."""
        return self.stamps / NANOSECONDS

    def column(self, name: str) -> Array:
        """One state (N+1,) by its name."""
        column: Array = self.states[:, State._fields.index(name)]
        return column

    @cached_property
    def air(self) -> AirData:
        """Air data, every field an array (N+1,)."""
        rows = np.empty((len(self.states), len(AirData._fields)))
        _fill_air_data(np.ascontiguousarray(self.states), self.geometric, rows)
        return AirData(*np.ascontiguousarray(rows.T))

    @cached_property
    def climb_angle(self) -> Array:
        """Flight path angle gamma (N+1,) [rad], the angle of the velocity above the horizon."""
        u, v, w = (self.column(name) for name in "uvw")
        phi, theta = self.column("phi"), self.column("theta")
        down = v * np.sin(phi) + w * np.cos(phi)
        climb = u * np.sin(theta) - down * np.cos(theta)
        angle: Array = np.arcsin(climb / self.air.speed)
        return angle

    @property
    def observer_error(self) -> Array | None:
        """X - X_a (N+1, 3) [rad/s], the error of eq 4.9; None without a learner."""
        return None if self.learner is None else self.states[:, 3:6] - self.learner[:, :3]

    @cached_property
    def actual_disturbance(self) -> Array:
        """What the nominal model misses of the angular acceleration (N, 3) [rad/s^2], eq 4.2.

        Of each step: the mean acceleration, (X_k+1 - X_k) / h, less the nominal f(X_k, U_k). That
        is what the learner has to learn.
        """
        mean = np.diff(self.states[:, 3:6], axis=0) / np.diff(self.time)[:, None]
        for step, rate in enumerate(mean):
            state, surfaces = State(*self.states[step].tolist()), self.surfaces[step].tolist()
            rate -= nominal_response(state, Surfaces(*surfaces), self.geometric)
        return mean

    @property
    def inlet_started(self) -> bool:
        """Whether the inlet stayed started: |alpha| <= 5 deg throughout."""
        return bool(np.all(np.abs(self.air.alpha) <= UNSTART_ALPHA))


@kernel
def _fill_air_data(states, geometric, rows):
    """Fill `rows` (n, 7) with the air data of `states` (n, 13)."""
    for step in range(len(states)):
        s = states[step]
        state = State(
            s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11], s[12]
        )
        row, air = rows[step], air_data(state, geometric)
        row[0], row[1], row[2], row[3] = air.speed, air.alpha, air.beta, air.mach
        row[4], row[5], row[6] = air.dynamic_pressure, air.sin_alpha, air.cos_alpha


class Step(NamedTuple):
    """One step of a flight: the state and what the flight control answers."""

    stamp: int  # [ns]
    state: State
    commands: Commands
    learner: LearnerState | None
    ended_early: str  # why this is the last step before its time; empty if it is not


def record_of(steps: Iterable[Step], geometric: bool) -> FlightRecord:
    """Arrays of the steps of a library flight."""
    stamps = array("q")
    lost_at = None
    states, attitudes, rates, surfaces, throttles, learners, estimates = (
        array("d") for _ in range(7)
    )
    for step in steps:
        stamps.append(step.stamp)
        if lost_at is None and step.commands.status == SolverStatus.SINGULAR:
            lost_at = step.stamp
        states.extend(step.state)
        attitudes.extend(step.commands.attitude)
        rates.extend(step.commands.rates)
        surfaces.extend(step.commands.surfaces)
        throttles.append(step.commands.throttle)
        if step.learner is not None:
            body = Rates(step.state.P, step.state.Q, step.state.R)
            learners.extend(learner_values(step.learner))
            estimates.extend(disturbance_estimate(step.learner, body))
    count = len(stamps)
    return FlightRecord(
        np.frombuffer(stamps, np.int64),
        np.frombuffer(states).reshape(count, -1),
        np.frombuffer(attitudes).reshape(count, -1),
        np.frombuffer(rates).reshape(count, -1),
        np.frombuffer(surfaces).reshape(count, -1),
        np.frombuffer(throttles),
        geometric,
        np.frombuffer(learners).reshape(count, -1) if learners else None,
        np.frombuffer(estimates).reshape(count, -1) if estimates else None,
        lost_at,
    )
