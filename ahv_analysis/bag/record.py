# Copyright 2026 ahv developers, Apache-2.0
"""A flight as arrays, whether it comes from a bag or from memory, and what is derived from it."""

from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_analysis.bag.rows import BLOCK, Array, GrowingRows, Rows
from ahv_control.disturbance_learner import LearnerState, disturbance_estimate
from ahv_control.law import Commands
from ahv_control.learner_message import learner_values
from ahv_control.newton_raphson import SolverStatus, nominal_response
from ahv_control.reference import Reference
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.topics import LEARNER_NAMES
from ahv_plant.model.aerodynamics import AirData, air_data
from ahv_plant.model.constants import UNSTART_ALPHA
from ahv_plant.model.vectors import Measurement, Rates, State, Surfaces
from ahv_plant.numerics.elementwise import kernel


class Air:
    """The fields of AirData over a flight, each read when it is asked for."""

    def __init__(self, rows: Rows):
        """`rows` (N+1, 7) in the order of AirData."""
        self._rows = rows

    def __getattr__(self, name: str) -> Array:
        """A field of AirData, an array (N+1,)."""
        if name not in AirData._fields:
            raise AttributeError(name)
        return np.ascontiguousarray(self._rows[:, AirData._fields.index(name)])


@dataclass(frozen=True)
class FlightRecord:
    """N + 1 states and the commands that answer them; those of a long flight are on the disk."""

    stamps: NDArray[np.int64]  # (N+1,) [ns]
    states: Rows  # (N+1, 13) in the order and units of State: what truly flew
    attitude_commands: Rows  # (N+1, 3) [rad]
    rate_commands: Rows  # (N+1, 3) [rad/s]
    surfaces: Rows  # (N+1, 3) [rad] commanded
    throttle: Array  # (N+1,) [-]
    geometric: bool  # h is a geometric altitude
    learner: Rows | None = None  # (N+1, 39) X_a, X_d [rad/s] and weights, of an adaptive flight
    estimates: Rows | None = None  # (N+1, 3) d-hat [rad/s^2], of an adaptive flight
    surfaces_lost_at: int | None = None  # [ns] when the surfaces first could not turn the vehicle
    measured: Rows | None = None  # (N+1, 13) states as the flight software was told, None if truly
    positions: Rows | None = (
        None  # (N+1, 3) [rad] of the surfaces as measured, None if as commanded
    )
    references: Rows | None = None  # (N+1, 7) in the order of Reference, None without guidance
    law_failed_at: int | None = None  # [ns] when a law of one's own first had no answer

    @property
    def steps(self) -> int:
        """Number of integration steps N."""
        return len(self.stamps) - 1

    @property
    def time(self) -> Array:
        """Time (N+1,) [s]."""
        return self.stamps / NANOSECONDS

    def parts(self) -> Iterator["FlightRecord"]:
        """The flight in pieces, one behind the other, each of arrays in memory."""
        for start in range(0, len(self.stamps), BLOCK):
            part = slice(start, start + BLOCK)
            yield FlightRecord(
                self.stamps[part],
                self.states[part],
                self.attitude_commands[part],
                self.rate_commands[part],
                self.surfaces[part],
                self.throttle[part],
                self.geometric,
                None if self.learner is None else self.learner[part],
                None if self.estimates is None else self.estimates[part],
                self.surfaces_lost_at,
                None if self.measured is None else self.measured[part],
                None if self.positions is None else self.positions[part],
                None if self.references is None else self.references[part],
                self.law_failed_at,
            )

    def column(self, name: str) -> Array:
        """One state (N+1,) by its name."""
        column: Array = self.states[:, State._fields.index(name)]
        return column

    @cached_property
    def air(self) -> Air:
        """Air data, every field an array (N+1,), as in still air: states do not tell the wind."""
        growing = GrowingRows(len(AirData._fields))
        for start in range(0, len(self.states), BLOCK):
            states = np.ascontiguousarray(self.states[start : start + BLOCK])
            rows = np.empty((len(states), len(AirData._fields)))
            _fill_air_data(states, self.geometric, rows)
            growing.extend(rows)
        return Air(growing.rows())

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
        """X - X_a (N+1, 3) [rad/s], the error of eq 4.9; None without a learner.

        X is what the learner was told.
        """
        told = self.states if self.measured is None else self.measured
        return None if self.learner is None else told[:, 3:6] - self.learner[:, :3]

    @cached_property
    def actual_disturbance(self) -> Array:
        """What the nominal model misses of the angular acceleration (N, 3) [rad/s^2], eq 4.2.

        Of each step: the mean acceleration, (X_k+1 - X_k) / h, less the nominal f(X_k, U_k). That
        is what the learner has to learn. U_k are the surfaces as measured at the end of the step
        where they are, so that an actuator's lag is no disturbance of the vehicle.
        """
        acting, late = (self.surfaces, 0) if self.positions is None else (self.positions, 1)
        mean = np.diff(self.states[:, 3:6], axis=0) / np.diff(self.time)[:, None]
        for start in range(0, self.steps, BLOCK):
            part = slice(start, start + BLOCK)
            moved = acting[start + late : start + late + BLOCK].tolist()
            flown = zip(self.states[part].tolist(), moved, strict=False)
            for rate, (state, surfaces) in zip(mean[part], flown, strict=False):
                rate -= nominal_response(State(*state), Surfaces(*surfaces), self.geometric)
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
    state: State  # true
    commands: Commands
    learner: LearnerState | None
    ended_early: str  # why this is the last step before its time; empty if it is not
    measured: Measurement | None  # None with ideal hardware: the state, and surfaces as commanded
    reference: Reference | None = None  # that is followed; None where nothing guides
    own_law: bool = False  # a law of one's own answered

    @property
    def told(self) -> State:
        """State as the flight software is told it."""
        return self.state if self.measured is None else self.measured.state

    @property
    def estimate(self) -> Rates:
        """Disturbance [rad/s^2] as it has been learned; only with a learner."""
        assert self.learner is not None
        return disturbance_estimate(self.learner, Rates(self.told.P, self.told.Q, self.told.R))


def record_of(steps: Iterable[Step], geometric: bool) -> FlightRecord:
    """Arrays of the steps of a library flight."""
    stamps, throttles = array("q"), array("d")
    states, learners = GrowingRows(len(State._fields)), GrowingRows(len(LEARNER_NAMES))
    attitudes, rates, surfaces, estimates, positions = (GrowingRows(3) for _ in range(5))
    measured, references = GrowingRows(len(State._fields)), GrowingRows(len(Reference._fields))
    adaptive, equipped, guided = False, False, False
    lost_at: int | None = None
    failed_at: int | None = None
    for step in steps:
        stamps.append(step.stamp)
        if lost_at is None and step.commands.status == SolverStatus.SINGULAR:
            lost_at = step.stamp
        if failed_at is None and step.commands.status == SolverStatus.NO_ANSWER:
            failed_at = step.stamp
        states.append(step.state)
        attitudes.append(step.commands.attitude)
        rates.append(step.commands.rates)
        surfaces.append(step.commands.surfaces)
        throttles.append(step.commands.throttle)
        if step.learner is not None:
            adaptive = True
            learners.append(learner_values(step.learner))
            estimates.append(step.estimate)
        if step.measured is not None:
            equipped = True
            measured.append(step.measured.state)
            positions.append(step.measured.surfaces)
        if step.reference is not None:
            guided = True
            references.append(step.reference)
    return FlightRecord(
        np.frombuffer(stamps, np.int64),
        states.rows(),
        attitudes.rows(),
        rates.rows(),
        surfaces.rows(),
        np.frombuffer(throttles),
        geometric,
        learners.rows() if adaptive else None,
        estimates.rows() if adaptive else None,
        lost_at,
        measured.rows() if equipped else None,
        positions.rows() if equipped else None,
        references.rows() if guided else None,
        failed_at,
    )
