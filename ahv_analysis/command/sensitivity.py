# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv sensitivity`: which of what was drawn decides."""

import textwrap
from pathlib import Path
from typing import Annotated

import typer

from ahv_analysis.command.console import Json, print_json, progress_bar, show_rows
from ahv_analysis.command.results import results_in, write_numbers


def sensitivity(
    campaign: Annotated[Path, typer.Argument(help="Folder of a campaign.")],
    of: Annotated[
        str,
        typer.Option(
            metavar="COLUMN", help="What is decided: lost, or any column of the campaign."
        ),
    ] = "lost",
    level: Annotated[float | None, typer.Option(help="Level, if there are several.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for pictures and JSON, by default sensitivity in the campaign."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Say which of what was drawn decides a quantity of a campaign.

    Rank correlations, a regression, and PAWN, an index that asks for no shape; what is named is
    beyond chance for all factors together. Writes sensitivity.png, scatter.png, sensitivity.json.
    """
    from ahv_analysis.campaign.campaign import open_campaign
    from ahv_analysis.campaign.columns import factors, is_lost, quantity, read_columns
    from ahv_analysis.campaign.sensitivity import PERMUTATIONS, check_sensitivities, sensitivities
    from ahv_analysis.report.picture import save_picture
    from ahv_analysis.report.sensitivity_figure import draw_scatter, draw_sensitivity

    flown = open_campaign(campaign, level)
    columns = read_columns(flown, campaign)
    values, lost, drawn = quantity(columns, of), is_lost(columns), factors(flown, columns)
    check_sensitivities(of, values, drawn)
    with progress_bar(f"what decides {of}", PERMUTATIONS, as_json, "permutations") as progress:
        found = sensitivities(of, values, drawn, progress=progress)
    folder = out or campaign / "sensitivity"
    words = f"{flown.case.name}, level {flown.level:g}, seed {flown.seed}, {found.runs} runs"
    content = {
        "campaign": str(campaign),
        "case": flown.case.name,
        "level": flown.level,
        "seed": flown.seed,
        **found._asdict(),
        "factors": [one._asdict() for one in found.factors],
        "out": str(folder),
    }
    title = "\n".join([words, *textwrap.wrap(found.sentence, 150)])
    with results_in(folder):
        for draw, name in ((draw_sensitivity, "sensitivity"), (draw_scatter, "scatter")):
            save_picture(draw(found, values, lost, drawn, title), folder / f"{name}.png")
        write_numbers(folder / "sensitivity.json", content)
    if as_json:
        print_json(content)
        return
    print(found.sentence)
    head = ("factor", "PAWN", "p", "rank correlation", "regression", "at low", "at high")
    rows = [
        (
            one.factor + (" *" if one.decides else ""),
            f"{one.pawn:.3f}",
            f"{one.p_value:.3f}" if one.p_value >= 0.001 else "< 0.001",
            f"{one.rank_correlation:+.3f}",
            f"{one.coefficient:+.3f}",
            f"{one.at_low:.4g}",
            f"{one.at_high:.4g}",
        )
        for one in found.factors
    ]
    show_rows(f"{words}: what decides {of}", head, rows)
    print(f"*: beyond chance, whose index is up to {found.chance:.3f}; kept in {folder}")
