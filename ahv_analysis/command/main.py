# Copyright 2026 ahv developers, Apache-2.0
"""The `ahv` command."""

import json
import sys
import time
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ahv_analysis.command.bag import bag
from ahv_analysis.command.campaign import monte_carlo, table
from ahv_analysis.command.console import (
    Json,
    UsageError,
    check_domain,
    console,
    integer_option,
    number_option,
    one_sentence,
    print_json,
    progress_bar,
    show_table,
)
from ahv_analysis.command.faults import faults
from ahv_analysis.command.replay import replay
from ahv_analysis.report.report import report
from ahv_plant.dispersion import HIGHEST_LEVEL
from ahv_plant.model.constants import DEGREES, INITIAL_MASS, STEP
from ahv_plant.trim import CRUISE_ALTITUDE, CRUISE_SPEED

app = typer.Typer(
    help="Fly an air-breathing hypersonic vehicle and look at its flights.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.add_typer(monte_carlo, name="monte-carlo")
app.add_typer(faults, name="faults")
app.add_typer(bag, name="bag")
app.command()(table)
app.command()(report)
app.command()(replay)


class Engine(StrEnum):
    """What flies a case."""

    graph = "graph"
    library = "library"


@app.command()
@one_sentence
def trim(
    altitude: Annotated[float, number_option("m", "Altitude")] = CRUISE_ALTITUDE,
    speed: Annotated[float, number_option("m/s", "Forward speed u")] = CRUISE_SPEED,
    mass: Annotated[float, number_option("kg", "Mass")] = INITIAL_MASS,
    geometric: Annotated[
        bool, typer.Option("--geometric", help="The altitude is geometric, not geopotential.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Find level flight: section 3.5.1 of the report."""
    from ahv_plant.dispersion import Truth
    from ahv_plant.trim import trim as solve

    try:
        found = solve(altitude, speed, mass, Truth(geometric))
    except ValueError as error:
        raise UsageError(error) from error
    values = {
        "u_mps": found.state.u,
        "v_mps": found.state.v,
        "w_mps": found.state.w,
        "theta_deg": found.state.theta * DEGREES,
        "alpha_deg": found.alpha * DEGREES,
        "right_elevon_deg": found.surfaces.right_elevon * DEGREES,
        "left_elevon_deg": found.surfaces.left_elevon * DEGREES,
        "rudder_deg": found.surfaces.rudder * DEGREES,
        "throttle": found.throttle,
        "residual": found.residual,
        "converged": found.converged,
        "within_limits": found.within_limits,
    }
    if as_json:
        print_json(values)
    else:
        rows = [
            (name, f"{value:.6g}" if isinstance(value, float) else str(value))
            for name, value in values.items()
        ]
        show_table(f"Trim at {altitude:g} m, {speed:g} m/s, {mass:g} kg", rows)
    if not found.converged:
        print("ahv: no trim was found: the solver did not converge", file=sys.stderr)
        raise typer.Exit(1)


@app.command()
@one_sentence
def fly(
    case: Annotated[str, typer.Argument(help="Name of a file in config/cases, or a YAML file.")],
    engine: Annotated[
        Engine, typer.Option(help="The ROS graph, or the same laws in this process.")
    ] = Engine.graph,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="100 Hz by the wall clock, not lockstep.")
    ] = False,
    processes: Annotated[
        bool, typer.Option("--processes", help="One process per node, not all nodes in one.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the bag and the summary, which must not have them."),
    ] = None,
    duration: Annotated[
        float | None, number_option("s", "Length of the flight, instead of the case's")
    ] = None,
    dispersion: Annotated[
        str | None,
        typer.Option(
            help="Dispersion of the vehicle: a YAML file, or a level like 0.3 to draw one.",
            metavar="FILE|LEVEL",
        ),
    ] = None,
    seed: Annotated[int, integer_option("Seed of the campaign of a draw.")] = 0,
    run: Annotated[int, integer_option("Number of the run of a draw.")] = 0,
    as_json: Json = False,
) -> None:
    """Fly a case; record it to OUT/bag (MCAP) and sum it up in OUT/summary.json."""
    from ahv_analysis.bag.reader import read_bag
    from ahv_analysis.flight.case import load_case
    from ahv_analysis.flight.library import fly_library
    from ahv_analysis.flight.summary import summarize

    if engine == Engine.library and (realtime or processes):
        raise UsageError("--realtime and --processes are for the graph, not for --engine library")
    changes, draw = _dispersion(dispersion, seed, run)
    if duration is not None:
        changes["duration"] = duration
    flight = load_case(case, changes, draw)
    folder = out or Path("flights") / f"{flight.name}-{time.strftime('%Y%m%d-%H%M%S')}"
    bag, summary_file = folder / "bag", folder / "summary.json"
    for path in (bag, summary_file):
        if path.exists():
            raise UsageError(f"{path} exists already: choose another --out")
    with progress_bar(f"flying {flight.name}", flight.plant.steps, as_json) as progress:
        if engine == Engine.graph:
            check_domain()
            fly_ros = _engine(processes)
            ended_early, wall = fly_ros(flight, bag, realtime=realtime, progress=progress)
        else:
            ended_early, wall = fly_library(flight, bag, progress=progress)
    record = read_bag(bag)
    summary: dict[str, Any] = {"case": flight.name, "engine": engine.value, "bag": str(bag)}
    summary["dispersion"] = flight.plant.truth.dispersion._asdict()
    summary |= summarize(record, ended_early, flight.control)
    summary |= {"wall_s": wall, "real_time_factor": record.steps * STEP / wall}
    summary_file.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n")
    if as_json:
        print_json(summary)
    else:
        _print_summary(summary)
    if ended_early:
        raise typer.Exit(1)


def _engine(processes: bool) -> Callable[..., tuple[str, float]]:
    """Return what flies a case on the graph; only this needs ROS."""
    from ahv_analysis.flight.one_process import fly_graph
    from ahv_analysis.flight.process_per_node import fly_processes

    return fly_processes if processes else fly_graph


def _dispersion(choice: str | None, seed: int, run: int) -> tuple[dict[str, object], Any]:
    """Plant parameters of the option --dispersion, and the Draw that they come from, if any."""
    from ahv_analysis.flight.case import Draw, dispersion_parameters, load_dispersion
    from ahv_plant.dispersion import draw_dispersion

    if choice is None:
        return {}, None
    if choice.endswith((".yaml", ".yml")):
        if not Path(choice).is_file():
            raise UsageError(f"dispersion {choice} is not a file")
        return load_dispersion(Path(choice)), None
    try:
        level = float(choice)
    except ValueError:
        level = -1.0
    if not 0.0 <= level <= HIGHEST_LEVEL:
        raise UsageError(
            f"dispersion {choice!r} is neither a YAML file nor a level from 0 to {HIGHEST_LEVEL:g}"
        )
    changes = dispersion_parameters(draw_dispersion(level, seed, run))
    return changes, Draw(level, seed, run)


def _print_summary(summary: dict[str, Any]) -> None:
    final = summary["final_state"]
    low, high = summary["surface_range_deg"]
    least, most = summary["throttle_range"]
    verdict = "success" if summary["success"] else "FAILURE"
    cause = "" if summary["success"] else summary["cause"].replace("_", " ")
    why = cause, summary["ended_early"] or "flown to its end"
    rows = [
        ("verdict", f"{verdict}: {', '.join(filter(None, why))}"),
        ("largest |alpha|", f"{summary['max_abs_alpha_deg']:.3f} deg (inlet unstart at 5 deg)"),
        ("largest |beta|", f"{summary['max_abs_beta_deg']:.3f} deg"),
        ("surfaces", f"{low:.2f} to {high:.2f} deg (stops at -40 and 30)"),
        ("throttle", f"{least:.3f} to {most:.3f} (stops at 0.1 and 0.9)"),
        ("fuel", f"{summary['fuel_kg']:.0f} kg"),
        ("final speed u", f"{final['u']:.2f} m/s"),
        ("final altitude", f"{final['h']:.1f} m"),
        ("flown", f"{summary['steps']} steps in {summary['wall_s']:.2f} s"),
        ("pace", f"{summary['real_time_factor']:.0f} times real time"),
        ("bag", summary["bag"]),
    ]
    show_table(f"{summary['case']} on the {summary['engine']}", rows)


@app.command()
@one_sentence
def figures(
    source: Annotated[Path, typer.Argument(help="Folder of a bag, or of a campaign.")],
    out: Annotated[Path, typer.Option(help="Folder for the figures.")],
    runs: Annotated[int, integer_option("Runs of a campaign to draw.", 1)] = 100,
    level: Annotated[
        float | None, typer.Option(help="Level of a campaign, if there are several.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Draw the report's figures of a flight or a campaign, as PNG and SVG.

    3.2-3.7 of a nominal flight; 4.1-4.5 or 5.1-5.5 of an adaptive one, beside the nominal law;
    3.8-3.13, 4.6-4.10 or 5.6-5.10 of a campaign.
    """
    from ahv_analysis.campaign.campaign import first_causes, open_campaign
    from ahv_analysis.report.figures import save_figures
    from ahv_analysis.report.page_figures import bag_figures, campaign_figures

    if any(source.glob("runs-*")):
        campaign = open_campaign(source, level)
        plates, draw = campaign_figures(campaign, first_causes(campaign, source, runs))
    else:
        plates, draw = bag_figures(source)
    try:
        with progress_bar("drawing", len(plates), as_json, unit="figures") as progress:
            written = save_figures(plates, draw, out, progress)
    except OSError as error:
        raise UsageError(f"cannot write figures to {out}: {error}") from error
    if as_json:
        print_json({"source": str(source), "figures": [str(path) for path in written]})
    else:
        console.print(f"{len(written)} files in {out}")


def main() -> None:
    """Entry point of the command."""
    app()


if __name__ == "__main__":
    main()
