# Copyright 2026 ahv developers, Apache-2.0
"""Real time for minutes and lockstep for an hour of flight: `make bench`."""

import argparse
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

from ahv_analysis.bag.reader import load_bag
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.flight.process_per_node import (
    LONGEST_START,
    ProcessGraph,
)
from ahv_analysis.flight.watcher import Watcher
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.topics import STATE
from test.witness import STILL, Stop, machine_watched, stood_still

CASE = "neuro_adaptive_sc_gdi"
LOOK = 0.2  # [s] between looks at the reports
TICK = os.sysconf("SC_CLK_TCK")  # [1/s] of the counters of processor time
PAGE = os.sysconf("SC_PAGE_SIZE")  # [B]


def processor_seconds(pid: int) -> float:
    """Processor time that a process has taken [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def stolen() -> float:
    """Processor time that a hypervisor has given to other machines [s], of all cores."""
    return int(Path("/proc/stat").read_text().split()[8]) / TICK


def resident(pid: int | str = "self") -> float:
    """Memory of a process [MB]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE / 1e6


class Misses:
    """Deadlines that the plant counts as missed, and when it did."""

    def __init__(self, watcher: Watcher):
        """`watcher` hears the plant's reports, one a second."""
        self._watcher = watcher
        self._heard, self._total, self._since = 0, 0, time.monotonic()
        self.seconds: list[tuple[float, float]] = []  # [s] from report to report, with a miss

    def look(self) -> None:
        """Take the reports that have come since the last look."""
        now = time.monotonic()
        for _, name, _, _, facts in self._watcher.statuses[self._heard :]:
            if name == "plant" and facts:
                total = sum(int(facts.get(fault, 0)) for fault in ("late", "tick_missed"))
                if total > self._total:
                    self.seconds.append((self._since, now))
                self._total, self._since = total, now
        self._heard = len(self._watcher.statuses)


def bench_realtime(seconds: int) -> None:
    """State to both commands at 100 Hz, a process per node, recorder on."""
    keep_to_this_machine()
    case = load_case(CASE, {"duration": float(seconds)})
    watcher = Watcher()
    misses = Misses(watcher)
    with machine_watched() as stops, tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "bag"
        with ProcessGraph(case, bag, realtime=True) as graph:
            deadline = time.monotonic() + LONGEST_START
            while watcher.step < 0:
                watcher.look(0.1)
                if time.monotonic() > deadline:
                    sys.exit(f"no flight within {LONGEST_START:g} s")
            before = {n: processor_seconds(p.pid) for n, p in graph.processes.items()}
            started, taken = time.perf_counter(), stolen()
            used = before
            while watcher.over is None and "plant" not in graph.ended():
                watcher.look(LOOK)
                misses.look()
                alive = [n for n, p in graph.processes.items() if p.exitcode is None]
                used = used | {n: processor_seconds(graph.processes[n].pid) for n in alive}
            wall, taken = time.perf_counter() - started, stolen() - taken
            watcher.look(LOOK)  # what the plant said last
            misses.look()
        states = len(load_bag(bag)[STATE.name].messages)
    facts = watcher.over
    watcher.close()
    share = {name: (used[name] - before[name]) / wall for name in used}
    print(f"{CASE}: {seconds} s at 100 Hz, one process per node, recorder on")
    print(
        f"state to both commands, ms    p50 {facts['latency_ms_p50']}  "
        f"p99 {facts['latency_ms_p99']}  max {facts['latency_ms_max']}"
    )
    print(
        f"of {facts['steps']} steps                 {facts.get('late', 0)} commands late, "
        f"{facts.get('tick_missed', 0)} ticks missed; {states} states in the bag"
    )
    parts = ", ".join(f"{name} {100 * part:.1f}" for name, part in share.items())
    print(f"of one core                   {100 * sum(share.values()):.1f} % ({parts})")
    print_machine(misses.seconds, stops, taken)


def print_machine(missed: list[tuple[float, float]], stops: list[Stop], taken: float) -> None:
    """Say what the machine did to a flight: `missed` seconds of it, time `taken` from it [s]."""
    stood = sum(stood_still(stops, start - LOOK, end) for start, end in missed)
    lengths = [1e3 * (end - start) for start, end in stops]
    print(
        f"seconds with a miss           {len(missed)}, in {stood} the machine itself stood still"
    )
    print(
        f"the machine stood still       {len(lengths)} times for more than {STILL * 1e3:g} ms, "
        f"{max(lengths, default=0.0):.1f} ms at most, {sum(lengths):.0f} ms in all of its cores"
    )
    print(
        f"load of the machine           {os.getloadavg()[0]:.2f}; "
        f"{taken:.2f} s of its processors went to other machines\n"
    )


def soak(seconds: int) -> None:
    """An hour of flight in lockstep: memory and pace at every tenth of it."""
    case = load_case(CASE, {"duration": float(seconds)})
    steps = case.plant.steps
    marks: list[tuple[int, float, float]] = []

    def look(step: int) -> None:
        if step >= (len(marks) + 1) * steps // 10:
            marks.append((step, time.perf_counter(), resident()))

    started = time.perf_counter()
    ended_early, wall = fly_graph(case, None, progress=look)
    print(f"{CASE}: {steps} steps in lockstep, one process, {ended_early or 'flown to the end'}")
    print("     steps    steps/s   memory MB")
    last = (0, started)
    for step, now, memory in marks:
        print(f"{step:10} {(step - last[0]) / (now - last[1]):10.0f} {memory:11.1f}")
        last = (step, now)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"{steps / wall:.0f} steps/s in all, peak memory {peak:.0f} MB\n")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--realtime", type=int, default=600, metavar="SECONDS")
    parser.add_argument("--soak", type=int, default=3600, metavar="SECONDS")
    chosen = parser.parse_args()
    if chosen.realtime:
        bench_realtime(chosen.realtime)
    if chosen.soak:
        soak(chosen.soak)


if __name__ == "__main__":
    main()
