# Copyright 2026 ahv developers, Apache-2.0
"""A signal ends a command in order: one sentence, 128 and the signal, a bag that is whole."""

import signal
import subprocess
import sys
import threading

import pytest

from ahv_analysis.interrupt import signals_wait
from test.interrupt import AHV, WAYS, fault, interrupted, try_moments
from test.waiting import PATIENCE


@pytest.mark.parametrize("ways", WAYS[:4], ids=" ".join)
def test_ctrl_c_in_a_flight(ways, tmp_path):
    command = [AHV, "fly", "nominal_di", "--out", "out", *ways]
    command[command.index("--duration") + 1] = "1000"
    end = interrupted(command, tmp_path, lambda said: b"\xe2\x94\x81" in said)
    assert fault(end, "INT", tmp_path / "out" / "bag") == "", end.said


def test_ctrl_c_while_a_campaign_compiles(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    command = [AHV, "monte-carlo", "--controller", "nominal_di", "--out", "out"]
    end = interrupted(command, tmp_path, lambda said: b"compiling, once" in said)
    assert fault(end, "INT", tmp_path / "out" / "bag") == "", end.said
    assert "interrupted after 0 of 1000 runs; the same command resumes" in end.said


@pytest.mark.slow
@pytest.mark.parametrize("ways", WAYS, ids=" ".join)
def test_signals_at_random_moments(ways):
    assert try_moments(("fly", "neuro_adaptive_di", *ways), 8.0, 12, seed=7) == []


def program(lines, number=signal.SIGINT):
    """Run a program that sends itself signals."""
    head = "import os, signal\nfrom ahv_analysis.interrupt import *\n"
    return subprocess.run(
        [sys.executable, "-c", f"{head}number = {int(number)}\n{lines}"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_waits_until_what_must_be_whole_is_over(number):
    result = program(
        "end_on_signals()\n"
        "interrupted_says(lambda: 'after it')\n"
        "with signals_wait() as came:\n"
        "    print(came())\n"
        "    os.kill(os.getpid(), number)\n"
        "    os.kill(os.getpid(), number)\n"
        "    with signals_wait():\n"
        "        pass\n"
        "    print(came(), flush=True)\n"
        "print('never')",
        number,
    )
    assert (result.returncode, result.stdout) == (128 + number, "False\nTrue\n")
    assert result.stderr == "ahv: interrupted after it\n"


def test_processes_that_are_left_behind_say_nothing():
    result = program(
        "from ahv_analysis.campaign.workers import processes\n"
        "end_on_signals()\n"
        "processes(1).submit(abs, -1).result()\n"
        "os.kill(os.getpid(), number)"
    )
    assert (result.returncode, result.stderr) == (128 + signal.SIGINT, "ahv: interrupted\n")


def test_an_ignored_signal_stays_ignored():
    result = program(
        "signal.signal(number, signal.SIG_IGN)\n"
        "end_on_signals()\n"
        "with signals_wait() as came:\n"
        "    os.kill(os.getpid(), number)\n"
        "    print(came())",
        signal.SIGHUP,
    )
    assert (result.returncode, result.stdout, result.stderr) == (0, "False\n", "")


def test_a_notebook_gets_its_interrupt_when_it_is_safe():
    with pytest.raises(KeyboardInterrupt), signals_wait() as came:
        signal.raise_signal(signal.SIGINT)
        assert came()


def test_another_thread_has_no_signals():
    answers = []

    def work():
        with signals_wait() as came:
            answers.append(came())

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert answers == [False]
