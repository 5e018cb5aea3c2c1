# Copyright 2026 ahv developers, Apache-2.0
"""Disturbance learner: observer, basis and constrained weight update (section 4.2, eqs 4.3-4.14).

Learned in degrees: the report's gamma and k_b mean what they should only with rates in deg/s.
Rates at the interface are in rad/s, as everywhere; basis, weights and errors are in degrees.

The weight update (4.13) has a barrier at |e| = k_b, and an explicit step can jump over it. Here
the observer error after a step solves the implicit step; that solution exists, is unique, and lies
inside the barrier whatever the disturbance: docs/adaptive_control.md derives it.
"""

from math import sqrt
from typing import NamedTuple

from ahv_control.error_dynamics import ErrorDynamics, error_decay
from ahv_control.servo_model import AT_ZERO, ModelledServos, ServoModel
from ahv_plant.model.constants import DEGREES, RADIANS, STEP
from ahv_plant.model.vectors import Rates
from ahv_plant.numerics.elementwise import elementwise, select


class LearnerSettings(NamedTuple):
    """Settings of the learner, the same barrier and rate for each channel."""

    tracking: ErrorDynamics  # of the desired plant, eq 4.1
    k_ap: Rates  # [1/s] observer gain, eq 4.3
    k_b: float  # [deg/s] bound on the observer error, eq 4.11
    gamma: float  # [deg^2/s^4] learning rate, eq 4.11
    theta: float  # [s^2] weight of the Jacobian's error, Theta = theta I, eq 4.11
    geometric: bool  # h is a geometric altitude
    first_estimate: float = 0.0  # [deg/s^2] d-hat of the pitch channel before any measurement
    measured_surfaces: bool = False  # the observer hears where they are, not the command
    servo_model: ServoModel | None = None  # by which it reckons where they are, if there is one


class Basis(NamedTuple):
    """Basis phi(X) of section 4.3 with P, Q, R in deg/s; also its weights, one set a channel."""

    one: float = 0.0
    P: float = 0.0
    P2: float = 0.0
    Q: float = 0.0
    Q2: float = 0.0
    P2Q2: float = 0.0
    R: float = 0.0
    R2: float = 0.0
    P2R2: float = 0.0
    Q2R2: float = 0.0
    P2Q2R2: float = 0.0


class LearnerState(NamedTuple):
    """What the learner remembers."""

    X_a: Rates  # [rad/s] rates of the approximate plant, eq 4.3
    X_d: Rates  # [rad/s] rates of the desired plant, eq 4.1
    W_P: Basis  # weights of d in the roll channel, [deg/s^2] by the units of the basis
    W_Q: Basis  # pitch
    W_R: Basis  # yaw
    servos: ModelledServos  # where it takes the surfaces to be; at zero without a model of them


@elementwise
def basis(P: float, Q: float, R: float) -> Basis:
    """phi(X) at rates in deg/s, section 4.3."""
    PQ, PR, QR = P * Q, P * R, Q * R
    PQR = PQ * R
    return Basis(1.0, P, P * P, Q, Q * Q, PQ * PQ, R, R * R, PR * PR, QR * QR, PQR * PQR)


@elementwise
def basis_jacobian(P: float, Q: float, R: float) -> tuple[Basis, Basis, Basis]:
    """Slopes of phi by P, Q and R at rates in deg/s, eq 4.14 (docs/errata.md)."""
    PP, QQ, RR = P * P, Q * Q, R * R
    P_, Q_, R_ = 2.0 * P, 2.0 * Q, 2.0 * R
    return (
        Basis(0.0, 1.0, P_, 0.0, 0.0, P_ * QQ, 0.0, 0.0, P_ * RR, 0.0, P_ * QQ * RR),
        Basis(0.0, 0.0, 0.0, 1.0, Q_, Q_ * PP, 0.0, 0.0, 0.0, Q_ * RR, Q_ * PP * RR),
        Basis(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, R_, R_ * PP, R_ * QQ, R_ * PP * QQ),
    )


@elementwise
def dot(a: Basis, b: Basis) -> float:
    """Inner product of two sets; its unit is the product of any unit of theirs."""
    return (
        a.one * b.one
        + a.P * b.P
        + a.P2 * b.P2
        + a.Q * b.Q
        + a.Q2 * b.Q2
        + a.P2Q2 * b.P2Q2
        + a.R * b.R
        + a.R2 * b.R2
        + a.P2R2 * b.P2R2
        + a.Q2R2 * b.Q2R2
        + a.P2Q2R2 * b.P2Q2R2
    )


@elementwise
def add_scaled(a: Basis, scale: float, b: Basis) -> Basis:
    """Sum a + scale b, in any unit that the two share."""
    return Basis(
        a.one + scale * b.one,
        a.P + scale * b.P,
        a.P2 + scale * b.P2,
        a.Q + scale * b.Q,
        a.Q2 + scale * b.Q2,
        a.P2Q2 + scale * b.P2Q2,
        a.R + scale * b.R,
        a.R2 + scale * b.R2,
        a.P2R2 + scale * b.P2R2,
        a.Q2R2 + scale * b.Q2R2,
        a.P2Q2R2 + scale * b.P2Q2R2,
    )


@elementwise
def learning_direction(P: float, Q: float, R: float, gamma: float, theta: float) -> Basis:
    """[I/gamma + J Theta J^T]^-1 phi of eq 4.13 at rates in deg/s; J is the 11 x 3 Jacobian.

    By Woodbury's identity this is gamma (phi - c J (I + c J^T J)^-1 J^T phi) with c = gamma theta:
    a 3 x 3 system instead of the 11 x 11 one, and good for theta = 0.
    """
    phi = basis(P, Q, R)
    j1, j2, j3 = basis_jacobian(P, Q, R)
    c = gamma * theta
    a11, a12, a13 = 1.0 + c * dot(j1, j1), c * dot(j1, j2), c * dot(j1, j3)
    a22, a23, a33 = 1.0 + c * dot(j2, j2), c * dot(j2, j3), 1.0 + c * dot(j3, j3)
    b1, b2, b3 = dot(j1, phi), dot(j2, phi), dot(j3, phi)
    # Cholesky-like elimination of the symmetric positive definite matrix: every pivot is >= 1
    l21, l31 = a12 / a11, a13 / a11
    p22 = a22 - l21 * a12
    p23 = a23 - l21 * a13
    l32 = p23 / p22
    p33 = a33 - l31 * a13 - l32 * p23
    y2 = b2 - l21 * b1
    y3 = b3 - l31 * b1 - l32 * y2
    x3 = y3 / p33
    x2 = y2 / p22 - l32 * x3
    x1 = b1 / a11 - l21 * x2 - l31 * x3
    inside = add_scaled(add_scaled(add_scaled(phi, -c * x1, j1), -c * x2, j2), -c * x3, j3)
    return add_scaled(Basis(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), gamma, inside)


@elementwise
def barrier_step(
    innovation: float, k_ap: float, k_b: float, strength: float
) -> tuple[float, float]:
    """Observer error e [deg/s] after one implicit step of eqs 4.9 and 4.13, always within k_b.

    Returns e and the barrier's push e / (k_b^2 - e^2) [s/deg].

    `innovation` [deg/s] is the error that the step would leave without observer gain and learning,
    `strength` [deg^2/s^4] is phi^T [...]^-1 phi. The error e solves

        (1 + h k_ap) e + h^2 strength e / (k_b^2 - e^2) = innovation.

    With y = s / (1 - s^2), s = e / k_b, the left side is increasing and concave in |y|, so that
    Newton's method from y = 0 approaches the solution from one side and never passes it: whatever
    is left after a fixed number of steps errs towards less learning.
    """
    a = (1.0 + STEP * k_ap) * k_b
    b = STEP * STEP * strength * (1.0 / k_b)
    size = select(innovation < 0.0, -innovation, innovation)
    y = size / (a + b)
    y = _newton_towards(y, a, b, size)
    y = _newton_towards(y, a, b, size)
    y = _newton_towards(y, a, b, size)
    y = _newton_towards(y, a, b, size)
    y = _newton_towards(y, a, b, size)
    s = 2.0 * y / (1.0 + sqrt(1.0 + 4.0 * y * y))
    sign = select(innovation < 0.0, -1.0, 1.0)
    return sign * s * k_b, sign * y * (1.0 / k_b)


@elementwise
def _newton_towards(y: float, a: float, b: float, size: float) -> float:
    """One Newton step of a s(y) + b y = size, where s = 2 y / (1 + sqrt(1 + 4 y^2))."""
    root = sqrt(1.0 + 4.0 * y * y)
    scale = root * (1.0 + root)
    return y + ((size - b * y) * scale - 2.0 * a * y * root) / (2.0 * a + b * scale)


@elementwise
def disturbance_estimate(learner: LearnerState, rates: Rates) -> Rates:
    """d-hat = W^T phi(X) [rad/s^2] at rates [rad/s], below eq 4.9."""
    phi = basis(rates.P * DEGREES, rates.Q * DEGREES, rates.R * DEGREES)
    return Rates(
        dot(learner.W_P, phi) * RADIANS,
        dot(learner.W_Q, phi) * RADIANS,
        dot(learner.W_R, phi) * RADIANS,
    )


@elementwise
def start_learner(rates: Rates, first_estimate: float = 0.0) -> LearnerState:
    """Learner that has seen nothing but the first rates [rad/s].

    It assumes the pitch disturbance `first_estimate` [deg/s^2] until it has learned better; a
    positive one is nose up. docs/adaptive_control.md says what that is for.
    """
    none = Basis(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    pitch = Basis(first_estimate, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return LearnerState(rates, rates, none, pitch, none, AT_ZERO)


@elementwise
def with_servos(learner: LearnerState, servos: ModelledServos) -> LearnerState:
    """Learner that takes the surfaces to be where these servos have them [rad]."""
    return LearnerState(learner.X_a, learner.X_d, learner.W_P, learner.W_Q, learner.W_R, servos)


@elementwise
def _learn(
    measured: float,
    predicted: float,
    k_ap: float,
    weights: Basis,
    direction: Basis,
    strength: float,
    k_b: float,
) -> tuple[float, Basis]:
    """Advance X_a [rad/s] and weights of one channel; rates [rad/s], the rest in degrees."""
    error, push = barrier_step((measured - predicted) * DEGREES, k_ap, k_b, strength)
    return measured - error * RADIANS, add_scaled(weights, STEP * push, direction)


@elementwise
def learner_step(
    learner: LearnerState, response: Rates, command: Rates, now: Rates, settings: LearnerSettings
) -> LearnerState:
    """Learner one step later (eqs 4.1, 4.3, 4.13), when the rates `now` [rad/s] are measured.

    `response` is f(X, U) [rad/s^2] of the nominal model one step ago, under the surfaces as the
    observer has them; `command` are the P*, Q*, R* [rad/s] of then. The step is implicit: basis
    and error are those of now, which is what makes the Lyapunov function fall in discrete time.
    """
    estimate = disturbance_estimate(learner, now)
    P, Q, R = now.P * DEGREES, now.Q * DEGREES, now.R * DEGREES
    direction = learning_direction(P, Q, R, settings.gamma, settings.theta)
    strength = dot(basis(P, Q, R), direction)
    X_a, X_d, k_ap, k_b = learner.X_a, learner.X_d, settings.k_ap, settings.k_b
    P_next = X_a.P + STEP * (response.P + estimate.P)
    Q_next = X_a.Q + STEP * (response.Q + estimate.Q)
    R_next = X_a.R + STEP * (response.R + estimate.R)
    P_a, W_P = _learn(now.P, P_next, k_ap.P, learner.W_P, direction, strength, k_b)
    Q_a, W_Q = _learn(now.Q, Q_next, k_ap.Q, learner.W_Q, direction, strength, k_b)
    R_a, W_R = _learn(now.R, R_next, k_ap.R, learner.W_R, direction, strength, k_b)
    rate = error_decay(X_d, command, settings.tracking)  # nominal plant and law, eq 4.1
    X_d = Rates(X_d.P + STEP * rate.P, X_d.Q + STEP * rate.Q, X_d.R + STEP * rate.R)
    return LearnerState(Rates(P_a, Q_a, R_a), X_d, W_P, W_Q, W_R, learner.servos)
