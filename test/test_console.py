# Copyright 2026 ahv developers, Apache-2.0
"""What a progress bar says."""

import numba

from ahv_analysis.command import console


def test_a_progress_bar_says_that_something_is_compiled(monkeypatch):
    said = []
    monkeypatch.setattr(
        console.Progress, "update", lambda bar, task, **what: said.append(what["description"])
    )

    @numba.njit
    def inner(x):
        return x + 1.0

    @numba.njit
    def outer(x):
        return inner(x)

    with console.progress_bar("flying", 1, hidden=False):
        outer(1.0)
        outer(2.0)  # compiled already
    inner(1)  # nobody listens any more
    assert said[0] == "flying: compiling, once" and said[-1] == "flying"
    assert said.count("flying") == 1
