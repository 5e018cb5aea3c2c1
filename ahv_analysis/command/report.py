# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv report`: flights as HTML pages."""

from pathlib import Path
from typing import Annotated

import typer

from ahv_analysis.command.console import Json, UsageError, print_json, progress_bar
from ahv_analysis.interrupt import signals_wait


def report(
    bags: Annotated[list[Path], typer.Argument(help="Folders of bags.", metavar="BAG")],
    out: Annotated[Path, typer.Option(help="Folder for the pages.")],
    as_json: Json = False,
) -> None:
    """Write flights as HTML pages.

    A page for each flight, and one that overlays them if there are several. Each page is one file
    that needs nothing else, not even a network: what flew, the verdict, metrics, interactive
    plots of every step with linked time axes, and the report's figures.
    """
    from ahv_analysis.report.page import draw_figures, render
    from ahv_analysis.report.page_flight import COMPARISON, read_flights

    flights = read_flights(bags)
    names = [flight.name for flight in flights]
    if len(flights) > 1:
        names.append(COMPARISON)
    files = [out / f"{name}.html" for name in names]
    for file in files:
        if file.exists():
            raise UsageError(f"{file} exists already: choose another --out")
    try:
        out.mkdir(parents=True, exist_ok=True)
        with progress_bar("writing", len(files), as_json, unit="pages") as progress:
            for done, file in enumerate(files, 1):
                if file.stem == COMPARISON:
                    page = render(flights)
                else:
                    flight = flights[done - 1]
                    page = render([flight], draw_figures(flight))
                with signals_wait():
                    file.write_text(page, encoding="utf-8", errors="backslashreplace")
                progress(done)
    except OSError as error:
        raise UsageError(f"cannot write pages to {out}: {error.strerror or error}") from error
    if as_json:
        print_json(
            {
                "pages": [str(file) for file in files],
                "flights": [
                    {
                        "name": flight.name,
                        "bag": str(flight.bag),
                        "verdict": flight.verdict.word,
                        "reason": flight.verdict.reason,
                        "metrics": flight.metrics,
                    }
                    for flight in flights
                ],
            }
        )
        return
    for flight, file in zip(flights, files, strict=False):
        print(f"{file}: {flight.verdict.word}, {flight.verdict.reason}")
    if len(flights) > 1:
        print(f"{files[-1]}: all of them overlaid")
