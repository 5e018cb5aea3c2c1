# Copyright 2026 ahv developers, Apache-2.0
"""A small neural network that was taught to do what the linear-quadratic law does.

Cloned after D. A. Pomerleau, "Efficient Training of Artificial Neural Networks for Autonomous
Navigation", Neural Computation 3(1), 1991: a teacher answers states, and a network is fitted to
the answers (`studies/network_weights.py`). Its teacher is the law in lqi.py, whose integrals it
keeps: measurements and integrals go in, surfaces and throttle come out, and nothing else is inside
but one layer of hyperbolic tangents.

It is ordinary Python on NumPy arrays, to show that a law may be that: what keeps it out of the
lanes is the matrix product, whose sum has an order, and so last bits, of its own on every machine.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_control.law import Commands
from ahv_control.laws import lqi
from ahv_control.laws._lqi_schedule import Answer
from ahv_control.laws._network_weights import HIDDEN, NUMBERS
from ahv_control.laws.lqi import Settings
from ahv_control.reference import Reference
from ahv_plant.model.vectors import Measurement, State

Array = NDArray[np.float64]
# what goes in is divided by these, less the centre: then it lies between -1 and 1
CENTRE = np.array([0.0, 0.0, 0.035, *[0.0] * 10, 125_000.0, 6.0])
SCALE = np.array(
    [
        *(20.0, 0.05, 0.07, 0.1, 300.0, 8000.0, 800.0),  # [m/s, rad, rad, rad/s, m, m s, m]
        *(0.04, 0.2, 0.1, 0.5, 0.2, 0.5),  # [rad, rad/s, rad/s, rad, rad, rad s]
        *(15_000.0, 1.0),  # [kg, -]
    ]
)
# what comes out is multiplied by these, in the order of `Answer`: [rad, rad, rad, -, rad]
OUT_SCALE = np.array([0.5, 0.5, 0.5, 0.5, 0.1])


class Network(NamedTuple):
    """Weights."""

    hidden: Array
    hidden_bias: Array
    out: Array
    out_bias: Array


class Design(NamedTuple):
    """What is flown with."""

    teacher: lqi.Design  # its limits of errors, not its gains
    network: Network


def design(settings: Settings) -> Design:
    """Return what is flown with: the weights as arrays [-]."""
    numbers, told, answered = np.array(NUMBERS.split(), float), len(SCALE), len(OUT_SCALE)
    ends = np.cumsum([told * HIDDEN, HIDDEN, HIDDEN * answered])
    hidden, hidden_bias, out, out_bias = np.split(numbers, ends)
    network = Network(
        hidden.reshape(told, HIDDEN), hidden_bias, out.reshape(HIDDEN, answered), out_bias
    )
    return Design(lqi.design(settings), network)


def forward(network: Network, told: Array) -> Array:
    """Numbers of `Answer` (..., 5) for what is told (..., 15), in the units of SCALE."""
    hidden = np.tanh((told - CENTRE) / SCALE @ network.hidden + network.hidden_bias)
    answer: Array = (hidden @ network.out + network.out_bias) * OUT_SCALE
    return answer


def answer(state: State, sums: lqi.Integrals, reference: Reference, settings: Design) -> Commands:
    """Commands to a state with the integrals of the errors up to it."""
    x, y, mach = lqi.felt(state, sums, reference, settings.teacher.settings)
    told = forward(settings.network, np.array([*x, *y, state.mass, mach]))
    return lqi.commands_of(Answer(*told.tolist()), state, reference, settings.teacher)


def start(
    measured: Measurement, reference: Reference, settings: Design
) -> tuple[lqi.Integrals, Commands]:
    """Integrals of zero, and the commands to the first measurement."""
    sums = lqi.Integrals(0.0, 0.0, 0.0)
    return sums, answer(measured.state, sums, reference, settings)


def step(
    memory: lqi.Integrals,
    before: Measurement,
    commands: Commands,
    measured: Measurement,
    reference: Reference,
    settings: Design,
) -> tuple[lqi.Integrals, Commands]:
    """Integrals and commands one step later."""
    own = settings.teacher.settings
    sums = lqi.summed(memory, before.state, commands, reference, own)
    return sums, answer(measured.state, sums, reference, settings)
