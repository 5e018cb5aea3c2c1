# Copyright 2026 ahv developers, Apache-2.0
"""A flight in real time goes by the steady clock, whatever is done to the system's."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from test.waiting import PATIENCE

LIBRARY = "usr/lib/*/faketime/libfaketimeMT.so.1"  # where Debian has it
# Sets the clock after one second of flight, and sees the flight flown to its end.
FLIGHT = """
import os, sys, time
from pathlib import Path
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph

file, offset = Path(sys.argv[1]), sys.argv[2]
before = time.time() - time.monotonic()

def progress(steps):
    if steps >= 100:
        file.write_text(offset)

case = load_case("nominal_di", {"duration": 4.0})
ended_early, _ = fly_graph(
    case, None, domain=int(sys.argv[3]), realtime=True, progress=progress, leave=lambda work: None
)
assert ended_early == ""
print(round(time.time() - time.monotonic() - before), flush=True)
os._exit(0)  # the graph is not left: the middleware does not end well beneath libfaketime
"""


@pytest.fixture
def library():
    """What takes the clock of the system from a program."""
    found = next(Path("/").glob(LIBRARY), None)
    if found is None:
        stop = pytest.fail if os.environ.get("CI") == "true" else pytest.skip
        stop("there is no libfaketime (Debian: apt-get install faketime)")
    return found


@pytest.mark.parametrize("hours", [-1, pytest.param(1, marks=pytest.mark.slow)])
def test_a_clock_that_is_set_in_flight_moves_no_step(hours, library, tmp_path, domain):
    file = tmp_path / "offset"
    file.write_text("+0")
    environment = os.environ | {
        "LD_PRELOAD": str(library),
        "FAKETIME_TIMESTAMP_FILE": str(file),
        "FAKETIME_CACHE_DURATION": "1",  # [s] between its looks at the file
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    }
    program = [sys.executable, "-c", FLIGHT, str(file), f"{3600 * hours:+d}", str(domain)]
    flown = subprocess.run(
        program, env=environment, capture_output=True, text=True, timeout=PATIENCE
    )
    assert flown.returncode == 0, flown.stderr
    assert int(flown.stdout.split()[-1]) == 3600 * hours  # it was set
