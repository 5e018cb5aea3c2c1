# Copyright 2026 ahv developers, Apache-2.0
"""Modes of a linear model: eigenvalues with the names that flight dynamics has for them.

Participation of a state in a mode is the product of its parts in the right and the left
eigenvector (Perez-Arriaga, Verghese and Schweppe, IEEE Trans. PAS-101, 1982): how much of the mode
is in the state, whatever the units; over all states it adds up to one.
"""

from collections.abc import Sequence
from math import inf, log, pi
from typing import NamedTuple

import numpy as np

from ahv_analysis.bag.rows import Array
from ahv_analysis.gnc.linear_model import LinearModel

LONGITUDINAL = ("u", "w", "Q", "theta", "h")
LATERAL = ("v", "P", "R", "phi", "psi")
MODES = ("short period", "phugoid", "altitude", "dutch roll", "roll", "spiral", "heading")
NEUTRAL = 1e-7  # [rad/s] below which an eigenvalue is what is left of zero
SAME = 1e-4  # [-] difference within which it is the same eigenvalue
GONE = 1e-3  # [-] size of z below which a departure is gone within a step


class Mode(NamedTuple):
    """An eigenvalue, or a pair of them, of a model in continuous time."""

    name: str
    eigenvalue: complex  # [rad/s] of a pair the one above the real axis
    frequency: float  # [rad/s] natural
    damping: float  # [-] below zero where it grows
    participation: dict[str, float]  # [-] of each state, largest first

    @property
    def doubles(self) -> float:
        """Time [s] in which it doubles, or below zero in which it halves; infinite if neutral."""
        return log(2.0) / self.eigenvalue.real if self.eigenvalue.real else inf

    @property
    def period(self) -> float:
        """Time [s] of an oscillation; infinite where there is none."""
        return 2.0 * pi / self.eigenvalue.imag if self.eigenvalue.imag else inf


def eigenvalues_and_participation(A: Array) -> tuple[Array, Array]:
    """Eigenvalues (n,) of A, participation [-] (states, n): what each column adds up to is one."""
    values, right = np.linalg.eig(A)
    left = np.linalg.pinv(right)
    shares = np.abs(right * left.T)
    return values, shares / shares.sum(axis=0)


def modes(model: LinearModel) -> list[Mode]:
    """Modes of a vehicle in continuous time (`vehicle_model`), in the order of `MODES`.

    Longitudinal and lateral ones are told apart by participation. Of the longitudinal ones the
    fastest two eigenvalues are the short period; of the others the real one, or else the one that
    is most in h, is the altitude mode, and what is left the phugoid. Of the lateral ones the one
    that is zero is the heading, the pair the dutch roll, the faster of what is left the roll.
    """
    values, shares = eigenvalues_and_participation(model.A)
    along = [model.states.index(name) for name in LONGITUDINAL]
    lengthwise = shares[along].sum(axis=0) > 0.5
    found = _longitudinal(np.flatnonzero(lengthwise), values, shares, model.states)
    found |= _lateral(np.flatnonzero(~lengthwise), values, shares, model.states)
    named = [
        _mode(found[place], values[place], shares[:, place], model.states)
        for place in range(len(values))
        if values[place].imag >= 0.0
    ]
    return sorted(named, key=lambda mode: (MODES.index(mode.name), -mode.eigenvalue.real))


def _longitudinal(
    places: Array, values: Array, shares: Array, states: tuple[str, ...]
) -> dict[int, str]:
    fastest = sorted(places.tolist(), key=lambda place: -abs(values[place]))
    found = dict.fromkeys(fastest[:2], "short period")
    slow = fastest[2:]
    real = [place for place in slow if values[place].imag == 0.0]
    h = shares[states.index("h")]
    height = real if len(real) == 1 else sorted(real, key=lambda place: -h[place])[:1]
    return found | {place: "altitude" if place in height else "phugoid" for place in slow}


def _lateral(
    places: Array, values: Array, shares: Array, states: tuple[str, ...]
) -> dict[int, str]:
    rest = sorted(places.tolist(), key=lambda place: abs(values[place]))
    found = {}
    if rest and abs(values[rest[0]]) < NEUTRAL:
        found[rest.pop(0)] = "heading"
    pairs = [place for place in rest if values[place].imag != 0.0]
    v = shares[states.index("v")]
    dutch = sorted(pairs or rest, key=lambda place: -v[place])[:2]
    found |= dict.fromkeys(dutch, "dutch roll")
    slow = [place for place in rest if place not in dutch]
    return found | {place: "roll" if place == slow[-1] else "spiral" for place in slow}


def _mode(name: str, value: complex, shares: Array, states: tuple[str, ...]) -> Mode:
    value = complex(value) if abs(value) >= NEUTRAL else 0j
    frequency = abs(value)
    order = sorted(range(len(states)), key=lambda place: -shares[place])
    return Mode(
        name,
        value,
        frequency,
        -value.real / frequency if frequency else 1.0,
        {states[place]: float(shares[place]) for place in order},
    )


def sampled_modes(model: LinearModel, vehicle: Sequence[Mode]) -> list[Mode]:
    """Modes of a sampled model by s = ln(z) / step, slowest first; each is called by its state.

    Where one is that of the `vehicle`, it is called as there. What is gone within a step is left
    out: z = 0, as of a delay or of a copy of a state.
    """
    values, shares = eigenvalues_and_participation(model.A)
    found = []
    for place, z in enumerate(values):
        if abs(z) > GONE and z.imag >= 0.0:
            s = np.log(complex(z)) / model.step
            mode = _mode("", s, shares[:, place], model.states)
            known = min(vehicle, key=lambda other: abs(other.eigenvalue - mode.eigenvalue))
            near = abs(known.eigenvalue - mode.eigenvalue) < SAME * (1.0 + known.frequency)
            name = known.name if near else next(iter(mode.participation))
            found.append(mode._replace(name=name))
    return sorted(found, key=lambda mode: mode.frequency)
