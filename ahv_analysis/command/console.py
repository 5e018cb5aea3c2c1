# Copyright 2026 ahv developers, Apache-2.0
"""What the commands share: tables, progress, numbers, and errors in one sentence."""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from ahv_plant.numerics.compiling import told_of_compiling


class Terminal(Console):
    """A console that takes text as it is, and leaves a broken pipe to who calls."""

    def __init__(self, **options: Any):
        super().__init__(markup=False, emoji=False, **options)

    def on_broken_pipe(self) -> None:
        """Called while the error is handled."""
        raise


console = Terminal()
HIGHEST_DOMAIN = 232
HardwareChoice = Annotated[
    str | None,
    typer.Option(
        "--hardware",
        metavar="NAME|FILE",
        help="What the vehicle moves and measures with: ideal, typical, poor, or a YAML file.",
    ),
]
ProfileChoice = Annotated[
    str | None,
    typer.Option(
        "--profile",
        metavar="NAME|FILE",
        help="What is flown, instead of one altitude and speed: a name, or a YAML file.",
    ),
]
LawChoice = Annotated[
    str | None,
    typer.Option(
        "--law",
        metavar="NAME|FILE",
        help="Law that flies in the place of the case's: a name, or a Python file.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


def number(text: str) -> float:
    """Read an option that is a number."""
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a number") from None


def words_of(*choices: str | None) -> list[str]:
    """Names of hardware, profile and such, for folders and titles; none for the case's own."""
    return [Path(choice).stem for choice in choices if choice is not None]


def number_option(unit: str, meaning: str) -> Any:
    """Return an option that is a number of a unit."""
    return typer.Option(help=f"{meaning} [{unit}].", parser=number, metavar="NUMBER")


def integer_option(meaning: str, minimum: int = 0) -> Any:
    """Return an option or argument that is an integer of at least `minimum`."""

    def integer(text: str | int) -> int:
        try:
            value = int(text)
        except ValueError:
            value = minimum - 1
        if value < minimum:
            raise typer.BadParameter(f"{text!r} is not an integer from {minimum} on")
        return value

    return typer.Option(help=meaning, parser=integer, metavar="INTEGER")


class UsageError(Exception):
    """Something asked for that cannot be had; one sentence, exit code 2."""


def check_domain() -> None:
    """Refuse a ROS domain that Fast DDS would refuse on stdout."""
    domain = os.environ.get("ROS_DOMAIN_ID", "0")
    if not (domain.isascii() and domain.isdigit() and int(domain) <= HIGHEST_DOMAIN):
        raise UsageError(f"ROS_DOMAIN_ID is {domain!r}, but must be 0 to {HIGHEST_DOMAIN}")


def print_json(content: dict[str, Any]) -> None:
    """Print one JSON object; there is no NaN in JSON."""
    print(json.dumps(content, allow_nan=False))


class _RateColumn(ProgressColumn):
    """Work done a second."""

    def __init__(self, unit: str):
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> Text:
        """Show the rate once there is one."""
        return Text(f"{task.speed:.0f} {self._unit}/s" if task.speed else "")


class Reported:
    """Passes progress on, and knows the first and the last of it."""

    def __init__(self, progress: Callable[[int], None]):
        self._progress = progress
        self.first: int | None = None
        self.last = -1

    def __call__(self, done: int) -> None:
        """Take the work done so far."""
        self.first = done if self.first is None else self.first
        self.last = done
        self._progress(done)


@contextmanager
def progress_bar(
    title: str, total: int | None, hidden: bool, unit: str = "steps"
) -> Iterator[Callable[[int], None]]:
    """Progress on the terminal (stderr); the function it gives takes the work done so far."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        _RateColumn(unit),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Terminal(stderr=True), disable=hidden, transient=True) as bar:
        task = bar.add_task(title, total=total)

        def tell(compiling: bool) -> None:
            bar.update(task, description=title + (": compiling, once" if compiling else ""))

        with told_of_compiling(tell):
            yield lambda done: bar.update(task, completed=done)


def show_table(title: str, rows: list[tuple[str, str]]) -> None:
    """Print a table of names and values."""
    print(title)
    sheet = Table(show_header=False)
    for name, value in rows:
        sheet.add_row(name, value)
    console.print(sheet)


def show_rows(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table with a head."""
    print(title)
    sheet = Table()
    for name in head:
        sheet.add_column(name)
    for row in rows:
        sheet.add_row(*row)
    console.print(sheet)


def show_columns(title: str, *rows: Sequence[str]) -> None:
    """Print rows under each other in columns, the first of them a head."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    print("\n".join([title, *lines]))
