# Copyright 2026 ahv developers, Apache-2.0
"""The commands `ahv faults` and `ahv faults run`."""

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from ahv_analysis.command.console import (
    Json,
    Reported,
    UsageError,
    check_domain,
    console,
    integer_option,
    print_json,
    progress_bar,
)
from ahv_analysis.interrupt import interrupted_says, last_of_all
from ahv_msgs_py.node.faults import fault_rows

COLUMNS = ("fault", "noticed by", "detection", "response", "latency")
faults = typer.Typer(
    help="What can go wrong in flight, and how it is noticed.",
    invoke_without_command=True,
    rich_markup_mode=None,
)


@faults.callback()
def show(context: typer.Context, as_json: Json = False) -> None:
    """List every fault, how it is noticed, and what happens then."""
    if context.invoked_subcommand is not None:
        return
    rows = fault_rows()
    if as_json:
        print_json({"faults": [dict(zip(COLUMNS, row, strict=True)) for row in rows]})
        return
    # the names one below the other, and columns so wide that 80 characters cut no word of any
    shown = [(f"{fault}\n{by}", *words) for fault, by, *words in rows]
    sheet = Table(show_lines=True)
    for heads, cells in zip((COLUMNS[:2], *COLUMNS[2:]), zip(*shown, strict=True), strict=True):
        head = "\n".join(heads) if isinstance(heads, tuple) else heads
        sheet.add_column(head, min_width=max(map(len, " ".join((head, *cells)).split())))
    for row in shown:
        sheet.add_row(*row)
    console.print(sheet)


@faults.command()
def run(
    injections: Annotated[int, integer_option("Faults to inject.", 1)] = 200,
    seed: Annotated[int, integer_option("Seed of what is injected when.")] = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder for bags and faults.json, which must not exist.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Inject faults into flights at random times.

    The flights are adaptive and in real time, with one process per node. Nodes are killed and
    stopped, messages spoilt in every way, and others talk in between. Passed if everything was
    noticed, who was let go was heard again in time, no other node ended, alpha stayed within
    5 deg, and the bags are complete. Takes about 1.5 s an injection.
    """
    check_domain()
    from ahv_analysis.faults.campaign import run_campaign

    folder = out or Path("flights") / f"faults-{time.strftime('%Y%m%d-%H%M%S')}"
    if folder.exists():
        raise UsageError(f"{folder} exists already: choose another --out")
    with progress_bar("injecting", injections, as_json, unit="faults") as progress:
        reported = Reported(progress)
        interrupted_says(
            lambda: f"after {max(reported.last, 0)} of {injections} faults; bags are in {folder}"
        )
        report = run_campaign(injections, seed, folder, reported, leave=last_of_all)
    if as_json:
        print_json(report)
    else:
        _print_report(report, folder)
    if not report["passed"]:
        raise typer.Exit(1)


def _print_report(report: dict[str, Any], folder: Path) -> None:
    sheet = Table(
        "injected", "times", "noticed", "latest notice s", "heard again s", "largest |alpha| deg"
    )
    for kind, found in report["kinds"].items():
        times = found["latency_s_max"], found["silence_s_max"]
        sheet.add_row(
            kind,
            str(found["injected"]),
            str(found["noticed"]),
            *("-" if seconds is None else f"{seconds:.2f}" for seconds in times),
            f"{found['max_abs_alpha_deg']:.2f}",
        )
    console.print(sheet)
    verdict = "passed" if report["passed"] else "FAILED"
    print(
        f"{verdict}: {report['injections']} faults in {len(report['flights'])} flights, "
        f"largest |alpha| {report['max_abs_alpha_deg']:.2f} deg; all of it in {folder}/faults.json"
    )
