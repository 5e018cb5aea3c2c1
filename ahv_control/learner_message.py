# Copyright 2026 ahv developers, Apache-2.0
"""The learner's state and estimate as the values of their messages, and back."""

from collections.abc import Sequence

from ahv_control.disturbance_learner import LearnerState
from ahv_control.inner_loop import Learned
from ahv_plant.model.vectors import Rates, State


def learner_values(learner: LearnerState) -> tuple[float, ...]:
    """39 values in the order of `LEARNER_NAMES`: rates [rad/s], weights in degrees."""
    return (*learner.X_a, *learner.X_d, *learner.W_P, *learner.W_Q, *learner.W_R)


def estimate_values(estimate: Rates) -> tuple[float, ...]:
    """Six values of the acceleration message: no linear part, d-hat [rad/s^2] as angular part."""
    return 0.0, 0.0, 0.0, *estimate


def learned_of(learner: Sequence[float], estimate: Sequence[float]) -> Learned:
    """What the inner loop takes from the two messages: rates [rad/s], d-hat [rad/s^2]."""
    return Learned(Rates(*learner[0:3]), Rates(*learner[3:6]), Rates(*estimate[3:6]))


def unlearned(state: State, estimate: Sequence[float]) -> Learned:
    """What the inner loop takes while the learner is gone: the estimate alone.

    With both observers at the state, eqs 4.4-4.5 are the nominal law less d-hat [rad/s^2].
    """
    rates = Rates(state.P, state.Q, state.R)
    return Learned(rates, rates, Rates(*estimate[3:6]))
