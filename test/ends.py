# Copyright 2026 ahv developers, Apache-2.0
"""How flights in real time end while somebody looks on and the cores are busy.

python -m test.ends --flights 200
"""

import argparse
import multiprocessing
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import rclpy

from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.node.quality import quality
from ahv_msgs_py.node.rclpy_internals import EventsExecutor
from ahv_msgs_py.topics import LOOP_TOPICS, VIEWER_TOPICS

LONGEST_FLIGHT = 120.0  # [s] with its start, on a machine that has much else to do
OVER = re.compile(r"\[INFO\] \[(\d+\.\d+)\] \[ahv\.plant\]: flight over")


class End(NamedTuple):
    """How a flight has ended."""

    code: int | None  # that of the command; None if it had to be killed
    seconds: float  # [s] from the end of the flight to the end of the command
    summed_up: bool


def observe() -> None:
    """Listen to every topic until killed."""
    keep_to_this_machine()
    rclpy.init()
    node = rclpy.create_node("observer")
    kinds = [(topic.name, topic.layout.type_name) for topic in LOOP_TOPICS]
    kinds += [(topic.name, topic.type_name) for topic in VIEWER_TOPICS]
    for name, kind in kinds:
        if kind != "tf2_msgs/msg/TFMessage":
            node.create_subscription(
                message_class(kind), name, lambda data: None, quality(False), raw=True
            )
    executor = EventsExecutor()
    executor.add_node(node)
    executor.spin_until_future_complete(rclpy.task.Future(executor=None), 1e6)


def burn() -> None:
    """Keep a core busy until killed."""
    while True:
        pass


@contextmanager
def beside(observers: int, busy: int) -> Iterator[None]:
    """Have observers and processes that burn time."""
    context = multiprocessing.get_context("spawn")
    others = [context.Process(target=task) for task in [observe] * observers + [burn] * busy]
    for one in others:
        one.start()
    try:
        yield
    finally:
        for one in others:
            one.kill()
            one.join()


def fly(out: Path, seconds: float) -> End:
    """Fly by the command, and see it end."""
    command = [Path(sys.executable).parent / "ahv", "fly", "nominal_di", "--realtime"]
    command += ["--processes", "--duration", str(seconds), "--out", out]
    with (out.parent / f"{out.name}.txt").open("w+") as output:
        started = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        try:
            code: int | None = started.wait(LONGEST_FLIGHT)
        except subprocess.TimeoutExpired:
            started.kill()
            code = None
        ended = time.time()
        output.seek(0)
        over = OVER.search(output.read())
    return End(
        code, ended - float(over[1]) if over else float("nan"), (out / "summary.json").is_file()
    )


def main() -> None:
    """Fly many times and print how long the ends took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=200)
    parser.add_argument("--busy", type=int, default=os.cpu_count())
    chosen = parser.parse_args()
    ends = []
    with tempfile.TemporaryDirectory() as folder, beside(1, chosen.busy):
        for number in range(chosen.flights):
            ends.append(fly(Path(folder) / str(number), 3.0))
            print(number + 1, *ends[-1], f"load {os.getloadavg()[0]:.1f}", flush=True)
    lengths = sorted(end.seconds for end in ends)
    well = sum(end.code == 0 and end.summed_up for end in ends)
    print(
        f"{len(ends)} flights, {well} ended well; "
        f"{lengths[len(lengths) // 2]:.2f} s median, {lengths[-1]:.2f} s at most"
    )


if __name__ == "__main__":
    main()
