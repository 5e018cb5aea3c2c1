# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv map`."""

import json
import textwrap
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ahv_analysis.command.campaign import CORES, Dask, Seed, Workers, executor_of, kept_words
from ahv_analysis.command.console import (
    HardwareChoice,
    Json,
    ProfileChoice,
    Reported,
    integer_option,
    print_json,
    progress_bar,
    words_of,
)
from ahv_analysis.interrupt import interrupted_says, signals_wait
from ahv_analysis.ranges import RANGE

if TYPE_CHECKING:  # it takes long to load
    from ahv_analysis.campaign.map import Map, Point

AXIS = f"NAME={RANGE}"


def map_rates(
    case: Annotated[str, typer.Argument(help="Name of a case, or a YAML file.")],
    x: Annotated[
        str,
        typer.Option(
            "--x",
            metavar=AXIS,
            help="Horizontal axis: a parameter, a pattern of several, level, or altitude, mach, "
            "mass: where start and commands are, as in altitude=22:32km or mass=80,110,140t.",
        ),
    ],
    y: Annotated[str, typer.Option("--y", metavar=AXIS, help="Vertical axis.")],
    hardware: HardwareChoice = None,
    profile: ProfileChoice = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="A parameter that differs; any number of them."
        ),
    ] = None,
    level: Annotated[
        float | None, typer.Option(help="Dispersion, by default 0.3.", show_default=False)
    ] = None,
    runs: Annotated[int, integer_option("Vehicles a point, the same at each.", 1)] = 200,
    seed: Seed = 0,
    workers: Workers = CORES,
    dask: Dask = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the map; one that is there is resumed.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Fly the success rate over any two parameters, as a heat map.

    Every point is a campaign of the same vehicles, kept in the folder with map.png, map.parquet
    and map.json. NAME is a parameter of any node, a shell pattern for several, level, or a flight
    condition: altitude, mach, mass. Where that has no trim, nothing is flown.
    """
    from ahv_analysis.campaign.axis import LEVEL, read_settings
    from ahv_analysis.campaign.map import fly_map, rates, read_map, write_map
    from ahv_analysis.report.map_figure import draw_map
    from ahv_analysis.report.picture import save_picture

    changes = read_settings(settings or [])
    flown = read_map(
        case,
        x,
        y,
        changes,
        level=level,
        runs=runs,
        seed=seed,
        hardware=hardware,
        profile=profile,
    )
    name, axes = flown.case, (flown.x, flown.y)
    words = words_of(hardware, profile)
    folder = out or Path("maps") / "-".join([name, *words])
    total = runs * len(flown.campaigns)
    started = time.perf_counter()
    with (
        executor_of(workers, dask) as pool,
        progress_bar(f"map of {name}", total, as_json, unit="runs") as progress,
    ):
        reported = Reported(progress)
        interrupted_says(partial(kept_words, reported, total))
        with signals_wait() as interrupted:
            points = fly_map(flown, folder, pool, reported, interrupted)
    wall = time.perf_counter() - started
    described: dict[str, Any] = {
        "case": name,
        "hardware": next(iter(words_of(hardware)), None),
        "profile": next(iter(words_of(profile)), None),
        "set": {of: value for of, (_, value) in changes.items()},
        "level": None if LEVEL.name in (flown.x.name, flown.y.name) else flown.level,
        "seed": seed,
        "runs": runs,
        "x": {"name": axes[0].name, "unit": axes[0].unit, "values": axes[0].values},
        "y": {"name": axes[1].name, "unit": axes[1].unit, "values": axes[1].values},
        "without_trim": [
            {"x": x, "y": y, "why": why} for (x, y), why in flown.without_trim.items()
        ],
    }
    write_map(folder, points, described)
    title = assumptions(described)
    figure = draw_map(*axes, rates(flown, points), textwrap.fill(title, 68))
    save_picture(figure, folder / "map.png")
    if as_json:
        rows = [point._asdict() for point in points]
        print_json({**described, "points": rows, "wall_s": wall, "out": str(folder)})
    else:
        print(f"{title}\n\n{rate_table(flown, points)}\n")
        if flown.without_trim:
            reasons = ", ".join(dict.fromkeys(flown.without_trim.values()))
            print(f"-: not flown, for there is no trim: {reasons}")
        print(f"{total} flights in {wall:.0f} s; kept in {folder}")


def assumptions(described: dict[str, Any]) -> str:
    """What a map was flown with, in a line."""
    parts = [described["case"]]
    if described["hardware"] is not None:
        parts.append(f"{described['hardware']} hardware")
    if described["profile"] is not None:
        parts.append(f"profile {described['profile']}")
    parts += [f"{name} = {json.dumps(value)}" for name, value in described["set"].items()]
    if described["level"] is not None:
        parts.append(f"level {described['level']:g}")
    return ", ".join([*parts, f"{described['runs']} runs a point", f"seed {described['seed']}"])


def rate_table(flown: "Map", points: "list[Point]") -> str:
    """Success rates in percent as they lie on the map: y upwards, x to the right."""
    rate = {(point.x, point.y): f"{100.0 * point.success_rate:.1f}" for point in points}
    xs, ys = flown.x.written.written, flown.y.written.written
    rows = [
        [f"{written:g}", *(rate.get((x, y), "-") for x in flown.x.values)]
        for y, written in zip(reversed(flown.y.values), reversed(ys), strict=True)
    ]
    rows.append(["", *(f"{x:g}" for x in xs)])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        for row in rows
    ]
    head = f"success [%], {flown.y.title} upwards, {flown.x.title} to the right"
    return "\n".join([head, *lines])
