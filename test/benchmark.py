"""Rates of the engines, as ratios to work measured in the same run: `make bench`."""

import os
import tempfile
import time
from pathlib import Path

from ahv_analysis.case import load_case
from ahv_analysis.flight import fly
from ahv_analysis.graph_flight import fly_graph
from ahv_plant.constants import STEP

ROUNDS = 3


def spin_reference() -> float:
    """Seconds of a fixed piece of plain Python, to tell a slow machine from a slow graph."""
    started = time.perf_counter()
    total = 0
    for number in range(3_000_000):
        total += number & 7
    return time.perf_counter() - started


def main() -> None:
    """Fly the nominal case by every engine, in turn, and print the medians."""
    os.environ.setdefault("ROS_DOMAIN_ID", "99")
    case = load_case("nominal_di")
    steps = case.plant.steps
    for _ in zip(range(2), fly(case), strict=False):
        pass
    walls: dict[str, list[float]] = {
        "library": [],
        "graph, no recorder": [],
        "graph, recorder on": [],
        "plain Python reference": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        for number in range(ROUNDS):
            started = time.perf_counter()
            for _ in fly(case):
                pass
            walls["library"].append(time.perf_counter() - started)
            walls["graph, no recorder"].append(fly_graph(case, None)[1])
            walls["graph, recorder on"].append(fly_graph(case, Path(folder) / str(number))[1])
            walls["plain Python reference"].append(spin_reference())
    reference = sorted(walls["plain Python reference"])[ROUNDS // 2]
    print(f"{steps} steps of {STEP} s, median of {ROUNDS}, all nodes in one process")
    print(f"{'':24}{'wall s':>8}{'steps/s':>10}{'x real time':>13}{'x reference':>13}")
    for name, measured in walls.items():
        wall = sorted(measured)[ROUNDS // 2]
        if name == "plain Python reference":
            print(f"{name:24}{wall:8.2f}{'':>10}{'':>13}{1:13.2f}")
        else:
            pace = steps * STEP / wall
            print(f"{name:24}{wall:8.2f}{steps / wall:10.0f}{pace:13.1f}{wall / reference:13.2f}")


if __name__ == "__main__":
    main()
