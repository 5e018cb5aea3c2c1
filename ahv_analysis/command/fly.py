# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv fly`."""

import os
import re
import time
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from ahv_analysis.command.console import (
    HardwareChoice,
    Json,
    LawChoice,
    ProfileChoice,
    Reported,
    UsageError,
    check_domain,
    integer_option,
    number_option,
    print_json,
    progress_bar,
    show_table,
)
from ahv_analysis.command.results import write_numbers
from ahv_analysis.errors import BagError, GraphError
from ahv_analysis.interrupt import interrupted_says, last_of_all, signals_wait
from ahv_msgs_py.node.network import DISCOVERY_RANGE
from ahv_msgs_py.topics import NAMESPACE
from ahv_plant.dispersion import HIGHEST_LEVEL
from ahv_plant.model.constants import STEP, STEP_NS


class CaseCommand(TyperCommand):
    """A command whose help lists the cases, profiles and laws."""

    def format_epilog(self, context: Any, formatter: Any) -> None:
        """List what there is by name."""
        from ahv_analysis.flight.case import case_names, profile_names
        from ahv_control.law_file import law_names

        known = {"Cases": case_names(), "Profiles": profile_names(), "Laws": law_names()}
        for title, names in known.items():
            with formatter.section(title):
                formatter.write_text(", ".join(names))


NAMES = re.compile("(/[A-Za-z_][A-Za-z0-9_]*)+")  # as ROS has them
MOST_RAISED = 5  # of what a law raises, that are said
INCOMPLETE = 3  # exit code of a flight that the bag does not hold all of


class Engine(StrEnum):
    """What flies a case."""

    graph = "graph"
    library = "library"


def fly(
    case: Annotated[str, typer.Argument(help="Name of a case, or a YAML file of one.")],
    engine: Annotated[
        Engine, typer.Option(help="The ROS graph, or the same laws in this process.")
    ] = Engine.graph,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="100 Hz by the wall clock, not lockstep.")
    ] = False,
    processes: Annotated[
        bool, typer.Option("--processes", help="One process per node, not all nodes in one.")
    ] = False,
    network: Annotated[
        bool, typer.Option("--network", help="Let other machines hear the graph, and speak to it.")
    ] = False,
    namespace: Annotated[
        str, typer.Option(help="Of nodes and topics: vehicles in one ROS domain differ in it.")
    ] = NAMESPACE,
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
    hardware: HardwareChoice = None,
    profile: ProfileChoice = None,
    law: LawChoice = None,
    seed: Annotated[int, integer_option("Seed of the campaign of a draw.")] = 0,
    run: Annotated[int, integer_option("Number of the run of a draw.")] = 0,
    as_json: Json = False,
) -> None:
    """Fly a case, record it and sum it up.

    The bag goes to OUT/bag (MCAP), the summary to OUT/summary.json.
    """
    from ahv_analysis.bag.info import refused_facts
    from ahv_analysis.bag.reader import flight_of, read
    from ahv_analysis.flight.case import load_case
    from ahv_analysis.flight.library import fly_library
    from ahv_analysis.report.summary import missing_states, summarize
    from ahv_control.own_law import TROUBLES
    from ahv_plant.hardware.actuator_parameters import failures_in

    namespace = f"/{namespace.strip('/')}"
    if not NAMES.fullmatch(namespace):
        raise UsageError(
            f"namespace {namespace} is not one or several names of letters, digits and _, "
            "each after a / and none with a digit first, like /uav1"
        )
    if engine == Engine.library and (realtime or processes or network or namespace != NAMESPACE):
        raise UsageError(
            "--realtime, --processes, --network and --namespace are for the graph, "
            "not for --engine library"
        )
    changes, draw = chosen_dispersion(dispersion, seed, run, namespace)
    if duration is not None:
        changes["duration"] = duration
    flight = load_case(case, changes, draw, namespace, hardware, profile, law)
    folder = out or Path("flights") / f"{flight.name}-{time.strftime('%Y%m%d-%H%M%S')}"
    bag, summary_file = folder / "bag", folder / "summary.json"
    for path in (bag, summary_file):
        if path.exists():
            raise UsageError(f"{path} exists already: choose another --out")
    with progress_bar(f"flying {flight.name}", flight.plant.steps, as_json) as show:
        progress = Reported(show)
        interrupted_says(partial(_what_is_left, progress, bag))
        if engine == Engine.graph:
            check_domain()
            if network:
                os.environ.setdefault(DISCOVERY_RANGE, "SUBNET")
            if processes and os.environ.get(DISCOVERY_RANGE) == "OFF":
                raise UsageError(
                    f"{DISCOVERY_RANGE} is OFF, so that processes do not hear each other: unset it"
                )
            fly_ros = _engine(processes)
            ended_early, wall = fly_ros(
                flight, bag, namespace=namespace, realtime=realtime, progress=progress
            )
        else:
            ended_early, wall = fly_library(flight, bag, progress=progress)
    contents = read(bag)
    try:
        record = flight_of(contents)
    except BagError as error:
        raise GraphError(ended_early or str(error)) from error
    flown = record.stamps[-1] // STEP_NS if ended_early else flight.plant.steps
    missing = missing_states(contents, int(flown))
    summary: dict[str, Any] = {"case": flight.name, "engine": engine.value, "bag": str(bag)}
    truth = flight.plant.truth
    summary["dispersion"] = truth.dispersion._asdict()
    if truth.further is not None:
        summary["dispersion"] |= truth.further._asdict()
    summary["failures"] = failures_in(flight.parameters["plant"])
    summary |= summarize(record, ended_early, missing, flight.control)
    summary["refused"] = refused_facts(contents)
    if flight.law is not None:
        raised = {text: TROUBLES[text] for text in list(TROUBLES)[:MOST_RAISED]}
        summary["law"] = {"name": flight.law.name, "raised": raised} | {
            "compiled": not flight.law.why_plain
        }
    summary |= {"wall_s": wall, "real_time_factor": record.steps * STEP / wall}
    with signals_wait():
        write_numbers(summary_file, summary)
    if as_json:
        print_json(summary)
    else:
        _print_summary(summary)
    if ended_early:
        raise typer.Exit(1)
    if missing:
        raise typer.Exit(INCOMPLETE)


def _what_is_left(reported: Reported, bag: Path) -> str:
    """What an interrupted flight leaves."""
    if reported.last < 0:
        return "before the flight began"
    return f"at {reported.last * STEP:.2f} s; what was flown is in {bag}"


def _engine(processes: bool) -> Callable[..., tuple[str, float]]:
    """Return what flies a case on the graph; only this needs ROS."""
    from ahv_analysis.flight.one_process import fly_graph
    from ahv_analysis.flight.process_per_node import fly_processes

    return fly_processes if processes else partial(fly_graph, leave=last_of_all)


def chosen_dispersion(
    choice: str | None, seed: int, run: int, namespace: str
) -> tuple[dict[str, object], Any]:
    """Plant parameters of the option --dispersion, and the Draw that they come from, if any."""
    from ahv_analysis.flight.case import Draw, dispersion_parameters, load_dispersion
    from ahv_plant.dispersion import draw_dispersion

    if choice is None:
        return {}, None
    if choice.endswith((".yaml", ".yml")):
        if not Path(choice).is_file():
            raise UsageError(f"dispersion {choice} is not a file")
        return load_dispersion(Path(choice), namespace), None
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
    from ahv_analysis.bag.info import refused_words

    final = summary["final_state"]
    low, high = summary["surface_range_deg"]
    least, most = summary["throttle_range"]
    verdict = "success" if summary["success"] else "FAILURE"
    cause = "" if summary["success"] else summary["cause"].replace("_", " ")
    why = cause, summary["ended_early"] or "flown to its end"
    missing = summary["missing_steps"]
    unrecorded = f", and {missing} that are not in the bag" if missing else ""
    rows = [
        ("verdict", f"{verdict}: {', '.join(filter(None, why))}"),
        ("largest |alpha|", f"{summary['max_abs_alpha_deg']:.3f} deg (inlet unstart at 5 deg)"),
        ("largest |beta|", f"{summary['max_abs_beta_deg']:.3f} deg"),
        ("surfaces", f"{low:.2f} to {high:.2f} deg (stops at -40 and 30)"),
        ("throttle", f"{least:.3f} to {most:.3f} (stops at 0.1 and 0.9)"),
        ("fuel", f"{summary['fuel_kg']:.0f} kg"),
        ("final speed u", f"{final['u']:.2f} m/s"),
        ("final altitude", f"{final['h']:.1f} m"),
        ("flown", f"{summary['steps']} steps in {summary['wall_s']:.2f} s{unrecorded}"),
        ("pace", f"{summary['real_time_factor']:.0f} times real time"),
        ("bag", summary["bag"]),
    ]
    for control, what in summary["failures"].items():
        rows.append((control.replace("_", " "), what))
    for what, since in summary["outside_the_model"].items():
        rows.append(("outside the model", f"{what} from {since:g} s on"))
    for limit, seconds in summary["limited_s"].items():
        rows.append(("limited", f"by {limit.replace('_', ' ')} for {seconds:g} s"))
    for words, times in summary.get("law", {}).get("raised", {}).items():
        rows.append(("the law raised", f"{words} ({times} times)"))
    if summary["refused"]:
        rows.append(("refused", refused_words(summary["refused"])))
    show_table(f"{summary['case']} on the {summary['engine']}", rows)
