# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv replay`."""

import time
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from ahv_analysis.command.console import (
    Json,
    LawChoice,
    UsageError,
    check_domain,
    console,
    number_option,
    print_json,
    progress_bar,
)
from ahv_analysis.command.figures import write_figures
from ahv_analysis.errors import BagError
from ahv_msgs_py.layout import NANOSECONDS

if TYPE_CHECKING:  # these need ROS, which other commands do without
    from ahv_analysis.flight.case import Case
    from ahv_analysis.replay.inputs import Recording
    from ahv_analysis.replay.replay import Replay


def replay(
    bag: Annotated[
        Path, typer.Argument(help="Folder of a bag: of `ahv fly`, or `ros2 bag record`.")
    ],
    node: Annotated[
        list[str] | None,
        typer.Option(help="Controller to replay, instead of all of the case; can be repeated."),
    ] = None,
    parameters: Annotated[
        str | None,
        typer.Option(
            help="Replay with the parameters of this case, instead of those that the bag notes.",
            metavar="FILE",
        ),
    ] = None,
    law: LawChoice = None,
    rate: Annotated[
        float | None,
        number_option("times real time", "Pace, to watch; as fast as possible if not given"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for figures: recorded and replayed commands.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Feed a recorded flight to the controllers again.

    What they command is compared with the record, bit for bit. Ends with exit code 0 if all
    commands are alike, 1 if one differs.
    """
    if rate is not None and not (isfinite(rate) and rate > 0.0):
        raise UsageError(f"--rate is {rate:g}, but must be above 0")
    if out is not None and any(out.glob("figure_*")):
        raise UsageError(f"{out} holds figures already: choose another --out")
    check_domain()
    from ahv_analysis.replay.inputs import read_recording
    from ahv_analysis.replay.replay import replay as replay_flight

    recording = read_recording(bag)
    case = _case(recording, parameters, law)
    names = _names(case, node)
    steps = max((len(series.stamps) for series in recording.topics.values()), default=0)
    started = time.perf_counter()
    with progress_bar(f"replaying {bag}", steps, as_json) as progress:
        flown = replay_flight(recording, case, names, rate=rate, progress=progress)
    wall = time.perf_counter() - started
    figures = _draw(recording, flown, out, as_json) if out is not None else []
    result = _result(recording, case, flown) | {
        "wall_s": wall,
        "figures": [str(path) for path in figures],
    }
    if as_json:
        print_json(result)
    else:
        _show(result, flown, out)
    if result["differences"] or result["missing"]:
        raise typer.Exit(1)


def _case(recording: "Recording", parameters: str | None, law: str | None) -> "Case":
    """Parameters to replay with: of the options, or as the bag notes them.

    A law that the bag names is run only if its source is the one that flew.
    """
    from ahv_analysis.flight.case import load_case, make_case, why_another_law, with_law

    if parameters is not None:
        return load_case(parameters, namespace=recording.namespace, law=law)
    if recording.notes is None:
        raise BagError(
            f"{recording.path} does not say with which parameters it was flown: "
            "name them by --parameters"
        )
    given: Mapping[str, Mapping[str, object]] = recording.notes.parameters
    if law is not None:
        return make_case(recording.notes.case, with_law(given, law))
    why = why_another_law(recording.notes)
    if why:
        raise BagError(f"{recording.path} {why}: name the law to replay by --law")
    return make_case(recording.notes.case, given)


def _names(case: "Case", chosen: list[str] | None) -> list[str]:
    """Controllers to replay, in the order in which they answer a state."""
    valid = case.controllers
    for name in chosen or []:
        if name not in valid:
            raise UsageError(
                f"--node is {name!r}, but the controllers of {case.name} are {', '.join(valid)}"
            )
    return [name for name in valid if not chosen or name in chosen]


def _draw(recording: "Recording", flown: "Replay", out: Path, hidden: bool) -> list[Path]:
    from ahv_analysis.replay.figures import replay_figures

    plates, draw = replay_figures(recording, flown)
    return write_figures(plates, draw, out, hidden)


def _result(recording: "Recording", case: "Case", flown: "Replay") -> dict[str, Any]:
    from ahv_analysis.replay.result import total

    nodes = {
        name: total([entry for entry in flown.comparisons if entry.node == name])
        | {"skipped_steps": skipped}
        for name, skipped in flown.skipped.items()
    }
    return {
        "bag": str(recording.path),
        "case": case.name,
        "from_s": int(flown.steps[0]) / NANOSECONDS,
        "to_s": int(flown.steps[-1]) / NANOSECONDS,
        **total(flown.comparisons),
        "skipped_steps": sum(flown.skipped.values()),
        "refused": recording.refused,
        "parameter_changes": len(recording.changes),
        "nodes": nodes,
    }


def _show(result: dict[str, Any], flown: "Replay", out: Path | None) -> None:
    title = (
        f"{result['bag']}: {result['case']} replayed from {result['from_s']:g} s "
        f"to {result['to_s']:g} s"
    )
    print(title)
    sheet = Table()
    for name in ("node", "command"):
        sheet.add_column(name, no_wrap=True)
    for name in ("compared", "differ", "by at most"):
        sheet.add_column(name, justify="right")
    for entry in flown.comparisons:
        sheet.add_row(
            entry.node,
            entry.topic.rpartition("/")[2],
            str(entry.compared) if entry.in_bag else "-",
            str(entry.differences) if entry.in_bag else "-",
            f"{abs(entry.largest.size):.3g}" if entry.largest else "",
        )
    console.print(sheet)
    for sentence in _sentences(result, flown):
        console.print(sentence, highlight=False, soft_wrap=True)
    if out is not None:
        console.print(f"{len(result['figures'])} files in {out}", highlight=False)


def _sentences(result: dict[str, Any], flown: "Replay") -> list[str]:
    """The verdict, and what else is worth knowing."""
    first, largest = result["first"], result["largest"]
    absent = [entry.topic for entry in flown.comparisons if not entry.in_bag]
    if first is None:
        verdict = [f"All {result['compared']} commands are alike to the last bit."]
    else:
        verdict = [
            f"{result['differences']} of {result['compared']} commands differ, first at "
            f"{first['time_s']:g} s: {first['field']} on {first['topic']} was "
            f"{first['recorded']!r}, and {first['node']} now commands {first['replayed']!r}.",
            f"The largest difference is {largest['difference']:.6g}: {largest['field']} on "
            f"{largest['topic']} at {largest['time_s']:g} s.",
        ]
    skipped = ", ".join(f"{name} {steps}" for name, steps in flown.skipped.items() if steps)
    remarks = [
        (
            absent,
            f"Not in the bag, so that others heard what was replayed: {', '.join(absent)}.",
        ),
        (result["missing"], f"{result['missing']} recorded commands were not given again."),
        (
            result["unrecorded"],
            f"{result['unrecorded']} replayed commands are not in the bag, and were not compared.",
        ),
        (skipped, f"Steps skipped because inputs are missing in the bag: {skipped}."),
        (
            result["refused"],
            f"{result['refused']} messages of the bag were refused, as a receiver refuses them.",
        ),
        (
            result["parameter_changes"],
            f"Changes of parameters in flight, made again: {result['parameter_changes']}.",
        ),
        (
            result["from_s"] > 0.0,
            "The bag does not start at 0 s: inner_loop and disturbance_learner, which remember "
            "the steps before, start afresh and may differ.",
        ),
    ]
    return [*verdict, *(remark for told, remark in remarks if told)]
