# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv worst`: the worst vehicle of a box, and the largest box without a loss."""

import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple
from zlib import crc32

import typer

from ahv_analysis.command.campaign import CORES, Workers, executor_of
from ahv_analysis.command.console import (
    HardwareChoice,
    Json,
    LawChoice,
    ProfileChoice,
    UsageError,
    integer_option,
    print_json,
    progress_bar,
    show_table,
    words_of,
)
from ahv_analysis.command.results import results_in, write_numbers
from ahv_analysis.interrupt import interrupted_says, signals_wait

if TYPE_CHECKING:  # it takes long to load
    from ahv_analysis.campaign.axis import Axis
    from ahv_analysis.campaign.vehicles import Vehicles
    from ahv_analysis.campaign.worst import Probe, Radius
    from ahv_analysis.flight.case import Case

RESOLUTION = 0.01  # [-] of the largest level
PARTS = 64  # of the range of a parameter


class Search(NamedTuple):
    """What is searched, and how."""

    case: "Case"
    words: list[str]  # case, hardware and profile, for titles
    options: list[str]  # with which `ahv fly` flies it
    seed: int
    workers: int
    folder: Path
    hidden: bool  # no progress is shown


def worst(
    case: Annotated[str, typer.Argument(help="Name of a case, or a YAML file.")],
    level: Annotated[
        float, typer.Option(help="Half the width of the box: multipliers of 1 - L to 1 + L.")
    ] = 0.3,
    radius: Annotated[
        bool, typer.Option("--radius", help="Search for the largest level without a loss instead.")
    ] = False,
    over: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=KEPT:LOST",
            help="With --radius: how far a parameter can go at --level, from a value at which "
            "none is lost; such as latency.delay=0:0.2 or actuator.elevons.rate_limit=60:1.",
        ),
    ] = None,
    hardware: HardwareChoice = None,
    profile: ProfileChoice = None,
    law: LawChoice = None,
    starts: Annotated[int, integer_option("Starts of the search.", 1)] = 3,
    seed: Annotated[int, integer_option("Seed of the search.")] = 0,
    workers: Workers = CORES,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the search; one that is there is resumed.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Search the worst vehicle that a dispersion of LEVEL can make.

    All 512 corners first, then evolution from several starts. Writes the vehicle as a dispersion
    file, flies it into a bag, and draws it: worst.yaml, worst.png, worst.json, a page. Or, by
    --radius, bisects where losses begin. What a search does not find may be there all the same.
    """
    from ahv_analysis.flight.case import load_case
    from ahv_plant.dispersion import HIGHEST_LEVEL

    if not 0.0 <= level <= HIGHEST_LEVEL:
        raise UsageError(f"level {level:g} is outside 0 to {HIGHEST_LEVEL:g}")
    if over is not None and not radius:
        raise UsageError("--over needs --radius")
    flown = load_case(case, hardware=hardware, profile=profile, law=law)
    words = [flown.name, *words_of(hardware, profile, law)]
    folder = out or Path("worst") / "-".join(words)
    options = [case]
    for option, given in (("--hardware", hardware), ("--profile", profile), ("--law", law)):
        options += [] if given is None else [option, given]
    search = Search(flown, words, options, seed, workers, folder, as_json)
    content = _radius(search, level, over) if radius else _worst(search, level, starts)
    if as_json:
        print_json(content)
        return
    rows = [(name.replace("_", " "), str(value)) for name, value in content["said"].items()]
    show_table(content["verdict"], [*rows, ("kept in", str(folder))])
    for command in content.get("commands", ()):
        print(f"  {command}")


@contextmanager
def vehicles_of(search: Search, case: "Case", folder: Path) -> "Iterator[Vehicles]":
    """Flights of a case in threads, kept in the folder whatever happens."""
    from ahv_analysis.campaign.vehicles import Vehicles

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot hold a search: {error.strerror}") from error
    with (
        executor_of(search.workers, None) as pool,
        progress_bar(f"search with {case.name}", None, search.hidden, unit="flights") as progress,
        signals_wait() as interrupted,
    ):
        flights = Vehicles(case, folder / "flown.parquet", pool, progress, interrupted)
        interrupted_says(lambda: f"after {flights.asked} flights; the same command resumes")
        try:
            yield flights
        finally:
            flights.save()


def _worst(search: Search, level: float, starts: int) -> dict[str, Any]:
    from ahv_analysis.bag.record import record_of
    from ahv_analysis.campaign.vehicles import vehicle_case
    from ahv_analysis.campaign.worst import find_worst
    from ahv_analysis.flight.library import fly as fly_steps
    from ahv_analysis.report.worst_figure import draw_worst

    case, words, folder = search.case, search.words, search.folder
    with vehicles_of(search, case, folder) as flights:
        found = find_worst(flights.fly, level, starts, search.seed)
        asked = flights.asked
    multipliers = _named(found.dispersion)
    severe = vehicle_case(case, found.dispersion)
    file = folder / "worst.yaml"
    lines = "".join(f"    dispersion.{name}: {value!r}\n" for name, value in multipliers.items())
    text = f"/ahv/plant:\n  ros__parameters:\n{lines}"
    bag, page, verdict = _fly(severe, folder, text, search.hidden)
    command = " ".join(["ahv fly", *search.options, f"--dispersion {file}", "--out flights/worst"])
    at_edges = sum(abs(abs(value - 1.0) - level) < 1e-9 for value in multipliers.values())
    title = (
        f"{', '.join(words)}: the worst of {asked} vehicles at {level:g}, "
        f"{'lost' if found.lost else 'kept'}: {verdict}"
    )
    content = {
        "case": case.name,
        "hardware_and_profile": words[1:],
        "level": level,
        "seed": search.seed,
        "flights": asked,
        "dispersion": multipliers,
        "lost": found.lost,
        "severity": found.severity,
        "corner_severity": found.corner_severity,
        "lost_corners": found.lost_corners,
        "starts": [{"start": one.words, "severity": one.best[-1]} for one in found.starts],
        "bag": str(bag),
        "page": str(page),
        "out": str(folder),
        "verdict": title,
        "said": {
            "vehicle": ", ".join(f"{name} {value:.4g}" for name, value in multipliers.items()),
            "multipliers at an end": f"{at_edges} of {len(multipliers)}",
            "severity": f"{found.severity:.4f} (max |alpha| [deg]; beyond 5 lost, sooner is more)",
            "lost corners": f"{found.lost_corners} of 512",
            "worst of each start": ", ".join(
                f"{one.words} {one.best[-1]:.4f}" for one in found.starts
            ),
            "page": str(page),
        },
        "commands": [command],
    }
    records = {
        name: record_of(fly_steps(one), one.plant.truth.geometric)
        for name, one in (("nominal vehicle", vehicle_case(case, _ones())), ("worst", severe))
    }
    wrapped = "\n".join(textwrap.wrap(title, 130))
    figure = draw_worst(found.dispersion, level, records, found.starts, wrapped)
    _write(folder, "worst", content, figure, {file: text})
    return content


def _ones() -> Any:
    import numpy as np

    from ahv_plant.dispersion import Dispersion

    return np.ones(len(Dispersion._fields))


def _named(dispersion: Any) -> dict[str, float]:
    from ahv_plant.dispersion import Dispersion

    return dict(zip(Dispersion._fields, map(float, dispersion), strict=True))


def _fly(case: "Case", folder: Path, text: str, hidden: bool) -> tuple[Path, Path, str]:
    """Fly the vehicle into a bag, unless the folder has it, and write its page."""
    from ahv_analysis.flight.library import fly_library
    from ahv_analysis.report.page import draw_figures, render
    from ahv_analysis.report.page_flight import read_flights

    flight = folder / f"flight-{crc32(text.encode()):08x}"
    page = flight / "page.html"
    if not page.exists():
        if not (flight / "bag").exists():
            with progress_bar("the worst vehicle", case.plant.steps, hidden) as progress:
                fly_library(case, flight / "bag", progress=progress)
        (read,) = read_flights([flight / "bag"])
        with signals_wait():
            html = render([read], draw_figures(read))
            page.write_text(html, encoding="utf-8", errors="backslashreplace")
    else:
        (read,) = read_flights([flight / "bag"])
    return flight / "bag", page, read.verdict.reason


def _radius(search: Search, level: float, over: str | None) -> dict[str, Any]:
    from ahv_analysis.campaign.worst import bisect
    from ahv_analysis.report.worst_figure import draw_radius
    from ahv_plant.dispersion import HIGHEST_LEVEL

    case, words, folder = search.case, search.words, search.folder
    flights: int | None = None
    if over is None:
        found, flights = _largest_level(search)
        name, unit, label = "level", "", "level [-]"
    else:
        axis, ends = _axis(over)
        name, unit, label = axis.name, axis.unit, axis.title

        def probe(value: float) -> "Probe":
            return _probe_at(search, axis, value, level)

        found = bisect(probe, *ends, _resolution(axis, ends))
    said = radius_words(found, name, unit, HIGHEST_LEVEL if over is None else None)
    title = f"{', '.join(words)}{'' if over is None else f' at level {level:g}'}: {said}"
    content: dict[str, Any] = {
        "case": case.name,
        "hardware_and_profile": words[1:],
        "over": name,
        "unit": unit,
        "level": None if over is None else level,
        "seed": search.seed,
        "kept": found.kept,
        "lost": found.lost,
        "flights": flights,
        "probes": [one._asdict() | {"dispersion": _named(one.dispersion)} for one in found.probes],
        "bound": "by search, not a proof",
        "out": str(folder),
        "verdict": title,
        "said": {
            f"{name} {one.value:g} {unit}".rstrip(): f"{'lost' if one.lost else 'no loss found'}, "
            f"severity {one.severity:.3f}"
            for one in sorted(found.probes)
        },
    }
    figure = draw_radius(found, label, "\n".join(textwrap.wrap(title, 80)))
    _write(folder, "radius", content, figure, {})
    return content


def radius_words(found: "Radius", name: str, unit: str, most: float | None) -> str:
    """Where losses begin, in a sentence."""
    bound = "a bound by search, not a proof"
    if found.kept is None:
        return f"a vehicle is lost at {name} {found.lost:g} {unit}".rstrip() + " already"
    if found.lost is None:
        return f"no loss is found up to {name} {found.kept:g} {unit}".rstrip() + f" ({bound})"
    ends = f"no loss is found at {name} {found.kept:g}, and a lost vehicle at {found.lost:g}"
    return f"{ends} {unit}".rstrip() + f" ({bound})"


def _largest_level(search: Search) -> "tuple[Radius, int]":
    from ahv_analysis.campaign.worst import Probe, bisect, find_lost
    from ahv_plant.dispersion import HIGHEST_LEVEL

    with vehicles_of(search, search.case, search.folder) as flights:

        def probe(value: float) -> Probe:
            vehicle, severity = find_lost(flights.fly, value, search.seed)
            return Probe(value, severity, vehicle.tolist())

        return bisect(probe, 0.0, HIGHEST_LEVEL, RESOLUTION), flights.asked


def _probe_at(search: Search, axis: "Axis", value: float, level: float) -> "Probe":
    """Search the box at one value of a parameter, in a folder of its own."""
    from ahv_analysis.campaign.axis import with_value
    from ahv_analysis.campaign.worst import Probe, find_lost
    from ahv_analysis.flight.case import make_case

    case = search.case
    at = make_case(case.name, with_value(case.parameters, axis.places, value))
    with vehicles_of(search, at, search.folder / f"{axis.name}={value:.12g}") as flights:
        vehicle, severity = find_lost(flights.fly, level, search.seed)
    return Probe(value, severity, vehicle.tolist())


def _axis(over: str) -> "tuple[Axis, tuple[float, float]]":
    """Parameter to go over, and its ends as they were written: kept first."""
    from ahv_analysis.campaign.axis import LEVEL, read_axis
    from ahv_analysis.campaign.condition import CONDITIONS

    name, equals, numbers = over.partition("=")
    kept, colon, lost = numbers.partition(":")
    if not (name and equals and colon and kept and lost) or ":" in lost:
        raise UsageError(f"--over {over!r} must be NAME=KEPT:LOST")
    if name in CONDITIONS or name == LEVEL.name:
        raise UsageError(f"--over takes a parameter of a node, and {name} is none")
    axis = read_axis(f"{name}={kept},{lost}" if _rising(kept, lost) else f"{name}={lost},{kept}")
    low, high = axis.values[0], axis.values[-1]
    return axis, ((low, high) if _rising(kept, lost) else (high, low))


def _rising(kept: str, lost: str) -> bool:
    try:
        return float(kept) < float(lost)
    except ValueError:
        raise UsageError(f"--over: {kept!r} and {lost!r} must be numbers") from None


def _resolution(axis: "Axis", ends: tuple[float, float]) -> float:
    """Whole steps of a delay, else a part of the range."""
    from ahv_analysis.campaign.draws import IN_STEPS
    from ahv_plant.model.constants import STEP

    return STEP if axis.name in IN_STEPS else abs(ends[1] - ends[0]) / PARTS


def _write(
    folder: Path, name: str, content: dict[str, Any], figure: Any, texts: dict[Path, str]
) -> None:
    from ahv_analysis.report.picture import save_picture

    with results_in(folder):
        save_picture(figure, folder / f"{name}.png")
        kept = {key: value for key, value in content.items() if key != "said"}
        write_numbers(folder / f"{name}.json", kept)
        for path, text in texts.items():
            path.write_text(text, encoding="utf-8")
