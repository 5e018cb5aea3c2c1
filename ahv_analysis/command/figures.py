# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv figures`."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ahv_analysis.command.console import (
    Json,
    UsageError,
    integer_option,
    print_json,
    progress_bar,
)

if TYPE_CHECKING:  # these take long to load
    from matplotlib.figure import Figure

    from ahv_analysis.report.figures import Plate


def figures(
    source: Annotated[Path, typer.Argument(help="Folder of a bag, or of a campaign.")],
    out: Annotated[Path, typer.Option(help="Folder for the figures.")],
    runs: Annotated[int, integer_option("Runs of a campaign to draw.", 1)] = 100,
    level: Annotated[
        float | None, typer.Option(help="Level of a campaign, if there are several.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Draw the report's figures of a flight or a campaign.

    As PNG and SVG: 3.2-3.7 of a nominal flight; 4.1-4.5 or 5.1-5.5 of an adaptive one, beside the
    nominal law; 3.8-3.13, 4.6-4.10 or 5.6-5.10 of a campaign. Of a flight on hardware H.1 and
    H.2 as well: surfaces, rates and attitude as measured.
    """
    from ahv_analysis.campaign.campaign import first_causes, open_campaign
    from ahv_analysis.report.page_figures import bag_figures, campaign_figures

    if any(source.glob("runs-*")):
        campaign = open_campaign(source, level)
        plates, draw = campaign_figures(campaign, first_causes(campaign, source, runs))
    else:
        plates, draw = bag_figures(source)
    written = write_figures(plates, draw, out, as_json)
    if as_json:
        print_json({"source": str(source), "figures": [str(path) for path in written]})
    else:
        print(f"{len(written)} files in {out}")


def write_figures(
    plates: "Sequence[Plate]", draw: "Callable[[Plate], Figure]", out: Path, hidden: bool
) -> list[Path]:
    """Write figures to a folder that has none of them."""
    from ahv_analysis.report.figures import figure_files, save_figures

    for file in (file for plate in plates for file in figure_files(plate, out)):
        if file.exists():
            raise UsageError(f"{file} exists already: choose another --out")
    try:
        with progress_bar("drawing", len(plates), hidden, unit="figures") as progress:
            return save_figures(plates, draw, out, progress)
    except OSError as error:
        raise UsageError(f"cannot write figures to {out}: {error}") from error
