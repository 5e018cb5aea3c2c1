# Copyright 2026 ahv developers, Apache-2.0
"""Kill recorders with kill -9 in mid-flight, see what is left: `python -m test.kill_recorder`.

The flight is on the graph of this process in lockstep, every recorder in a process of its own. A
bag is read twice: as it was left, by the stream reader of the `mcap` package alone, and recovered.

What counts for the recorder is the newest message in the bag: it may lose no more than `BOUND`. A
step is whole with its last message, and that the middleware may have to send again; on a machine
with more to do than it can, DDS takes up to seconds for that.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from ahv_analysis.bag.recovery import recover
from ahv_analysis.flight import one_process
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import fly_graph
from ahv_msgs_py.topics import NOMINAL_TOPICS
from ahv_plant import plant_node
from ahv_plant.model.constants import STEP_NS
from ahv_plant.plant_node import PlantNode

BOUND = 0.2  # [s] of wall time that a killed recorder may lose
LOOK = 0.002  # [s] between looks at the plant
LONGEST_START = 240.0  # [s] of all recorders, on a machine that has much else to do


class Kill(NamedTuple):
    """What a recorder that was killed has left."""

    bag: Path
    step: int  # of the plant when the recorder was killed
    left: int  # last step with all its messages in the bag as it was left, or -1
    newest: int  # last step with a message in the bag
    lost: float  # [s] of wall time since the plant was at the newest step
    unwhole: float  # [s] of wall time since the plant was at the last whole step
    recovered: Path


class _Enough(Exception):
    """All recorders are dead: the flight need not go on."""


RECORDER = [sys.executable, "-c", "from ahv_analysis.bag.recorder_node import main; main()"]


def kill_recorders(folder: Path, moments: Sequence[float], domain: int) -> list[Kill]:
    """Fly with one recorder per moment [s], each killed so long after the first step."""
    environment = os.environ | {"ROS_DOMAIN_ID": str(domain)}
    bags = [folder / f"bag{number}" for number in range(len(moments))]
    recorders = [
        subprocess.Popen([*RECORDER, "--ros-args", "-p", f"bag:={bag}"], env=environment)
        for bag in bags
    ]
    plants: list[PlantNode] = []

    class Plant(PlantNode):
        """Waits for the recorders too."""

        def __init__(self, values, context):
            super().__init__(values | {"listeners": values["listeners"] + len(bags)}, context)
            plants.append(self)

    steps_at: list[tuple[float, int]] = []  # time [s], step of the plant
    steps_of_death: dict[Path, tuple[float, int]] = {}

    begun: set[Path] = set()  # bags with a whole step

    def watch() -> None:
        while not plants or getattr(plants[0], "step", 0) < 1:
            time.sleep(LOOK)
        started = time.monotonic()
        waiting = dict(zip(bags, zip(moments, recorders, strict=True), strict=True))
        while waiting:
            now = time.monotonic()
            steps_at.append((now, plants[0].step))
            for bag, (moment, recorder) in list(waiting.items()):
                file = bag / f"{bag.name}.mcap"
                if bag not in begun:  # not before the bag has a step, however slow the machine
                    if _last_steps(file)[0] >= 0:
                        begun.add(bag)
                elif now - started >= moment:
                    died = time.monotonic()
                    recorder.kill()
                    recorder.wait()
                    steps_of_death[bag] = (died, plants[0].step)  # it has none of a later step
                    del waiting[bag]
            time.sleep(LOOK)

    def progress(steps: int) -> None:
        if len(steps_of_death) == len(bags):
            raise _Enough

    watcher = threading.Thread(target=watch, daemon=True)  # a flight that fails ends it too
    watcher.start()
    try:
        with (
            suppress(_Enough),
            patch.object(one_process, "PlantNode", Plant),
            patch.object(plant_node, "LONGEST_WAIT", 0.0),  # the dead acknowledge nothing
            patch.object(one_process, "LONGEST_SILENCE", LONGEST_START),
        ):
            fly_graph(load_case("nominal_di"), None, domain=domain, progress=progress)
    finally:
        for recorder in recorders:
            recorder.kill()
            recorder.wait()
    watcher.join()
    kills = []
    for bag in bags:
        died, step = steps_of_death[bag]
        recovered = bag.with_name(f"{bag.name}-recovered")
        left, newest = _last_steps(bag / f"{bag.name}.mcap")
        unwhole, lost = (died - _time_of(last, steps_at) for last in (left, newest))
        recover(bag, recovered)
        kills.append(Kill(bag, step, left, newest, max(lost, 0.0), max(unwhole, 0.0), recovered))
    return kills


def _time_of(step: int, steps_at: Sequence[tuple[float, int]]) -> float:
    """When the plant was last seen at a step, or before it."""
    return max((when for when, known in steps_at if known <= step), default=steps_at[0][0])


def _last_steps(file: Path) -> tuple[int, int]:
    """Last step of which all, and of which any messages are in the whole chunks of a file."""
    topics: dict[int, str] = {}
    steps: dict[str, list[int]] = {topic.name: [] for topic in NOMINAL_TOPICS}
    with file.open("rb") as stream:
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message) and topics[record.channel_id] in steps:
                    steps[topics[record.channel_id]].append(record.log_time // STEP_NS)
        except (McapError, ValueError, OverflowError):
            pass  # the end of what is whole
    lasts = []
    for found in steps.values():
        places = [place for place, step in enumerate(found) if place != step]
        assert not places, (len(found), found[max(0, places[0] - 3) : places[0] + 5])
        lasts.append(len(found) - 1)
    return min(lasts), max(lasts)


def main() -> None:
    """Kill as many recorders as asked for, one a flight; exit code 1 if one lost too much."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--latest", type=float, default=5.0, help="latest moment of a kill [s]")
    options = parser.parse_args()
    draw = random.Random(options.seed)
    domain = int(os.environ.get("ROS_DOMAIN_ID", "99"))
    losses = []
    print("killed at     plant    newest  lost         whole  lost")
    for _ in range(options.kills):
        moment = draw.uniform(0.3, options.latest)
        with tempfile.TemporaryDirectory() as folder:
            (kill,) = kill_recorders(Path(folder), [moment], domain)
        losses.append(kill.lost)
        newest = f"{kill.newest:8}{kill.lost:8.3f} s"
        whole = f"{kill.left:8}{kill.unwhole:8.3f} s"
        print(f"{moment:7.3f} s{kill.step:8}{newest}{whole}", flush=True)
    within = sum(lost <= BOUND for lost in losses)
    print(f"{within} of {options.kills} within {BOUND} s, largest loss {max(losses):.3f} s")
    sys.exit(0 if within == options.kills else 1)


if __name__ == "__main__":
    main()
