# Copyright 2026 ahv developers, Apache-2.0
"""Faults that decide how a flight ends: each one in an `ahv fly` of its own, judged by its end."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ahv_analysis.flight.watcher import Watcher
from ahv_msgs_py.config import config_folder
from ahv_msgs_py.graph import NODES
from ahv_plant.model.constants import STEP

CASE = "neuro_adaptive_sc_gdi"
DURATION = 6.0  # [s] of each flight
LONGEST_FLIGHT = 120.0  # [s] that one may take, its start and end included
FAKETIME = "usr/lib/*/faketime/libfaketimeMT.so.1"  # where Debian has what sets a program's clock
TWIN = "inner_loop"  # the node that is started twice
LOOK = 0.05  # [s]
LEAD = 1.0  # [s] of flight before the fault


class Fault(NamedTuple):
    """A fault, and what the command that flies must make of it."""

    kind: str
    target: str
    beside: Callable[[Path], Any]  # context in which the command runs; gives its environment
    act: Callable[[Path], None]  # what is done in flight, to the folder of the flight
    exit_code: int
    says: str  # part of the reason that it gives; empty for a success


@contextmanager
def _nothing(folder: Path) -> Iterator[dict[str, str]]:
    yield {}


@contextmanager
def _settable_clock(folder: Path) -> Iterator[dict[str, str]]:
    """Environment of a program whose system clock is set by a file."""
    library = next(Path("/").glob(FAKETIME))
    (folder.parent / f"{folder.name}-clock").write_text("+0")
    yield {
        "LD_PRELOAD": str(library),
        "FAKETIME_TIMESTAMP_FILE": str(folder.parent / f"{folder.name}-clock"),
        "FAKETIME_CACHE_DURATION": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    }


@contextmanager
def _twin(folder: Path) -> Iterator[dict[str, str]]:
    """A second node of a kind, started before the flight."""
    node = NODES[TWIN]
    parameters = config_folder() / "cases" / f"{CASE}.yaml"
    code = f"from {node.module} import main; main()"
    options = ["--ros-args", "--params-file", str(parameters), "-p", "realtime:=true"]
    twin = subprocess.Popen(
        [sys.executable, "-c", code, *options], stderr=subprocess.PIPE, text=True
    )
    assert twin.stderr is not None
    try:
        next(line for line in twin.stderr if line.endswith("active\n"))  # before the flight is
        yield {}
    finally:
        twin.terminate()
        twin.communicate()


def _set_clock(hours: float) -> Callable[[Path], None]:
    def act(folder: Path) -> None:
        (folder.parent / f"{folder.name}-clock").write_text(f"{3600 * hours:+.0f}")
        time.sleep(LEAD)  # until the program looks at it

    return act


def _leave_alone(folder: Path) -> None:
    pass


def whole_flight_faults(pretend: Callable[[], None]) -> list[Fault]:
    """Return all that can be injected here; `pretend()` says falsely that the flight is over."""
    faults = [
        Fault("twin from the start", TWIN, _twin, _leave_alone, 1, "refused to fly"),
        Fault("foreign end", "flight", _nothing, lambda folder: pretend(), 0, ""),
        Fault(
            "folder lost",
            "recorder",
            _nothing,
            lambda folder: shutil.rmtree(folder / "bag"),
            1,
            "recorder ended in flight",
        ),
    ]
    if any(Path("/").glob(FAKETIME)):
        for hours in (-1.0, 1.0):
            way = "back" if hours < 0 else "on"
            step = _set_clock(hours)
            faults.append(Fault(f"clock set {way}", "all", _settable_clock, step, 0, ""))
    return faults


class End(NamedTuple):
    """What became of a flight with a fault."""

    words: str  # how it ended, as it should; empty if it did not
    max_abs_alpha: float  # [deg]


def fly_with(fault: Fault, folder: Path, watcher: Watcher) -> End:
    """Fly with a fault, while somebody listens who is no part of the graph."""
    command = [sys.executable, "-m", "ahv_analysis.command.main", "fly", CASE, "--json"]
    command += ["--realtime", "--processes", "--duration", str(DURATION), "--out", str(folder)]
    with fault.beside(folder) as environment:
        program = subprocess.Popen(
            command, env=os.environ | environment, stdout=subprocess.PIPE, text=True
        )
        deadline = time.monotonic() + LONGEST_FLIGHT
        acted, began = False, 0.0
        try:
            while program.poll() is None and time.monotonic() < deadline:
                watcher.look(LOOK)
                if 0 <= watcher.step * STEP < LEAD and not began:  # not of the flight before
                    began = time.monotonic()
                if began and not acted and time.monotonic() - began > LEAD:
                    fault.act(folder)
                    acted = True
        finally:
            if program.poll() is None:
                program.kill()
        said, _ = program.communicate()
    folder.with_suffix(".json").write_text(said)  # beside its folder, which may be lost
    answer = json.loads(said or "{}")
    alpha = answer.get("max_abs_alpha_deg", 0.0)
    words = answer.get("error", "")
    right = program.returncode == fault.exit_code and fault.says in words
    if fault.exit_code == 0:
        right = right and acted and answer.get("success", False)
        words = "flown to its end, and all of it recorded"
    return End(words if right else "", alpha)
