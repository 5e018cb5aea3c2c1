# Copyright 2026 ahv developers, Apache-2.0
"""Entry point of the command `ahv`, and the world that it runs in."""

import os
import sys

from ahv_analysis.interrupt import do_the_last, end_on_signals, let_no_signal_end


def main() -> None:
    """Run the command."""
    end_on_signals()
    prepare()
    from ahv_analysis.command.app import app  # seconds, in which a signal may come already

    try:
        app()
    except SystemExit as end:
        let_no_signal_end()
        do_the_last(int(end.code or 0))
        raise
    finally:
        let_no_signal_end()


def prepare() -> None:
    """Take what is odd out of the way: no output fails for it."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # closed by the shell
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    if os.environ.get("COLUMNS") == "0":
        del os.environ["COLUMNS"]  # rich would print tables of no width
    os.environ["MPLBACKEND"] = "agg"  # figures go to files, whatever a notebook draws on


if __name__ == "__main__":
    main()
