# Copyright 2026 ahv developers, Apache-2.0
"""Rates of the engines, each beside a reference measured in the same run: `make bench`."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from ahv_analysis.bag.dataset import bag_dataset
from ahv_analysis.bag.reader import read_bag
from ahv_analysis.campaign.batch import fly_alone, fly_batch
from ahv_analysis.campaign.campaign import Campaign, fly_campaign, fly_runs
from ahv_analysis.campaign.table import REPORT
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly, fly_library
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.flight.process_per_node import fly_processes
from ahv_plant.model.constants import STEP
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.numerics.simd import FLOATS, LANES, load, store

ROUNDS = 5
TRIALS = 2048

# Counts the additions, multiplications and divisions of one step of one run, in plain Python.
COUNT = """
import json
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.closed_loop import loop_step, start_loop

counts = {"add": 0, "multiply": 0, "divide": 0}


class Number(float):
    pass


def counting(operation, kind):
    def counted(*numbers):
        counts[kind] += 1
        return Number(operation(*numbers))

    return counted


for name, kind in (("add", "add"), ("sub", "add"), ("mul", "multiply"), ("truediv", "divide")):
    for prefix in ("__", "__r"):
        method = f"{prefix}{name}__"
        setattr(Number, method, counting(getattr(float, method), kind))
Number.__neg__ = lambda number: Number(float.__neg__(number))
Number.__abs__ = lambda number: Number(float.__abs__(number))


def number(value):
    if isinstance(value, float):
        return Number(value)
    return type(value)(*map(number, value)) if isinstance(value, tuple) else value


case = load_case("neuro_adaptive_sc_gdi")
state, truth, control = number(case.plant.initial), number(case.plant.truth), number(case.control)
loop = start_loop(state, truth, control, None, None)
counts.update(dict.fromkeys(counts, 0))
loop_step(loop, 0, truth, control, None, None)
print(json.dumps(counts))
"""


CAMPAIGN = """
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from tempfile import TemporaryDirectory

from ahv_analysis.campaign.campaign import Campaign, fly_campaign, fly_runs
from ahv_analysis.campaign.summary import summarize_campaign
from ahv_analysis.flight.case import load_case

case = load_case("neuro_adaptive_sc_gdi", {"duration": 1.0})
campaign = Campaign(case, 0.3, int(sys.argv[1]), 1)
with TemporaryDirectory() as folder, ThreadPoolExecutor() as pool:
    fly_campaign(campaign, Path(folder), pool)
    fly_campaign(campaign, Path(folder), pool)
    assert summarize_campaign(campaign, Path(folder))["runs"] == campaign.runs
print(getrusage(RUSAGE_SELF).ru_maxrss // 1024)
"""


@intrinsic
def fused(typingctx, a, b, c):
    """Fused multiply-add of lanes, which nothing but this measurement uses."""

    def emit(context, builder, signature, arguments):
        vector = arguments[0].type
        kind = ir.FunctionType(vector, [vector] * 3)
        name = f"llvm.fma.v{LANES}f64"
        function = cgutils.get_or_insert_function(builder.module, kind, name)
        return builder.call(function, arguments)

    return FLOATS(FLOATS, FLOATS, FLOATS), emit


@kernel
def multiply_add(numbers, count, result):
    """Twelve independent chains of fused multiply-adds, enough to hide their latency."""
    a, b, c, d, e, f = load((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), numbers)
    x, y = a, b
    for _ in range(count):
        a, b, c = fused(a, x, y), fused(b, x, y), fused(c, x, y)
        d, e, f = fused(d, x, y), fused(e, x, y), fused(f, x, y)
    store(result, a + b + c + d + e + f)


def timed(work: Callable[[], object]) -> float:
    """Seconds that `work` takes."""
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def median(values: list[float]) -> float:
    """Middle value."""
    return sorted(values)[len(values) // 2]


def plain_python() -> None:
    """Do a fixed piece of plain Python, to tell a slow machine from a slow graph."""
    total = 0
    for number in range(3_000_000):
        total += number & 7


def bench_graph() -> None:
    """One flight at a time: library, graph, recorder."""
    for name in ("nominal_di", "neuro_adaptive_sc_gdi"):
        case = load_case(name)
        steps = case.plant.steps
        for _ in zip(range(2), fly(case), strict=False):
            pass
        walls: dict[str, list[float]] = {}
        with tempfile.TemporaryDirectory() as folder:
            for number in range(ROUNDS):
                for engine, wall in (
                    ("library", timed(lambda: list(fly(case)))),  # noqa: B023
                    ("graph, no recorder", fly_graph(case, None)[1]),
                    ("graph, recorder on", fly_graph(case, Path(folder) / str(number))[1]),
                    ("plain Python reference", timed(plain_python)),
                ):
                    walls.setdefault(engine, []).append(wall)
        reference = median(walls["plain Python reference"])
        print(f"\n{name}: {steps} steps of {STEP} s, median of {ROUNDS}, one process")
        print(f"{'':24}{'wall s':>8}{'steps/s':>10}{'x real time':>13}{'x reference':>13}")
        for engine, measured in walls.items():
            wall = median(measured)
            pace = f"{steps / wall:10.0f}{steps * STEP / wall:13.1f}"
            blank = engine == "plain Python reference"
            print(f"{engine:24}{wall:8.2f}{'' if blank else pace:>23}{wall / reference:13.2f}")
        pairs = zip(walls["graph, no recorder"], walls["graph, recorder on"], strict=True)
        costs = [1.0 - alone / recorded for alone, recorded in pairs]
        print(
            f"recording costs {median(costs):.0%} of the rate without it, median of pairs "
            f"({min(costs):.0%} to {max(costs):.0%})"
        )


def bench_processes() -> None:
    """The graph with a process for each of its five nodes, and a sixth for the recorder."""
    case = load_case("neuro_adaptive_sc_gdi")
    steps = case.plant.steps
    print(f"\n{case.name}: {steps} steps of {STEP} s, median of 3, one process per node")
    with tempfile.TemporaryDirectory() as folder:
        bags = [Path(folder) / str(number) for number in range(3)]
        for engine, chosen in (("no recorder", [None] * 3), ("recorder on", bags)):
            wall = median([fly_processes(case, bag)[1] for bag in chosen])
            print(f"{engine:24}{wall:8.2f}{steps / wall:10.0f}{steps * STEP / wall:13.1f}")


def bench_bags() -> None:
    """Reading the bag of a flight of 150 s."""
    print(f"\nbag of 150 s, read whole: s, median of {ROUNDS}")
    for name in ("nominal_di", "neuro_adaptive_sc_gdi"):
        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder) / "bag"
            fly_library(load_case(name), bag)
            bag_dataset(bag)  # compiles, imports
            arrays = median([timed(lambda: read_bag(bag)) for _ in range(ROUNDS)])  # noqa: B023
            dataset = median([timed(lambda: bag_dataset(bag)) for _ in range(ROUNDS)])  # noqa: B023
            size = next(bag.glob("*.mcap")).stat().st_size / 1e6
            print(f"{name:24}{arrays:8.2f} as arrays{dataset:8.2f} as dataset{size:8.1f} MB")


def bench_lanes() -> None:
    """Many flights at once: run-steps per second and core, against the machine's peak."""
    campaign = Campaign(load_case("neuro_adaptive_sc_gdi"), 0.1, TRIALS, 1)
    case, steps = campaign.case, campaign.case.plant.steps
    counts = json.loads(
        subprocess.run(
            [sys.executable, "-c", COUNT],
            env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
    )
    operations = counts["add"] + counts["multiply"]
    starts = np.array([case.plant.initial] * LANES)
    vehicles = np.array([campaign.dispersion(run) for run in range(LANES)])
    numbers = np.full((6, LANES), 0.5)
    result = np.empty((1, LANES))
    chains = 20_000_000
    fly_batch(starts, vehicles, case.plant.truth, case.control, 2)
    fly_alone(case._replace(plant=case.plant._replace(steps=2)))
    fly_runs(campaign, 0, LANES)
    multiply_add(numbers, 10, result)
    lanes, alone, peaks = [], [], []
    for _ in range(ROUNDS):
        wall = timed(lambda: fly_batch(starts, vehicles, case.plant.truth, case.control, steps))
        lanes.append(wall / steps / LANES)
        wall = timed(lambda: fly_alone(case))
        alone.append(wall / steps)
        peaks.append(6 * LANES * chains / timed(lambda: multiply_add(numbers, chains, result)))
    peak, lane = median(peaks), median(lanes)
    print(f"\nOne core, adaptive SC-GDI: {operations} additions and multiplications,")
    print(f"{counts['divide']} divisions a run-step; medians of {ROUNDS}")
    print(f"{'scalar':24}{median(alone) * 1e6:8.3f} us a run-step")
    print(f"{'lanes':24}{lane * 1e6:8.3f} us a run-step, {median(alone) / lane:.1f} x scalar")
    print(f"{'multiply-add peak':24}{peak / 1e9:8.1f} G/s, measured")
    print(f"{'of peak':24}{operations / lane / peak:8.0%} in additions and multiplications")
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor() as pool:
        wall = timed(lambda: fly_campaign(campaign, Path(folder), pool))
    total = 2 * sum(row.trials for row in REPORT)
    pace = TRIALS * steps / wall
    print(f"\nAll cores: {TRIALS} trials in {wall:.1f} s, {pace:.3g} run-steps/s;")
    print(f"Table 5.1, {total} trials, projected: {total * steps / pace:.0f} s")


def bench_memory() -> None:
    """Peak memory of the process that flies, resumes and sums up a campaign."""
    print("\nMemory of a campaign of flights of 1 s")
    for runs in (2_000, 50_000, 200_000):
        flown = subprocess.run(
            [sys.executable, "-c", CAMPAIGN, str(runs)], capture_output=True, text=True, check=True
        )
        print(f"{runs:7} runs{int(flown.stdout):8} MB at most")


def main() -> None:
    """Measure everything."""
    os.environ.setdefault("ROS_DOMAIN_ID", "99")
    bench_graph()
    bench_processes()
    bench_bags()
    bench_lanes()
    bench_memory()


if __name__ == "__main__":
    main()
