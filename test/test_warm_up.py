# Copyright 2026 ahv developers, Apache-2.0
"""No step of a flight waits for the compiler: what nodes call is compiled before."""

import subprocess
import sys

FLIGHTS = """
import gc
from numba.core.dispatcher import Dispatcher
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_msgs_py.node.warm_up import warm_up_nodes

cases = [load_case(name, {"duration": 0.05}) for name in ("nominal_di", "neuro_adaptive_sc_gdi")]
cases.append(load_case("neuro_adaptive_di", {"duration": 0.05, "disturbance.Q.constant": 1.0}))

def compiled():
    found = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {one.py_func.__qualname__: len(one.overloads) for one in found}

warm_up_nodes()
before = compiled()
for case in cases:
    fly_graph(case, None)
after = compiled()
assert before["vehicle_step"] == 2, "with and without a disturbance"
print(*(name for name in after if after[name] > before.get(name, 0)))
"""


def test_a_flight_after_the_warm_up_compiles_nothing():
    done = subprocess.run([sys.executable, "-c", FLIGHTS], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()) == (0, []), done.stderr
