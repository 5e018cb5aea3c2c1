# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv compare`: two campaigns or two flights, for people and as a gate."""

from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ahv_analysis.command.console import Json, UsageError, print_json, show_table
from ahv_analysis.command.results import results_in, write_numbers

if TYPE_CHECKING:  # it takes long to load
    from matplotlib.figure import Figure

    from ahv_analysis.campaign.compare import Comparison
    from ahv_analysis.junit import Check
    from ahv_analysis.report.flight_difference import FlightDifference

WORSE = 0.05  # McNemar's p below which B that keeps fewer is worse
LISTED = 10  # runs that are printed of each kind


def compare(
    a: Annotated[Path, typer.Argument(help="Folder of a campaign, or of a flight or its bag.")],
    b: Annotated[Path, typer.Argument(help="Another of the same kind.")],
    level: Annotated[float | None, typer.Option(help="Level, if there are several.")] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=NUMBER",
            help="How much a quantity may differ, in its unit; NAME may be a pattern such as '*'.",
        ),
    ] = None,
    junit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the result as JUnit XML too.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for compare.png and compare.json.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare two campaigns of the same draws, or two flights.

    Campaigns are paired run by run: who saves whom, McNemar's exact test, and how every metric
    differs. Exit code 1 if B keeps fewer vehicles than A and p < 0.05, or the mean of a metric
    differs by more than its --tolerance. Flights: exit code 1 if a quantity differs by more than
    its --tolerance, which is 0, the same bits, where none is given.
    """
    from ahv_analysis.junit import write_junit
    from ahv_analysis.report.picture import save_picture

    allowed = _tolerances(tolerance or [])
    kinds = [_is_campaign(folder) for folder in (a, b)]
    if kinds[0] != kinds[1]:
        raise UsageError(f"{a} and {b} are a campaign and none: compare two of the same kind")
    if not kinds[0] and level is not None:
        raise UsageError("--level is for campaigns, and these are flights")
    compared = _campaigns(a, b, level, allowed) if kinds[0] else _flights(a, b, allowed)
    content, checks, figure = compared
    folder = out or Path("comparisons") / "-".join(_names(a, b))
    content |= {"passed": all(check.passed for check in checks), "out": str(folder)}
    with results_in(folder):
        save_picture(figure, folder / "compare.png")
        write_numbers(folder / "compare.json", content)
        if junit is not None:
            write_junit(junit, "ahv compare", checks)
    if as_json:
        print_json(content)
    elif kinds[0]:
        _show_campaigns(content, a, b, level)
    else:
        _show_flights(content, a, b)
    if not content["passed"]:
        raise typer.Exit(1)


def _is_campaign(folder: Path) -> bool:
    if not folder.is_dir():
        raise UsageError(f"there is no folder {folder}")
    return any(folder.glob("runs-*"))


def _names(a: Path, b: Path) -> tuple[str, str]:
    """As much of the ends of two paths as tells them apart."""
    one, other = (
        path.parent if path.name == "bag" else path for path in (a.resolve(), b.resolve())
    )
    if one.name != other.name or one == other:
        return one.name, other.name
    return f"{one.parent.name}-{one.name}", f"{other.parent.name}-{other.name}"


def _tolerances(texts: list[str]) -> dict[str, float]:
    """Tolerances by pattern, as they were written."""
    found = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = -1.0
        if not name or not 0.0 <= value < float("inf"):
            raise UsageError(f"--tolerance {text!r} must be NAME=NUMBER, a number from 0 on")
        found[name] = value
    return found


def _matched(allowed: dict[str, float], names: list[str]) -> dict[str, float]:
    """Tolerance of each name that has one: the last that fits."""
    for pattern in allowed:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise UsageError(f"--tolerance: there is no {pattern!r}; valid are {', '.join(names)}")
    return {
        name: value
        for pattern, value in allowed.items()
        for name in names
        if fnmatchcase(name, pattern)
    }


def _campaigns(
    a: Path, b: Path, level: float | None, allowed: dict[str, float]
) -> "tuple[dict[str, Any], list[Check], Figure]":
    from ahv_analysis.campaign.campaign import open_campaign
    from ahv_analysis.campaign.compare import compare as compare_campaigns
    from ahv_analysis.report.compare_figure import draw_comparison

    one, other = open_campaign(a, level), open_campaign(b, level)
    found = compare_campaigns((one, a), (other, b))
    within = _matched(allowed, [metric.name for metric in found.metrics])
    content = {
        "a": str(a),
        "b": str(b),
        "cases": [one.case.name, other.case.name],
        "level": one.level,
        "seed": one.seed,
        "apart": found.apart,
        "runs": found.runs,
        "kept_by_both": found.kept_by_both,
        "only_a": found.only_a,
        "only_b": found.only_b,
        "p_value": found.p_value,
        "rates": found.rates,
        "intervals": found.intervals,
        "difference": found.difference,
        "identical": found.identical,
        "differ": found.differ,
        "metrics": [
            metric._asdict() | {"beyond_rounding": metric.tells} for metric in found.metrics
        ],
        "verdict": verdict(found),
    }
    level_words = f"level {one.level:g}, seed {one.seed}, {found.runs} runs"
    title = f"A: {a} ({one.case.name})   B: {b} ({other.case.name})\n{level_words}: "
    figure = draw_comparison(found, _names(a, b), title + verdict(found))
    return content, _checks(found, within), figure


def verdict(found: "Comparison") -> str:
    """The comparison of two campaigns in one sentence."""
    gained, lost = len(found.only_b), len(found.only_a)
    if found.identical:
        return "no value of any run differs"
    if not gained and not lost:
        return "both keep and lose the same vehicles"
    if found.p_value >= WORSE:
        return (
            f"B keeps {gained} vehicles that A loses and loses {lost} that A keeps, "
            f"no more than chance (p = {found.p_value:.2g})"
        )
    better, worse = ("B", "A") if gained > lost else ("A", "B")
    return (
        f"{better} is better: it keeps {max(gained, lost)} vehicles that {worse} loses, and loses "
        f"{min(gained, lost)} that {worse} keeps (p = {found.p_value:.2g})"
    )


def _checks(found: "Comparison", within: dict[str, float]) -> "list[Check]":
    from ahv_analysis.junit import Check

    worse = found.p_value < WORSE and len(found.only_a) > len(found.only_b)
    checks = [Check("B keeps as many vehicles as A", verdict(found), not worse)]
    for one in found.metrics:
        if one.name in within:
            said = f"mean difference {one.mean:.6g} {one.unit}, allowed {within[one.name]:g}"
            checks.append(Check(one.name, said, abs(one.mean) <= within[one.name]))
    return checks


def _show_campaigns(content: dict[str, Any], a: Path, b: Path, level: float | None) -> None:
    rates = [
        f"{rate:.2%} ({low:.2%} to {high:.2%})"
        for rate, (low, high) in zip(content["rates"], content["intervals"], strict=True)
    ]
    only_a, only_b = content["only_a"], content["only_b"]
    lost = content["runs"] - content["kept_by_both"] - len(only_a) - len(only_b)
    mean, low, high = content["difference"]
    rows = [
        ("A", f"{a}: {rates[0]}"),
        ("B", f"{b}: {rates[1]}"),
        ("kept by both, by A, by B, by none", _counts(content, lost)),
        ("B less A", f"{100 * mean:+.2f} % ({100 * low:+.2f} to {100 * high:+.2f}) of the runs"),
        ("McNemar, exact", f"p = {content['p_value']:.3g}"),
        ("apart in", content["apart"] or "nothing that is set"),
    ]
    for one in content["metrics"]:
        if one["differ"]:
            value = (
                f"{one['mean_a']:.5g} and {one['mean_b']:.5g} {one['unit']}: {one['mean']:+.3g}"
            )
            rows.append((one["name"], f"{value} ({one['low']:+.3g} to {one['high']:+.3g})"))
    rows.append(("kept in", content["out"]))
    show_table(f"{content['runs']} runs, {content['verdict']}", rows)
    said = "" if level is None else f" --level {level:g}"
    for runs, who, loser in ((only_a, "A", b), (only_b, "B", a)):
        if runs:
            print(f"only {who} keeps {len(runs)}; fly the first of them in the other again:")
            for run in runs[:LISTED]:
                print(f"  ahv monte-carlo rerun {loser} {run}{said}")


def _counts(content: dict[str, Any], lost: int) -> str:
    one, other = len(content["only_a"]), len(content["only_b"])
    return f"{content['kept_by_both']}, {one}, {other}, {lost}"


def _flights(
    a: Path, b: Path, allowed: dict[str, float]
) -> "tuple[dict[str, Any], list[Check], Figure]":
    from ahv_analysis.bag.reader import read_bag
    from ahv_analysis.junit import Check
    from ahv_analysis.quantities import QUANTITIES
    from ahv_analysis.report.compare_figure import draw_flights
    from ahv_analysis.report.flight_difference import compare_flights, flight_bag

    within = _matched(allowed, [one.name for one in QUANTITIES])
    found = compare_flights(a, b, lambda name: within.get(name, 0.0))
    content = {
        "a": str(a),
        "b": str(b),
        "compared": found.compared,
        "only_a": found.only_a,
        "only_b": found.only_b,
        "of_one": found.of_one,
        "quantities": [one._asdict() for one in found.quantities],
        "beyond": found.beyond,
    }
    apart = ", ".join(found.beyond) or "nothing"
    whole = not (found.only_a or found.only_b or found.of_one)
    counts = f"{found.compared} states in both, {found.only_a} and {found.only_b} in one alone"
    checks = [Check("the same states and quantities", counts, whole)]
    for one in found.quantities:
        largest = "no number" if one.largest is None and one.differ else f"{one.largest or 0.0:g}"
        said = f"largest difference {largest} {one.unit}, allowed {one.tolerance:g}"
        checks.append(Check(one.name, said, not one.beyond))
    records = read_bag(flight_bag(a)), read_bag(flight_bag(b))
    title = f"A: {a}   B: {b}\nbeyond tolerance: {_shortened(found)}"
    content["verdict"] = f"beyond tolerance: {apart}"
    return content, checks, draw_flights(found, records, _names(a, b), title)


def _shortened(found: "FlightDifference") -> str:
    beyond = found.beyond
    more = f" and {len(beyond) - 5} more" if len(beyond) > 5 else ""
    return (", ".join(beyond[:5]) or "nothing") + more


def _show_flights(content: dict[str, Any], a: Path, b: Path) -> None:
    rows = [
        ("states", f"{content['compared']} in both"),
        ("only in A, only in B", f"{content['only_a']}, {content['only_b']}"),
        ("quantities of one alone", ", ".join(content["of_one"]) or "none"),
    ]
    for one in content["quantities"]:
        if one["differ"]:
            largest = "no number" if one["largest"] is None else f"{one['largest']:+.3g}"
            mark = "beyond" if one["beyond"] else "within"
            words = f"{largest} {one['unit']} at {one['at_s']:.2f} s, from {one['first_s']:.2f} s"
            rows.append((one["name"], f"{words} on; {mark} {one['tolerance']:g}"))
    if not any(one["differ"] for one in content["quantities"]):
        rows.append(("differences", "none, to the last bit"))
    rows.append(("kept in", content["out"]))
    show_table(f"{b} against {a}", rows)
