"""The `ahv` command."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from ahv_analysis.bag_writer import BagError
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.constants import DEGREES, INITIAL_MASS, STEP
from ahv_plant.trim import CRUISE_ALTITUDE, CRUISE_SPEED

app = typer.Typer(
    help="Fly an air-breathing hypersonic vehicle and look at its flights.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
console = Console()
HIGHEST_LEVEL = 0.9  # [-] of a drawn dispersion
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


class Engine(StrEnum):
    """What flies a case."""

    graph = "graph"
    library = "library"


def number(text: str) -> float:
    """Read an option that is a number."""
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a number") from None


def _number(unit: str, meaning: str) -> Any:
    return typer.Option(help=f"{meaning} [{unit}].", parser=number, metavar="NUMBER")


class UsageError(Exception):
    """Something asked for that cannot be had; one sentence, exit code 2."""


def one_sentence(command: Callable[..., None]) -> Callable[..., None]:
    """Turn the errors of wrong input into one sentence and exit code 2."""

    @wraps(command)
    def guarded(*arguments: Any, **options: Any) -> None:
        try:
            command(*arguments, **options)
        except (UsageError, ParameterError, BagError) as error:
            print(f"ahv: {error}", file=sys.stderr)
            raise typer.Exit(2) from error

    return guarded


@contextmanager
def progress_bar(title: str, total: int, hidden: bool) -> Iterator[Callable[[int], None]]:
    """Progress on the terminal; the function it gives takes the work done so far."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f}%"))
    with Progress(
        *columns, TimeRemainingColumn(), console=console, disable=hidden, transient=True
    ) as bar:
        task = bar.add_task(title, total=total)
        yield lambda done: bar.update(task, completed=done)


def table(title: str, rows: list[tuple[str, str]]) -> None:
    """Print a table of names and values."""
    sheet = Table(title=title, title_justify="left", show_header=False)
    for name, value in rows:
        sheet.add_row(name, value)
    console.print(sheet)


@app.command()
@one_sentence
def trim(
    altitude: Annotated[float, _number("m", "Altitude")] = CRUISE_ALTITUDE,
    speed: Annotated[float, _number("m/s", "Forward speed u")] = CRUISE_SPEED,
    mass: Annotated[float, _number("kg", "Mass")] = INITIAL_MASS,
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
        print(json.dumps(values))
    else:
        rows = [
            (name, f"{value:.6g}" if isinstance(value, float) else str(value))
            for name, value in values.items()
        ]
        table(f"Trim at {altitude:g} m, {speed:g} m/s, {mass:g} kg", rows)
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
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the bag and the summary, which must not have them."),
    ] = None,
    duration: Annotated[
        float | None, _number("s", "Length of the flight, instead of the case's")
    ] = None,
    dispersion: Annotated[
        str | None,
        typer.Option(
            help="Dispersion of the vehicle: a YAML file, or a level like 0.3 to draw one.",
            metavar="FILE|LEVEL",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the campaign of a draw.")] = 0,
    run: Annotated[int, typer.Option(min=0, help="Number of the run of a draw.")] = 0,
    as_json: Json = False,
) -> None:
    """Fly a case; record it to OUT/bag (MCAP) and sum it up in OUT/summary.json."""
    from ahv_analysis.bag_reader import read_bag
    from ahv_analysis.case import load_case
    from ahv_analysis.flight import fly_library
    from ahv_analysis.graph_flight import fly_graph
    from ahv_analysis.summary import summarize

    changes = _dispersion(dispersion, seed, run)
    if duration is not None:
        changes["duration"] = duration
    flight = load_case(case, changes)
    folder = out or Path("flights") / f"{flight.name}-{time.strftime('%Y%m%d-%H%M%S')}"
    bag, summary_file = folder / "bag", folder / "summary.json"
    for path in (bag, summary_file):
        if path.exists():
            raise UsageError(f"{path} exists already: choose another --out")
    with progress_bar(f"flying {flight.name}", flight.plant.steps, as_json) as progress:
        fly_engine = fly_graph if engine == Engine.graph else fly_library
        ended_early, wall = fly_engine(flight, bag, progress=progress)
    record = read_bag(bag)
    summary: dict[str, Any] = {"case": flight.name, "engine": engine.value, "bag": str(bag)}
    summary["dispersion"] = flight.plant.truth.dispersion._asdict()
    summary |= summarize(record, ended_early)
    summary |= {"wall_s": wall, "real_time_factor": record.steps * STEP / wall}
    summary_file.write_text(json.dumps(summary, indent=2) + "\n")
    if as_json:
        print(json.dumps(summary))
    else:
        _print_summary(summary)


def _dispersion(choice: str | None, seed: int, run: int) -> dict[str, object]:
    """Plant parameters of the option --dispersion."""
    from ahv_analysis.case import dispersion_parameters, load_dispersion
    from ahv_plant.dispersion import draw_dispersion

    if choice is None:
        return {}
    if choice.endswith((".yaml", ".yml")):
        if not Path(choice).is_file():
            raise UsageError(f"dispersion {choice} is not a file")
        return load_dispersion(Path(choice))
    try:
        level = float(choice)
    except ValueError:
        level = -1.0
    if not 0.0 <= level <= HIGHEST_LEVEL:
        raise UsageError(
            f"dispersion {choice!r} is neither a YAML file nor a level from 0 to {HIGHEST_LEVEL:g}"
        )
    return dispersion_parameters(draw_dispersion(level, seed, run))


def _print_summary(summary: dict[str, Any]) -> None:
    final = summary["final_state"]
    low, high = summary["surface_range_deg"]
    least, most = summary["throttle_range"]
    verdict = "success" if summary["success"] else "FAILURE"
    rows = [
        ("verdict", f"{verdict}: {summary['ended_early'] or 'flown to its end'}"),
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
    table(f"{summary['case']} on the {summary['engine']}", rows)


@app.command()
@one_sentence
def figures(
    bag: Annotated[Path, typer.Argument(help="Folder of a bag.")],
    out: Annotated[Path, typer.Option(help="Folder for the figures.")],
    as_json: Json = False,
) -> None:
    """Draw the report's figures of a recorded flight, as PNG and SVG.

    3.2-3.7 of a nominal one; 4.1-4.5 or 5.1-5.5 of an adaptive one, beside the nominal law.
    """
    from ahv_analysis.comparison import report_figures
    from ahv_analysis.figures import save_figures

    plates, flights = report_figures(bag)
    try:
        with progress_bar("drawing", len(plates), as_json) as progress:
            written = save_figures(plates, flights, out, progress)
    except OSError as error:
        raise UsageError(f"cannot write figures to {out}: {error}") from error
    if as_json:
        print(json.dumps({"bag": str(bag), "figures": [str(path) for path in written]}))
    else:
        console.print(f"{len(written)} files in {out}")


def main() -> None:
    """Entry point of the command."""
    app()


if __name__ == "__main__":
    main()
