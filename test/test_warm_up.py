# Copyright 2026 ahv developers, Apache-2.0
"""No step of a flight waits for the compiler: what nodes call is compiled before."""

import subprocess
import sys

FLIGHTS = """
import gc
from numba.core.dispatcher import Dispatcher
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_plant.plant_node import PlantNode

cases = [load_case(name, {"duration": 0.05}) for name in ("nominal_di", "neuro_adaptive_sc_gdi")]
for more in ({"disturbance.Q.constant": 1.0}, {"sensor.Q.noise": 0.1, "latency.jitter": 0.5}):
    cases.append(load_case("neuro_adaptive_di", {"duration": 0.05} | more))

def compiled():
    found = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {one.py_func.__qualname__: len(one.overloads) for one in found}

def start(node):  # the last of the nodes, all of them configured
    global before
    before = compiled()
    opened(node)

opened, PlantNode.start = PlantNode.start, start
for case in cases:
    fly_graph(case, None)
    after = compiled()
    assert before["_ideal_step"] or before["_step"], "the plant is compiled before"
    print(*(name for name in after if after[name] > before.get(name, 0)))
"""


def test_a_flight_compiles_nothing_once_its_nodes_are_configured():
    done = subprocess.run([sys.executable, "-c", FLIGHTS], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()) == (0, []), done.stderr
