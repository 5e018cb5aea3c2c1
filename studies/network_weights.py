# Copyright 2026 ahv developers, Apache-2.0
"""Weights of the cloned network: `python -m studies.network_weights` writes them into the package.

The teacher, the linear-quadratic law, is asked at states drawn uniformly from a box around the
trims, and at states of the same box shrunk towards its centre, where flights spend their time. One
hidden layer is fitted to its answers by L-BFGS (Liu and Nocedal, 1989). No flight is flown for it.
"""

from pathlib import Path
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ahv_control.laws._lqi_gains import CORNERS
from ahv_control.laws._lqi_schedule import Lateral, Longitudinal, blended
from ahv_control.laws.network import CENTRE, OUT_SCALE, SCALE, Network, forward

Array = NDArray[np.float64]
WEIGHTS = "ahv_control/laws/_network_weights.py"
SEED, SAMPLES, HIDDEN, ITERATIONS = 1, 6000, 32, 3000
ALWAYS_WHOLE = [2, 13, 14]  # angle of attack, mass and Mach number are not shrunk


def drawn(seed: int, count: int) -> Array:
    """What the network is told (count, 15), in its units."""
    generator = np.random.default_rng(seed)
    unit = generator.uniform(-1.0, 1.0, (count, len(CENTRE)))
    shrunk = generator.uniform(0.0, 1.0, (count, 1))
    whole = np.isin(np.arange(len(CENTRE)), ALWAYS_WHOLE)
    return CENTRE + SCALE * np.where(whole, 1.0, shrunk) * unit


def taught(told: Array) -> Array:
    """What the teacher answers (count, 5), in the units of `Answer`."""
    return np.array(
        [
            blended(Longitudinal(*row[:7]), Lateral(*row[7:13]), row[13], row[14], CORNERS)
            for row in told.tolist()
        ]
    )


def fitted(told: Array, wanted: Array) -> tuple[Array, Array, Array, Array]:
    """Weights and biases of the hidden and the last layer."""
    x, y = (told - CENTRE) / SCALE, wanted / OUT_SCALE
    n, m = x.shape[1], y.shape[1]
    ends = np.cumsum([n * HIDDEN, HIDDEN, HIDDEN * m, m])

    def parts(vector: Array) -> tuple[Array, Array, Array, Array]:
        a, b, c, d = np.split(vector, ends[:-1])
        return a.reshape(n, HIDDEN), b, c.reshape(HIDDEN, m), d

    def cost(vector: Array) -> tuple[float, Array]:
        a, b, c, d = parts(vector)
        hidden = np.tanh(x @ a + b)
        error = hidden @ c + d - y
        back = error @ c.T * (1.0 - hidden * hidden)
        slopes = (x.T @ back, back.sum(0), hidden.T @ error, error.sum(0))
        gradient = np.concatenate([slope.ravel() for slope in slopes]) / len(x)
        return 0.5 * float((error * error).sum()) / len(x), gradient

    first = np.random.default_rng(SEED).normal(0.0, 0.3, ends[-1])
    found = minimize(
        cost,
        first,
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": ITERATIONS, "maxcor": 30, "maxfun": 10**6, "ftol": 0.0, "gtol": 0.0},
    )
    return parts(found.x)


def source(weights: tuple[Array, Array, Array, Array]) -> str:
    """Text of the module that holds the weights, to seven digits."""
    numbers = " ".join(f"{value:.7g}" for part in weights for value in part.ravel())
    lines = "\n".join(wrap(numbers, 99))
    return f'''# Copyright 2026 ahv developers, Apache-2.0
"""Weights of the cloned network, which `python -m studies.network_weights` wrote."""

HIDDEN = {HIDDEN}  # [-] units of the hidden layer
# [-] weights of the hidden layer, its biases, weights of the last layer, its biases
NUMBERS = """
{lines}
"""
'''


def main() -> None:
    """Write the weights into the package, and print how far they are from the teacher."""
    told = drawn(SEED, SAMPLES)
    weights = fitted(told, taught(told))
    Path(WEIGHTS).write_text(source(weights), encoding="utf-8")
    fresh = drawn(SEED + 1, 2000)
    error = np.abs(forward(Network(*weights), fresh) - taught(fresh))
    print("error at fresh states, by answer: mean", error.mean(0), "largest", error.max(0))


if __name__ == "__main__":
    main()
