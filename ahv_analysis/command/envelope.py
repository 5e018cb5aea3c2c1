# Copyright 2026 ahv developers, Apache-2.0
"""What `ahv trim --map` makes: the envelope of level flight as a table and as a picture."""

import time
from itertools import groupby, product
from math import isfinite
from pathlib import Path
from typing import Any

from ahv_analysis.command.console import UsageError, print_json
from ahv_analysis.ranges import Values, read_values
from ahv_plant.dispersion import Truth
from ahv_plant.envelope import EnvelopePoint, envelope_point
from ahv_plant.model.aerodynamics import MACH_MINIMUM
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.flight_condition import MACH_MAXIMUM, check_flight_condition
from ahv_plant.model.limits import LIMITS, NOT_FOUND

ALTITUDES, MACHS, MASSES = "20:34km", "4:10", "80,110,140t"
ROWS, COLUMNS = 15, 25  # altitudes and Mach numbers of a range that has no COUNT
MOST_MASSES = 6  # that a picture has room for
MOST_POINTS = 200_000  # some 10 s


def make_envelope(
    altitude: str | None,
    mach: str | None,
    mass: str | None,
    geometric: bool,
    out: Path | None,
    as_json: bool,
) -> int:
    """Trim at every point, keep table and picture, and say how many have a trim."""
    from ahv_analysis.point_file import write_points
    from ahv_analysis.report.envelope_figure import Grid, draw_envelope
    from ahv_analysis.report.picture import save_picture

    grid = Grid(
        read_values("--altitude", ALTITUDES if altitude is None else altitude, "m", ROWS),
        read_values("--mach", MACHS if mach is None else mach, "", COLUMNS),
        read_values("--mass", MASSES if mass is None else mass, "kg", ROWS, least=1),
    )
    _check(grid.altitudes, grid.machs, grid.masses, geometric)
    folder = out or Path("maps") / "trim"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot hold a map: {error.strerror}") from error
    started = time.perf_counter()
    points = [
        envelope_point(h, mach_number, m, Truth(geometric))
        for m, h, mach_number in product(
            grid.masses.numbers, grid.altitudes.numbers, grid.machs.numbers
        )
    ]
    wall = time.perf_counter() - started
    described: dict[str, Any] = {
        "geometric": geometric,
        "limits": {limit.name: limit._asdict() for limit in LIMITS},
        "altitude": {"unit": "m", "values": grid.altitudes.numbers},
        "mach": {"unit": "", "values": grid.machs.numbers},
        "mass": {"unit": "kg", "values": grid.masses.numbers},
    }
    rows = [_row(point) for point in points]
    write_points(folder, "trim", rows, described)
    title = _title(geometric)
    save_picture(draw_envelope(points, grid, title), folder / "trim.png")
    trimmed = sum(point.within_limits for point in points)
    if as_json:
        print_json({**described, "points": rows, "wall_s": wall, "out": str(folder)})
    else:
        print(f"{title}\n\n{_table(points, grid.altitudes, grid.machs, grid.masses)}\n")
        print(f"{trimmed} of {len(points)} points have a trim; {wall:.1f} s; kept in {folder}")
    return trimmed


def _check(altitudes: Values, machs: Values, masses: Values, geometric: bool) -> None:
    """Raise UsageError, before anything is done, where the vehicle model does not hold."""
    for mach in machs.numbers:
        if not MACH_MINIMUM <= mach <= MACH_MAXIMUM:
            raise UsageError(
                f"--mach is {mach:g}, but must be from {MACH_MINIMUM:g} to {MACH_MAXIMUM:g}"
            )
    if len(masses.numbers) > MOST_MASSES:
        raise UsageError(
            f"--mass has {len(masses.numbers)} values, but a picture has room for {MOST_MASSES}"
        )
    count = len(altitudes.numbers) * len(machs.numbers) * len(masses.numbers)
    if count > MOST_POINTS:
        raise UsageError(f"the map has {count} points, but must have {MOST_POINTS} or less")
    for height, mass in product(altitudes.numbers, masses.numbers):
        speed = machs.numbers[0] * atmosphere(height, geometric).sound_speed
        try:
            check_flight_condition(height, speed, mass, geometric)
        except ValueError as error:
            raise UsageError(error) from error


def _row(point: EnvelopePoint) -> dict[str, Any]:
    """Point for files, in which nothing stands where there is no number."""
    return {
        name: None if isinstance(value, float) and not isfinite(value) else value
        for name, value in point._asdict().items()
    }


def _title(geometric: bool) -> str:
    limits = ", ".join(
        f"{limit.name} {limit.low:g} to {limit.high:g} {limit.unit}".rstrip() for limit in LIMITS
    )
    kind = "geometric" if geometric else "geopotential"
    return f"Level flight of the nominal vehicle, {kind} altitude; limits: {limits}"


def _table(points: list[EnvelopePoint], altitudes: Values, machs: Values, masses: Values) -> str:
    """Mach numbers with a trim, a row an altitude and a column a mass."""
    rows = {(point[0].altitude_m, point[0].mass_kg): _cell(point) for point in _lines(points)}
    lines = [[f"altitude [{altitudes.unit}]", *(f"{m:g} {masses.unit}" for m in masses.written)]]
    for altitude, written in zip(altitudes.numbers[::-1], altitudes.written[::-1], strict=True):
        lines.append([f"{written:g}", *(rows[altitude, mass] for mass in masses.numbers)])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    text = [
        "  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True))
        for line in lines
    ]
    low, high = machs.numbers[0], machs.numbers[-1]
    said = (
        f"Mach numbers with a trim, of {low:g} to {high:g}; in brackets the limits that end them"
    )
    return "\n".join([said, "", *text])


def _lines(points: list[EnvelopePoint]) -> list[list[EnvelopePoint]]:
    """Points of each mass and altitude, over the Mach number."""
    return [
        list(line)
        for _, line in groupby(points, key=lambda point: (point.mass_kg, point.altitude_m))
    ]


def _cell(line: list[EnvelopePoint]) -> str:
    """Spans of Mach numbers with a trim, and between them what their neighbours pass."""
    words = []
    spans = [list(span) for _, span in groupby(line, key=lambda point: point.within_limits)]
    for i, span in enumerate(spans):
        low, high = span[0], span[-1]
        if low.within_limits:
            words.append(f"{low.mach:g}" if len(span) == 1 else f"{low.mach:g} to {high.mach:g}")
        else:
            ends = ([low] if i > 0 else []) + ([high] if i + 1 < len(spans) else [])
            words.append(f"({_passed(ends or span)})")
    return " ".join(words) if len(spans) > 1 or line[0].within_limits else f"none {words[0]}"


def _passed(points: list[EnvelopePoint]) -> str:
    reasons = " ".join(point.why_not for point in points)
    names = [limit.name for limit in LIMITS if limit.name in reasons]
    return ", ".join(names + (["not found"] if NOT_FOUND in reasons else []))
