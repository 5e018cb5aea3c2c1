# Copyright 2026 ahv developers, Apache-2.0
"""The commands of campaigns: `ahv monte-carlo`, its `rerun`, and `ahv table`."""

import logging
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

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
    words_of,
)
from ahv_analysis.command.results import write_numbers
from ahv_analysis.interrupt import interrupted_says, last_of_all, signals_wait
from ahv_plant.dispersion import HIGHEST_LEVEL
from ahv_plant.model.constants import STEP

if TYPE_CHECKING:  # it takes long to load
    from ahv_analysis.flight.case import Case

LONGEST_SEARCH = "10s"  # for a dask scheduler

monte_carlo = typer.Typer(
    help="Fly many drawn vehicles, and any of them again alone.",
    add_completion=False,
    rich_markup_mode=None,
)


@contextmanager
def executor_of(workers: int, dask: str | None, *cases: "Case") -> Iterator[Executor]:
    """Threads of this process, or a dask cluster; processes where a law is not compiled."""
    if dask is None:
        from ahv_analysis.campaign.workers import processes
        from ahv_control.own_law import is_compiled

        compiled = all(is_compiled(case.control) for case in cases)
        pool = ThreadPoolExecutor(workers) if compiled else processes(workers)
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)
        return
    try:
        from distributed import Client
    except ModuleNotFoundError as error:
        raise UsageError("--dask needs the extra ahv[dask]") from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what fails is said here
    try:
        client = Client(dask, timeout=LONGEST_SEARCH)
    except (OSError, ValueError) as error:
        raise UsageError(f"no dask scheduler answers at {dask}: {error}") from error
    with client, client.get_executor(pure=False, retries=10) as pool:
        yield pool


Workers = Annotated[int, integer_option("Threads, by default one a core.", 1)]
Dask = Annotated[str | None, typer.Option(help="Address of a dask scheduler to fly on.")]
Seed = Annotated[int, integer_option("Seed of the draws.")]
WIDE = 1e9  # [m, m/s] of a corridor that bounds one of both
CORES = os.cpu_count() or 1


@monte_carlo.callback(invoke_without_command=True)
def fly(
    context: typer.Context,
    controller: Annotated[
        str, typer.Option(help="Name of a case, whose start and settings are flown.")
    ] = "neuro_adaptive_sc_gdi",
    level: Annotated[
        list[float] | None, typer.Option(help="Dispersion; may be given several times.")
    ] = None,
    runs: Annotated[int, integer_option("Vehicles a level.", 1)] = 1000,
    seed: Seed = 0,
    protected: Annotated[
        bool, typer.Option("--protected", help="The case with angle-of-attack protection.")
    ] = False,
    random_starts: Annotated[
        bool, typer.Option("--random-starts", help="Section 3.5.2's random starts as well.")
    ] = False,
    hardware: HardwareChoice = None,
    profile: ProfileChoice = None,
    law: LawChoice = None,
    draws: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What is drawn besides: distributions in a YAML file."),
    ] = None,
    corridor_altitude: Annotated[
        float | None,
        number_option("m", "A run farther from the altitude to follow than this is lost"),
    ] = None,
    corridor_speed: Annotated[
        float | None, number_option("m/s", "A run farther from the speed to follow is lost")
    ] = None,
    corridor_time: Annotated[
        float | None, number_option("s", "Time it may be outside without a break, by default 0")
    ] = None,
    workers: Workers = CORES,
    dask: Dask = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the campaign; one that is there is resumed.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Fly RUNS drawn vehicles a level; a folder of Parquet files a level, with a row a run."""
    if context.invoked_subcommand is not None:
        return
    from ahv_analysis.campaign.campaign import Campaign, fly_campaign
    from ahv_analysis.campaign.draws import load_draws
    from ahv_analysis.campaign.summary import summarize_campaign
    from ahv_analysis.flight.case import load_case

    levels = level or [0.3]
    for one in levels:
        if not 0.0 <= one <= HIGHEST_LEVEL:
            raise UsageError(f"level {one:g} is outside 0 to {HIGHEST_LEVEL:g}")
    name = controller + ("_protected" if protected else "")
    case = load_case(name, hardware=hardware, profile=profile, law=law)
    drawn = None if draws is None else load_draws(draws)
    corridor = _corridor(corridor_altitude, corridor_speed, corridor_time)
    words = [case.name, *words_of(hardware, profile, None if draws is None else draws.stem)]
    folder = out or Path("campaigns") / "-".join(words)
    summaries = []
    with executor_of(workers, dask, case) as pool:
        for one in levels:
            campaign = Campaign(case, one, runs, seed, random_starts, drawn, corridor)
            with progress_bar(f"{case.name} at {one:g}", runs, as_json, unit="runs") as progress:
                reported = Reported(progress)
                started = time.perf_counter()
                interrupted_says(partial(kept_words, reported, runs))
                with signals_wait() as interrupted:
                    fly_campaign(campaign, folder, pool, reported, interrupted)
                wall = time.perf_counter() - started
            summary = summarize_campaign(campaign, folder)
            steps = summary["flown_s"] / STEP * (1 - (reported.first or 0) / runs)
            summary |= {"trial_steps_per_second": steps / wall, "wall_s": wall}
            summaries.append(summary | {"out": str(folder)})
    if as_json:
        print_json(summaries[0] if len(summaries) == 1 else {"levels": summaries})
        return
    for summary in summaries:
        _show(summary)


def _corridor(altitude: float | None, speed: float | None, longest: float | None) -> Any:
    """Corridor of the options; None without limits, UsageError for what is no corridor."""
    from ahv_analysis.flight.outcome import Corridor

    given = {"altitude": altitude, "speed": speed, "time": longest}
    for name, value in given.items():
        if value is not None and not (0.0 < value < inf or (name, value) == ("time", 0.0)):
            raise UsageError(f"--corridor-{name} is {value:g}, but must be more than 0")
    if altitude is None and speed is None:
        if longest is not None:
            raise UsageError("--corridor-time needs --corridor-altitude or --corridor-speed")
        return None
    return Corridor(altitude or WIDE, speed or WIDE, longest or 0.0)


def kept_words(reported: Reported, runs: int) -> str:
    """What an interrupted campaign keeps."""
    return f"after {max(reported.last, 0)} of {runs} runs; the same command resumes"


def _show(summary: dict[str, Any]) -> None:
    low, high = summary["interval"]
    failures = ", ".join(
        f"{cause.replace('_', ' ')} {count}" for cause, count in summary["failures"].items()
    )
    rows = [
        ("success", f"{summary['successes']} of {summary['runs']}: {summary['success_rate']:.2%}"),
        ("95 % interval", f"{low:.2%} to {high:.2%}"),
        ("failures", failures or "none"),
        (
            "trim within 5 deg",
            f"{summary['trim_within_5_deg']} vehicles have one at the commanded altitude;"
            f" {summary['failures_without_such_trim']} of the failed have none",
        ),
        (
            "beyond saving",
            f"{summary['beyond_saving']} vehicles pass 5 deg at full nose-down from the start on;"
            f" {summary['failures_beyond_saving']} of the failed do",
        ),
        *_tracked(summary),
        ("pace", f"{summary['trial_steps_per_second']:.3g} steps/s, {summary['wall_s']:.1f} s"),
        ("kept in", summary["out"]),
    ]
    show_table(f"{summary['controller']} at {summary['level']:g}", rows)


def _tracked(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """How the successes followed their reference."""
    found = summary["tracking"]
    if found is None:
        return []
    rows = [
        (
            "of the successes",
            f"altitude error {found['median_rms_altitude_error_m']:.0f} m RMS in the median, "
            f"{found['largest_rms_altitude_error_m']:.0f} m at most; at the end "
            f"{found['median_final_altitude_error_m']:.0f} and "
            f"{found['largest_final_altitude_error_m']:.0f} m",
        ),
        (
            "",
            f"speed error {found['median_rms_speed_error_mps']:.1f} m/s RMS in the median; "
            f"{found['median_fuel_kg'] / 1e3:.1f} t of fuel",
        ),
    ]
    if summary["successes_below_mach_4"]:
        slow = f"{summary['successes_below_mach_4']} of them, where the model does not hold"
        rows.append(("below Mach 4", slow))
    return rows


@monte_carlo.command()
def rerun(
    folder: Annotated[Path, typer.Argument(help="Folder of a campaign.")],
    run: Annotated[int, typer.Argument(help="Number of the run.")],
    level: Annotated[float | None, typer.Option(help="Level, if there are several.")] = None,
    graph: Annotated[bool, typer.Option("--graph", help="Fly it on the ROS graph.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder for a bag of the run.")] = None,
    as_json: Json = False,
) -> None:
    """Fly one run of a campaign again, alone.

    What it comes to is compared with what the campaign found, bit for bit.
    """
    import numpy as np

    from ahv_analysis.campaign.campaign import find_run, fly_again, open_campaign
    from ahv_analysis.flight.library import fly_library
    from ahv_analysis.flight.outcome import Cause

    campaign = open_campaign(folder, level)
    row = find_run(campaign, folder, run)
    if row is None:
        raise UsageError(f"run {run} is not in {folder}, whose last run is {campaign.runs - 1}")
    case = campaign.case_of(run)
    alone = {name: column[0] for name, column in fly_again(campaign, run).items()}
    differing = [
        name
        for name, value in alone.items()
        if not np.array_equal(value, row[name], equal_nan=name == "trim_alpha_deg")
    ]
    result = {
        "run": run,
        "cause": Cause(alone["cause"]).name.lower(),
        "time_s": float(alone["time_s"]),
        "max_abs_alpha_deg": float(alone["max_abs_alpha_deg"]),
        "same_bits": not differing,
        "differing": differing,
    }
    if graph or out is not None:
        bag = (out or folder / f"run-{run}") / "bag"
        if bag.exists():
            raise UsageError(f"{bag} exists already: choose another --out")
        with progress_bar(f"run {run}", case.plant.steps, as_json) as progress:
            if graph:
                check_domain()
                from ahv_analysis.flight.one_process import fly_graph

                ended_early, _ = fly_graph(case, bag, progress=progress, leave=last_of_all)
            else:
                ended_early, _ = fly_library(case, bag, progress=progress)
        result |= {"bag": str(bag), "ended_early": ended_early}
    if as_json:
        print_json(result)
    else:
        show_table(f"run {run} again", [(name, str(value)) for name, value in result.items()])
    if differing:
        print(
            f"ahv: run {run} differs from the campaign's in {', '.join(differing)}",
            file=sys.stderr,
        )
        raise typer.Exit(1)


def table(
    runs: Annotated[
        int | None, integer_option("Trials a cell, instead of the report's numbers.", 1)
    ] = None,
    seed: Seed = 0,
    protected: Annotated[
        bool, typer.Option("--protected", help="With angle-of-attack protection.")
    ] = False,
    hardware: HardwareChoice = None,
    profile: ProfileChoice = None,
    law: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME|FILE", help="A law of your own that gets a row; any number of them."
        ),
    ] = None,
    workers: Workers = CORES,
    dask: Dask = None,
    out: Annotated[Path | None, typer.Option(help="Folder for campaigns and table.")] = None,
    as_json: Json = False,
) -> None:
    """Fly Table 5.1 of the report, beside its counts."""
    from ahv_analysis.campaign.table import fly_table, markdown, table_cases, total_runs

    started = time.perf_counter()
    laws = law or []
    total = total_runs(runs, len(laws))
    cases = table_cases(protected, hardware, profile, laws)
    folder = out or Path("campaigns") / "-".join(["table", *words_of(hardware, profile)])
    with (
        executor_of(workers, dask, *cases) as pool,
        progress_bar("Table 5.1", total, as_json, unit="runs") as progress,
    ):
        reported = Reported(progress)
        interrupted_says(partial(kept_words, reported, total))
        with signals_wait() as interrupted:
            rows = fly_table(
                folder,
                pool,
                seed,
                runs,
                protected,
                reported,
                interrupted,
                hardware=hardware,
                profile=profile,
                laws=laws,
            )
    name = "table_protected" if protected else "table"
    (equipped,) = words_of(hardware or "ideal")
    followed = "".join(f", along {word}" for word in words_of(profile))
    text = f"On {equipped} hardware{followed}.\n\n{markdown(rows)}"
    (folder / f"{name}.md").write_text(text, encoding="utf-8")
    content = {
        "hardware": equipped,
        "profile": next(iter(words_of(profile)), None),
        "wall_s": time.perf_counter() - started,
        "rows": [row.flown | {"against_report": row.verdict} for row in rows],
    }
    write_numbers(folder / f"{name}.json", content)
    if as_json:
        print_json(content)
    else:
        print(text)
        print(f"{total} flights in {content['wall_s']:.0f} s; kept in {folder}")
