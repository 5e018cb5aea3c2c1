# Copyright 2026 ahv developers, Apache-2.0
"""Linear models: how small departures from a trim move the vehicle, in air and on its hardware."""

from math import asin, atan, atan2, cos, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ahv_analysis.bag.rows import Array
from ahv_analysis.gnc.numbers_of import jacobian
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import NOMINAL, Truth
from ahv_plant.envelope import why_no_trim
from ahv_plant.model.constants import GRAVITY, INITIAL_MASS
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.trim import CRUISE_ALTITUDE, CRUISE_SPEED, Trim, trim
from ahv_plant.vehicle import state_rate

HELD = ("x", "y", "mass")  # no force depends on the first two; fuel burns off in minutes
STATES = tuple(name for name in State._fields if name not in HELD)
INPUTS = (*Surfaces._fields, "throttle")
OUTPUTS = (*STATES, "alpha", "beta", "gamma", "speed", "n_z")
UNITS = dict.fromkeys(("u", "v", "w", "speed"), "m/s")
UNITS |= dict.fromkeys(("P", "Q", "R"), "rad/s")
UNITS |= dict.fromkeys(("phi", "theta", "psi", "alpha", "beta", "gamma"), "rad")
UNITS |= dict.fromkeys(Surfaces._fields, "rad") | {"h": "m", "throttle": "1", "n_z": "1"}
DEPARTURES = {"m/s": 0.5, "rad/s": 1e-3, "rad": 1e-3, "m": 10.0, "1": 1e-2}  # by unit
IDLE = 1e-9  # a slope that is what is left of zero, in any unit


class LinearModel(NamedTuple):
    """x' = A x + B u, y = C x + D u for departures from a trim.

    Where time is sampled, x' is the departure a step later.
    """

    A: Array  # (states, states)
    B: Array  # (states, inputs)
    C: Array  # (outputs, states)
    D: Array  # (outputs, inputs)
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    step: float  # [s] between samples; 0 where time is continuous
    at: Trim  # what it departs from


def trim_to_linearise(
    altitude: float = CRUISE_ALTITUDE,
    speed: float = CRUISE_SPEED,
    mass: float = INITIAL_MASS,
    truth: Truth = NOMINAL,
) -> Trim:
    """Trim at `altitude` [m], u = `speed` [m/s], `mass` [kg]; ParameterError where there is none.

    Beyond 5 deg, where the inlet would unstart, there is one: the model does not end there.
    """
    try:
        found = trim(altitude, speed, mass, truth)
    except ValueError as error:
        raise ParameterError(str(error)) from error
    if not (found.converged and found.within_limits):
        raise ParameterError(
            f"there is no trim at {altitude:g} m, {speed:g} m/s and {mass:g} kg: "
            f"{why_no_trim(found)}"
        )
    return found


def _departures(names: tuple[str, ...]) -> Array:
    return np.array([DEPARTURES[UNITS[name]] for name in names])


def _outputs(state: State, rate: State) -> list[float]:
    """What is told of the motion: air data, climb angle [rad], load factor along -z [-]."""
    in_plane = sqrt(state.u**2 + state.w**2)
    speed = sqrt(in_plane**2 + state.v**2)
    felt = rate.w - state.Q * state.u + state.P * state.v
    n_z = (GRAVITY * cos(state.theta) * cos(state.phi) - felt) / GRAVITY
    return [
        atan2(state.w, state.u),
        atan(state.v / in_plane),
        asin(rate.h / speed),
        speed,
        n_z,
    ]


def vehicle_model(at: Trim, truth: Truth = NOMINAL) -> LinearModel:
    """The vehicle of `truth` at a trim, in continuous time; inputs are where the controls are.

    Mass, x and y are held: their departures move nothing else but slowly, or not at all.
    """
    place = [State._fields.index(name) for name in STATES]
    start = np.array([*(at.state[i] for i in place), *at.surfaces, at.throttle])

    def motion(numbers: Array) -> Array:
        values = list(at.state)
        for i, number in zip(place, numbers, strict=False):
            values[i] = float(number)
        right, left, rudder, throttle = map(float, numbers[len(place) :])
        state = State(*values)
        rate = state_rate(state, Surfaces(right, left, rudder), throttle, 0.0, truth)
        return np.array([*(rate[i] for i in place), *_outputs(state, rate)])

    slopes = jacobian(motion, start, _departures((*STATES, *INPUTS)))
    count = len(STATES)
    A, B = slopes[:count, :count], slopes[:count, count:]
    C = np.vstack((np.eye(count), slopes[count:, :count]))
    D = np.vstack((np.zeros((count, len(INPUTS))), slopes[count:, count:]))
    return LinearModel(A, B, C, D, STATES, INPUTS, OUTPUTS, 0.0, at)


def state_space(model: LinearModel) -> Any:
    """The model as a `control.StateSpace` with its names; ImportError without python-control."""
    import control

    return control.ss(
        model.A,
        model.B,
        model.C,
        model.D,
        model.step,
        states=list(model.states),
        inputs=list(model.inputs),
        outputs=list(model.outputs),
    )


def write_model(model: LinearModel, path: Path) -> None:
    """Write the model to an .npz file: A, B, C, D, the names, the step [s] and the trim."""
    np.savez(
        path,
        A=model.A,
        B=model.B,
        C=model.C,
        D=model.D,
        states=np.array(model.states),
        inputs=np.array(model.inputs),
        outputs=np.array(model.outputs),
        step=model.step,
        trim_state=np.array(model.at.state),
        trim_controls=np.array([*model.at.surfaces, model.at.throttle]),
    )


def without_idle(model: LinearModel) -> LinearModel:
    """The model without states that never move, or that move nothing and are not measured."""
    keep = np.ones(len(model.states), dtype=bool)
    own = np.eye(len(model.states)) * (1.0 if model.step else 0.0)
    while True:
        rest = np.where(keep, 1.0, 0.0)
        moved = (np.abs(model.A - own) * rest > IDLE).any(axis=1)
        moved |= (np.abs(model.B) > IDLE).any(axis=1)
        moving = (np.abs(model.A - np.diag(np.diag(model.A))).T * rest > IDLE).any(axis=1)
        moving |= (np.abs(model.C) > IDLE).any(axis=0)
        still = keep & ~(moved & moving)
        if not still.any():
            break
        keep &= ~still
    names = tuple(name for name, kept in zip(model.states, keep, strict=True) if kept)
    return model._replace(
        A=model.A[np.ix_(keep, keep)], B=model.B[keep], C=model.C[:, keep], states=names
    )
