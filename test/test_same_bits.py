# Copyright 2026 ahv developers, Apache-2.0
"""Plain Python floats and compiled code give the same bits, by function and over a flight."""

import os
import subprocess
import sys

PROGRAM = """
import hashlib
import math
import random

from ahv_analysis.flight.case import load_case, make_case
from ahv_analysis.flight.library import fly
from ahv_control.newton_raphson import angular_response, flight_condition, solve_surfaces
from ahv_plant.model.vectors import Rates
from ahv_plant.model import aerodynamic_fits
from ahv_plant.numerics import elementary
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.dispersion import (
    AxisDisturbance, Disturbance, FurtherDispersion, Truth, draw_dispersion
)
from ahv_plant.hardware.wind import (
    CALM, Gust, SteadyWind, Wind, turbulence_of, turbulence_step
)
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.vehicle import state_rate, vehicle_step


def flat(value):
    if isinstance(value, tuple):
        return [number for part in value for number in flat(part)]
    return [float(value).hex()]


def show(name, values):
    print(name, hashlib.sha256(" ".join(flat(values)).encode()).hexdigest())


draw = random.Random(1)
names = [name for name in dir(aerodynamic_fits) if name[:3] in
         ("CL_", "CD_", "CY_", "Cl_", "Cm_", "Cn_")]
assert len(names) == 22
for name in names:
    count = 3 if name.endswith(("elevon", "rudder")) else 2
    ranges = ((-6.0, 10.0), (4.0, 20.0), (-40.0, 30.0))[:count]
    show(name, tuple(
        getattr(aerodynamic_fits, name)(*(draw.uniform(*limits) for limits in ranges))
        for _ in range(300)
    ))
for name, low, high in (("sin_cos", -50, 50), ("atan", -30, 30), ("asin", -1.2, 1.2),
                        ("log_near_one", 0.7, 1.4), ("exp_small", -9, 9)):
    function = getattr(elementary, name)
    show(name, tuple(function(draw.uniform(low, high)) for _ in range(3000)))
pairs = [(draw.uniform(-3, 3), draw.uniform(-3, 3)) for _ in range(3000)]
show("atan2", tuple(elementary.atan2(y, x) for y, x in pairs))
for geometric in (False, True):
    show("atmosphere", tuple(atmosphere(draw.uniform(-1e3, 5e4), geometric) for _ in range(3000)))
axis = AxisDisturbance(*(draw.uniform(-0.5, 0.5) for _ in AxisDisturbance._fields))
for run in range(100):
    truth = Truth(run % 2 == 1, draw_dispersion(0.4, 3, run), Disturbance(axis, axis, axis))
    state = State(*(draw.uniform(low, high) for low, high in (
        (1300, 4000), (-80, 80), (-100, 250), (-.2, .2), (-.2, .2), (-.2, .2), (-1, 1), (-.5, .5),
        (-3, 3), (-1e5, 1e5), (-1e5, 1e5), (15000, 40000), (80000, 140000))))
    surfaces = Surfaces(*(draw.uniform(-0.6, 0.5) for _ in range(3)))
    demand = Rates(*(draw.uniform(-0.5, 0.5) for _ in range(3)))
    show("rate", state_rate(state, surfaces, 0.3, 5.0, truth))
    show("step", vehicle_step(state, surfaces, 0.3, 5.0, truth))
    further = FurtherDispersion(*(draw.uniform(0.7, 1.3) for _ in FurtherDispersion._fields))
    turbulence = turbulence_of(draw.uniform(0.0, 9.0), draw.uniform(1200.0, 5000.0))
    air = CALM
    for _ in range(3):
        air = turbulence_step(air, tuple(draw.gauss(0.0, 1.0) for _ in "uvw"), turbulence)
    wind = Wind(
        SteadyWind(draw.uniform(-90, 90), draw.uniform(-90, 90), 24000.0, 0.01, -0.02),
        Gust(3.0, 5.0, draw.uniform(-20, 20), 4.5, draw.uniform(0.4, 2.0)),
    )
    open_world = truth._replace(further=further, wind=wind)
    show("open world", vehicle_step(state, surfaces, 0.3, 5.0, open_world, air))
    show("jacobian", angular_response(flight_condition(state, False), surfaces))
    show("power", elementary.power(draw.uniform(0.08, 1.0), draw.uniform(-2.0, 2.0)))
    show("solver", solve_surfaces(state, demand, surfaces, False))
for case in {cases!r}:
    for step in fly(load_case(case, {"duration": 2.0})):
        show(case, (step.state, step.commands, step.learner or ()))
given = load_case("neuro_adaptive_di", {"duration": 1.0}, hardware="typical").parameters
learner = given["disturbance_learner"] | {"observer_surfaces": "modelled"}
for step in fly(make_case("hedging", given | {"disturbance_learner": learner})):
    show("hedging", (step.state, step.commands, step.learner))
"""


def run(cases, **environment):
    """Lines that the program prints under these environment variables."""
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM.replace("{cases!r}", repr(cases))],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return result.stdout.splitlines()


def test_plain_floats_and_compiled_code_agree_in_every_bit():
    cases = ["nominal_di", "neuro_adaptive_di", "neuro_adaptive_sc_gdi_protected"]
    compiled = run(cases, NUMBA_DISABLE_JIT="0")
    plain = run(cases, NUMBA_DISABLE_JIT="1")
    assert len(compiled) == 22 + 6 + 2 + 600 + 201 * len(cases) + 101
    assert compiled == plain
