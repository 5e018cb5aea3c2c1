# Copyright 2026 ahv developers, Apache-2.0
"""The linear models: against a second model of the vehicle, and against what flies."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from ahv_analysis.flight.case import load_case
from ahv_analysis.gnc.linear_model import (
    OUTPUTS,
    STATES,
    state_space,
    trim_to_linearise,
    vehicle_model,
    without_idle,
)
from ahv_analysis.gnc.modes import modes
from ahv_analysis.gnc.sampled import plant_at, plant_model
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import NOMINAL, FurtherDispersion, Truth
from ahv_plant.model.constants import STEP
from test.test_command import assert_refused, told

TABLE = Path(__file__).parent / "data" / "aero_coefficients.csv"


class SecondModel:
    """The winged-cone vehicle in numpy, from the published table: it takes complex numbers.

    Forces in wind axes turned to body axes by matrices, moments about the centre of gravity by a
    cross product: nothing of the product is in it.
    """

    def __init__(self):
        with open(TABLE) as file:
            self.terms = list(csv.DictReader(file))

    def part(self, coefficient, part, alpha, mach, deflection=0.0):
        return sum(
            float(term["value"])
            * alpha ** int(term["alpha_power"])
            * mach ** int(term["mach_power"])
            * deflection ** int(term["deflection_power"])
            for term in self.terms
            if (term["coefficient"], term["part"]) == (coefficient, part)
        )

    def rate(self, x, controls, mass):
        u, v, w, P, Q, R, phi, theta, _, h = x
        speed = np.sqrt(u * u + v * v + w * w)
        T = 216.65 + 0.001 * (h - 20e3)
        p = 5474.889 * (T / 216.65) ** (-9.80665 / (287.05287 * 0.001))
        mach = speed / np.sqrt(1.4 * 287.05287 * T)
        qS = 0.5 * p / (287.05287 * T) * speed**2 * 334.73
        chord, span = 24.384, 18.288
        alpha, beta = np.arctan(w / u), np.arcsin(v / speed)
        a = np.degrees(1.0) * alpha
        right, left, rudder = (np.degrees(1.0) * angle for angle in controls[:3])
        hat = np.array([P * span, Q * chord, R * span]) / (2.0 * speed)

        def elevons(name, sign):
            return self.part(name, "elevon", a, mach, right) + sign * self.part(
                name, "elevon", a, mach, left
            )

        CL = self.part("CL", "basic", a, mach) + elevons("CL", 1.0)
        CD = self.part("CD", "basic", a, mach) + elevons("CD", 1.0)
        CD += self.part("CD", "rudder", a, mach, rudder)
        Cm = self.part("Cm", "basic", a, mach) + elevons("Cm", 1.0)
        Cm += self.part("Cm", "rudder", a, mach, rudder) + self.part("Cm", "q", a, mach) * hat[1]
        lateral = []
        for name in ("CY", "Cl", "Cn"):
            value = self.part(name, "beta", a, mach) * beta + elevons(name, -1.0)
            value += self.part(name, "rudder", a, mach, rudder)
            if name != "CY":
                value += self.part(name, "p", a, mach) * hat[0]
                value += self.part(name, "r", a, mach) * hat[2]
            lateral.append(value)
        turned = np.array(
            [[np.cos(alpha), 0.0, -np.sin(alpha)], [0, 1, 0], [np.sin(alpha), 0, np.cos(alpha)]]
        )
        aero = turned @ np.array([-qS * CD, qS * lateral[0], -qS * CL])
        X_cg = 1.6210e-10 * mass**2 - 5.5226e-5 * mass + 7.3578
        moment = qS * np.array([span * lateral[1], chord * Cm, span * lateral[2]])
        moment = moment + np.cross(np.array([X_cg, 0.0, 0.0]), aero)
        Ixx = -7.8809e-5 * mass**2 + 25.88576 * mass - 6.9683e5
        Iyy = -8.2890e-4 * mass**2 + 265.9889 * mass - 7.3048e6
        inertia = np.diag([Ixx, Iyy, Iyy])
        omega, velocity = np.array([P, Q, R]), np.array([u, v, w])
        s, c = np.sin, np.cos
        gravity = 9.8 * np.array([-s(theta), c(theta) * s(phi), c(theta) * c(phi)])
        thrust = np.array([controls[3] * 1467900.0, 0.0, 0.0])
        linear = (aero + thrust) / mass + gravity - np.cross(omega, velocity)
        angular = np.linalg.inv(inertia) @ (moment - np.cross(omega, inertia @ omega))
        turn = (Q * s(phi) + R * c(phi)) / c(theta)
        climb = u * s(theta) - (v * s(phi) + w * c(phi)) * c(theta)
        euler = [P + turn * s(theta), Q * c(phi) - R * s(phi), turn]
        return np.array([*linear, *angular, *euler, climb])

    def slopes(self, x, controls, mass):
        """A and B by complex step: exact to rounding, whatever the step."""
        count = len(x)
        at = np.array([*x, *controls], dtype=complex)
        columns = []
        for place in range(len(at)):
            there = at.copy()
            there[place] += 1e-30j
            columns.append(self.rate(there[:count], there[count:], mass).imag / 1e-30)
        return np.array(columns).T[:, :count], np.array(columns).T[:, count:]


@pytest.mark.unit
@pytest.mark.parametrize("where", [(), (27e3, 2200.0, 110e3)])
def test_slopes_are_those_of_a_second_model_by_complex_step(where):
    at = trim_to_linearise(*where)
    model = vehicle_model(at)
    x = [getattr(at.state, name) for name in STATES]
    A, B = SecondModel().slopes(x, [*at.surfaces, at.throttle], at.state.mass)
    size = np.abs(A).max(axis=1, keepdims=True)
    assert np.all(np.abs(model.A - A) <= 2e-5 * size + 1e-12)
    assert np.all(np.abs(model.B - B) <= 2e-5 * np.abs(B).max(axis=1, keepdims=True) + 1e-9)


@pytest.mark.unit
def test_modes_of_the_reports_trim_have_their_names():
    """Eigenvalues as measured once by another program, longitudinal, open loop, 24 km."""
    found = {}
    for mode in modes(vehicle_model(trim_to_linearise())):
        found.setdefault(mode.name, []).append(mode.eigenvalue)
    fast = sorted(value.real for value in found["short period"])
    assert fast == pytest.approx([-1.259, 1.068], abs=5e-4)
    assert found["altitude"] == [pytest.approx(0.0012, abs=5e-5)]
    assert found["phugoid"] == [pytest.approx(-0.001 + 0.040j, abs=1e-4)]
    assert {*found} == {
        *("short period", "phugoid", "altitude", "dutch roll", "roll", "spiral", "heading")
    }


@pytest.mark.unit
def test_participation_adds_up_and_is_independent_of_units():
    model = vehicle_model(trim_to_linearise())
    scale = np.diag([1.0 + 100.0 * place for place in range(len(STATES))])
    scaled = model._replace(A=scale @ model.A @ np.linalg.inv(scale))
    for mode, other in zip(modes(model), modes(scaled), strict=True):
        assert sum(mode.participation.values()) == pytest.approx(1.0)
        assert other.participation == pytest.approx(mode.participation, abs=1e-6)


@pytest.mark.unit
def test_a_vehicle_diverges_faster_with_its_centre_of_gravity_further_aft():
    aft = Truth(further=FurtherDispersion(X_cg=0.3))
    faster = modes(vehicle_model(trim_to_linearise(truth=aft), aft))[0]
    nominal = modes(vehicle_model(trim_to_linearise()))[0]
    assert faster.eigenvalue.real > 1.1 * nominal.eigenvalue.real


def test_a_step_of_the_plant_is_the_exponential_of_the_vehicle():
    """Without hardware, and with servos of first order, that of both together."""
    at = trim_to_linearise()
    vehicle = vehicle_model(at)
    count = len(STATES)
    ideal = without_idle(plant_model(plant_at(at, NOMINAL, None), at))
    both = np.block([[vehicle.A, vehicle.B], [np.zeros((4, count + 4))]])
    step = expm(STEP * both)
    place = [ideal.states.index(name) for name in STATES]
    assert ideal.A[np.ix_(place, place)] == pytest.approx(step[:count, :count], abs=2e-7)
    assert ideal.B[place] == pytest.approx(step[:count, count:], rel=1e-5, abs=1e-6)

    hardware = load_case("nominal_di", hardware="typical").plant.hardware
    equipped = without_idle(plant_model(plant_at(at, NOMINAL, hardware), at))
    servo = np.exp(-30.0 * STEP)
    moved = equipped.states.index("servos.rudder.position")
    assert equipped.A[moved, moved] == pytest.approx(servo, rel=1e-3)
    oldest = equipped.states.index("sent.rudder[2]")  # two steps of delay
    assert equipped.A[moved, oldest] == pytest.approx(1.0 - servo, rel=1e-3)


def test_the_command_tells_writes_and_draws(tmp_path):
    import control

    words = ("linearise", "--hardware", "typical", "--out", tmp_path)
    text = told(*words).stdout
    assert "short period" in text and "servos.rudder.position" in text
    given = json.loads(told(*words, "--json").stdout)
    kept = np.load(tmp_path / "vehicle.npz")
    assert np.array_equal(kept["A"], given["vehicle"]["A"])
    assert (tmp_path / "modes.png").stat().st_size > 5000
    assert [mode["name"] for mode in given["modes"]][:2] == ["short period"] * 2
    system = state_space(vehicle_model(trim_to_linearise()))
    assert isinstance(system, control.StateSpace) and system.output_labels == list(OUTPUTS)
    assert sorted(system.poles().real)[-1] == pytest.approx(1.068, abs=5e-4)


@pytest.mark.parametrize(
    "words, part",
    [
        (("--altitude", "99km"), "altitude 99000 m is outside"),
        (("--altitude", "33km", "--mach", "4"), "alpha above 5 deg"),
        (("--speed", "1800", "--mach", "6"), "--speed and --mach both set the speed"),
        (("--altitude", "high"), "'high' is not a number"),
    ],
)
def test_where_there_is_no_model_one_sentence_says_so(words, part, tmp_path):
    assert_refused(told("linearise", *words), [part], tmp_path)


def test_a_vehicle_without_trim_has_no_model():
    with pytest.raises(ParameterError, match="throttle below"):
        trim_to_linearise(34e3, 2400.0, 60e3)
