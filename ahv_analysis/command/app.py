# Copyright 2026 ahv developers, Apache-2.0
"""The commands of `ahv` together, and how their errors end."""

import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from ahv_analysis.command.bag import bag
from ahv_analysis.command.campaign import monte_carlo, table
from ahv_analysis.command.compare import compare
from ahv_analysis.command.console import UsageError, print_json
from ahv_analysis.command.faults import faults
from ahv_analysis.command.figures import figures
from ahv_analysis.command.fly import CaseCommand, fly
from ahv_analysis.command.linearise import linearise
from ahv_analysis.command.map import map_rates
from ahv_analysis.command.rare import rare
from ahv_analysis.command.replay import replay
from ahv_analysis.command.report import report
from ahv_analysis.command.sensitivity import sensitivity
from ahv_analysis.command.trim import trim
from ahv_analysis.command.worst import worst
from ahv_analysis.errors import BagError, CampaignError, CampaignStopped, GraphError
from ahv_msgs_py.parameters import ParameterError

WRONG_INPUT = (UsageError, ParameterError, BagError, CampaignError, OSError)
MISUSE = typer.BadParameter.__mro__[2]  # of wrong options; typer has no name for it
IN_ORDER = (
    "fly",
    "figures",
    "report",
    "bag",
    "replay",
    "monte-carlo",
    "table",
    "map",
    "compare",
    "sensitivity",
    "worst",
    "rare",
    "faults",
    "trim",
    "linearise",
)
UNREAD = 141  # as a shell says of a tool whose reader has gone


class Commands(TyperGroup):
    """All commands, and the one place where their errors end."""

    def list_commands(self, context: Any) -> list[str]:
        """Names in the order of a user's day."""
        return list(IN_ORDER)

    def parse_args(self, context: Any, arguments: list[str]) -> list[str]:
        """Read the options before a command's name."""
        context.obj = "--json" in arguments
        with errors_in_a_sentence(context.obj):
            return super().parse_args(context, arguments)

    def invoke(self, context: Any) -> Any:
        """Run what was asked for."""
        with errors_in_a_sentence(context.obj):
            super().invoke(context)


@contextmanager
def errors_in_a_sentence(as_json: bool) -> Iterator[None]:
    """Turn errors into a sentence, or one JSON object, and an exit code; nobody sees a traceback.

    What a program does that it should not is not caught.
    """
    try:
        try:
            yield
        except typer.Exit:  # all is said then too
            _flush()
            raise
        _flush()
    except MISUSE as error:
        if not as_json:
            raise  # with a hint at the help
        _refuse(error.format_message(), as_json, 2)  # type: ignore[attr-defined]
    except WRONG_INPUT as error:
        if isinstance(error, BrokenPipeError) and _unread():
            _give_up_output()
            raise typer.Exit(UNREAD) from None
        _refuse(str(error), as_json, 2)
    except (GraphError, CampaignStopped) as error:
        _refuse(str(error), as_json, 1)


def _flush() -> None:
    if sys.stdout is not None:  # closed by the shell
        sys.stdout.flush()


def _refuse(sentence: str, as_json: bool, code: int) -> None:
    try:
        if as_json:
            print_json({"error": sentence})
        _flush()
    except OSError:  # it is about standard output
        _give_up_output()
        as_json = False
    if not as_json:
        print(f"ahv: {sentence}", file=sys.stderr)
    raise typer.Exit(code)


def _give_up_output() -> None:
    """Let Python flush what it holds without complaint."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def _unread() -> bool:
    """Whether nobody reads what this process prints."""
    poll = select.poll()
    poll.register(1, 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


app = typer.Typer(
    cls=Commands,
    help="Fly an air-breathing hypersonic vehicle and look at its flights.",
    context_settings={"help_option_names": ["-h", "--help"]},
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command(cls=CaseCommand)(fly)
app.command()(figures)
app.command()(report)
app.add_typer(bag, name="bag")
app.command()(replay)
app.add_typer(monte_carlo, name="monte-carlo")
app.command()(table)
app.command(name="map")(map_rates)
app.command()(compare)
app.command()(sensitivity)
app.command()(worst)
app.command()(rare)
app.add_typer(faults, name="faults")
app.command()(trim)
app.command()(linearise)


def _print_version(asked: bool) -> None:
    if asked:
        from ahv_analysis.versions import versions

        found = versions()
        print(f"ahv {found['ahv']}, source {found['source']}")
        raise typer.Exit


@app.callback()
def main(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Print what commands there are, if none is given."""
    if context.invoked_subcommand is None:
        print(context.get_help())
