# Copyright 2026 ahv developers, Apache-2.0
"""The commands `ahv bag`: what a bag holds, recovering a damaged one, exporting it."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Annotated, Any

import typer

from ahv_analysis.command.console import (
    Json,
    UsageError,
    print_json,
    show_table,
)
from ahv_analysis.errors import BagError
from ahv_analysis.interrupt import signals_wait, until

bag = typer.Typer(
    help="Look into the bag of a flight, recover it, export it.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
Folder = Annotated[
    Path, typer.Argument(metavar="BAG", help="Folder of a bag or of a flight, or an MCAP file.")
]


@bag.command()
def info(path: Folder, as_json: Json = False) -> None:
    """Say what a bag holds.

    What flew, for how long, and whether all of it is there.
    """
    from ahv_analysis.bag.info import bag_info

    facts = bag_info(path)
    if as_json:
        print_json(facts)
        return
    show_table(str(path), _rows(facts))
    topics = [
        (topic["name"], f"{topic['messages']} x {topic['type']}") for topic in facts["topics"]
    ]
    show_table("topics", topics)


def _rows(facts: dict[str, Any]) -> list[tuple[str, str]]:
    from ahv_analysis.bag.info import refused_words
    from ahv_msgs_py.graph import NODES

    rows = [
        ("case", facts["case"] or "unknown: it has no notes of ahv"),
        ("flown", _span(facts)),
        ("complete", _completeness(facts)),
    ]
    if facts["refused"]:
        rows.append(("refused", refused_words(facts["refused"])))
    for node, counts in facts["faults"].items():
        words = (f"{fault.replace('_', ' ')} {count}" for fault, count in counts.items())
        rows.append(("reported", f"{node}: {', '.join(words)}"))
    if facts["notes"]:
        plant = facts["notes"]["parameters"]["plant"]
        nominal = {parameter.name: parameter.default for parameter in NODES["plant"].parameters}
        dispersed = [
            f"{name.removeprefix('dispersion.')} {value}"
            for name, value in plant.items()
            if name.startswith("dispersion.") and value != nominal.get(name)
        ]
        rows.append(("dispersion", ", ".join(dispersed) or "none"))
    return [*rows, ("size", f"{facts['messages']} messages, {facts['bytes'] / 1e6:.1f} MB")]


def _completeness(facts: dict[str, Any]) -> str:
    answer = "yes" if facts["complete"] else "no"
    if facts["recovered"] is None:
        return answer
    lost = facts["recovered"]["lost_messages"]
    lost_words = "an unknown number of" if lost is None else str(lost)
    return f"{answer}: recovered, {lost_words} messages lost"


@bag.command()
def recover(
    path: Folder,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the recovered bag, which must not exist, by default BAG-recovered."
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write what is readable of a damaged bag to a new one.

    What was lost is said. The damaged bag stays as it is.
    """
    from ahv_analysis.bag.recovery import recover as write_recovered

    target = out or path.with_name(f"{path.name.partition('.mcap')[0]}-recovered")
    with signals_wait() as interrupted:
        recovery = write_recovered(path, target, interrupted)
    facts: dict[str, Any] = {"source": str(path), "recovered": None}
    if recovery is not None:
        flight = _flight(target)
        facts |= {"recovered": str(target), **recovery.as_json(), **flight}
    if as_json:
        print_json(facts)
    elif recovery is None:
        print(f"{path} is whole: nothing to recover")
    else:
        lost = recovery.lost_messages
        rows = [
            ("recovered", f"{recovery.messages} messages, {_span(flight)}"),
            ("lost", "an unknown number of messages" if lost is None else f"{lost} messages"),
        ]
        for loss in recovery.losses:
            place = f" ({loss.size} bytes from byte {loss.offset} on)" if loss.size else ""
            rows.append((loss.file, loss.what + place))
        show_table(f"{path} -> {target}", rows)


def _flight(path: Path) -> dict[str, Any]:
    """How much of a flight a recovered bag holds; nothing known if a topic is lost altogether."""
    from ahv_analysis.bag.info import bag_info

    keys = ("duration_s", "planned_s", "steps", "missing_steps")
    try:
        facts = bag_info(path)
    except BagError:
        return dict.fromkeys(keys)
    return {key: facts[key] for key in keys}


def _span(facts: dict[str, Any]) -> str:
    """How long was flown, in words."""
    if facts["duration_s"] is None:
        return "no step of a flight with all its messages"
    planned = f" of {facts['planned_s']:g} s" if facts["planned_s"] else ""
    missing = f", {facts['missing_steps']} are missing" if facts["missing_steps"] else ""
    return f"{facts['duration_s']:g} s{planned}, {facts['steps']} steps{missing}"


@bag.command()
def export(
    path: Folder,
    csv: Annotated[Path | None, typer.Option(help="CSV file to write.")] = None,
    parquet: Annotated[Path | None, typer.Option(help="Parquet file to write.")] = None,
    netcdf: Annotated[Path | None, typer.Option(help="netCDF file to write.")] = None,
    as_json: Json = False,
) -> None:
    """Write the flight of a bag as a table.

    Its columns are time, states, commands, learner and air data. A file that exists is never
    overwritten.
    """
    files = {
        kind: file
        for kind, file in zip(("csv", "parquet", "netcdf"), (csv, parquet, netcdf), strict=True)
        if file
    }
    if not files:
        raise UsageError("nothing to export to: name a file with --csv, --parquet or --netcdf")
    for file in files.values():
        if file.exists():
            raise UsageError(f"{file} exists already: choose another file")
    from ahv_analysis.bag.dataset import EXPORTS, bag_parts
    from ahv_analysis.bag.reader import flight_of, read

    held = read(path)
    samples, signals = len(flight_of(held).stamps), len(next(bag_parts(held)).data_vars)
    for kind, file in files.items():
        try:
            with signals_wait() as interrupted, _new_file(file) as sink:
                EXPORTS[kind](until(interrupted, bag_parts(held)), sink)
        except OSError as error:
            raise UsageError(f"cannot write {file}: {error.strerror}") from error
    if as_json:
        facts = {"signals": signals, "samples": samples}
        print_json({"bag": str(path), "files": {k: str(f) for k, f in files.items()}, **facts})
    else:
        for file in files.values():
            print(f"{samples} samples of {signals} signals in {file}")


@contextmanager
def _new_file(file: Path) -> Iterator[IO[bytes]]:
    """Write a file that does not exist: it is there once all of it is, or not at all."""
    draft = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        with draft.open("xb") as sink:
            yield sink
        file.open("xb").close()  # nothing is written over
        draft.replace(file)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
