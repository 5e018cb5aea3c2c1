# Copyright 2026 ahv developers, Apache-2.0
"""Ctrl-C at random moments in a terminal: `python -m test.interrupt MOMENTS SEED`.

What a command leaves behind is whole, it says one sentence, and ends with 128 and the signal.
"""

import errno
import os
import pty
import random
import re
import select
import signal
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from ahv_analysis.bag.reader import read_bag
from ahv_msgs_py.layout import NANOSECONDS

AHV = str(Path(sys.executable).parent / "ahv")
LONGEST_END = 10.0  # [s] from the signal on
ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
NUMBERS = {"INT": signal.SIGINT, "TERM": signal.SIGTERM, "HUP": signal.SIGHUP}


class End(NamedTuple):
    """How an interrupted command ended."""

    code: int  # exit code; negative: the signal that killed it
    said: str  # what is left on the terminal
    took: float  # [s] from the signal on


def interrupted(command, cwd, after, how="INT"):
    """Run a command on a terminal of its own and interrupt it; None if it ended before that.

    `after` [s] counts from its first own line, before which Python itself answers signals; or it
    tells by what the command has said whether the moment has come.
    `how` is a signal, "INT" by way of the key Ctrl-C.
    """
    pid, terminal = pty.fork()
    if pid == 0:
        os.chdir(cwd)
        for number in NUMBERS.values():
            signal.signal(number, signal.SIG_DFL)
        os.execve(command[0], command, os.environ | {"TERM": "xterm", "PYTHONIOENCODING": "utf-8"})
    said = bytearray()
    while not _hears(pid):
        _listen(terminal, said, 0.01)
    if callable(after):
        while not after(said):
            _listen(terminal, said, 0.05)
    else:
        _listen(terminal, said, after)
    if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT):
        sent = None
    else:
        sent = time.monotonic()
        if how == "INT":
            os.write(terminal, b"\x03")
        else:
            os.kill(pid, NUMBERS[how])
    _listen(terminal, said, LONGEST_END + 5.0)
    ended = time.monotonic()
    os.close(terminal)
    _, status = os.waitpid(pid, 0)
    code = os.waitstatus_to_exitcode(status)
    if sent is None or code == 0:
        return None
    text = ESCAPES.sub("", said.decode(errors="replace")).replace("\r\n", "\n")
    return End(code, text, ended - sent)


def _hears(pid):
    """Whether a process answers SIGHUP itself, or has ended."""
    status = Path(f"/proc/{pid}/status").read_text()
    caught = int(re.search(r"SigCgt:\s*(\w+)", status)[1], 16)
    return bool(caught & 1) or "State:\tZ" in status


def _listen(terminal, said, seconds):
    """Read a terminal for so long, or until nobody has it open any more."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        if not select.select([terminal], [], [], left)[0]:
            return
        try:
            data = os.read(terminal, 65536)
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return
        if not data:
            return
        said += data


def fault(end, how, bag):
    """What is wrong with an end, empty if nothing is."""
    sentences = [line for line in end.said.splitlines() if "ahv: interrupted" in line]
    if end.code != 128 + NUMBERS[how]:
        return f"exit code {end.code}"
    if len(sentences) != 1 or "Traceback" in end.said or "ERROR" in end.said:
        return "not one sentence"
    if end.took > LONGEST_END:
        return f"{end.took:.1f} s"
    if bag.exists():
        if not (bag / "metadata.yaml").exists():
            return "the bag is not whole"
        if "before the flight began" not in sentences[0]:
            flown = float(re.search(r"at ([0-9.]+) s; what was flown is in ", sentences[0])[1])
            last = read_bag(bag).stamps[-1] / NANOSECONDS
            if abs(last - flown) > 0.5:  # of which the last is under way
                return f"the bag ends at {last} s, but it says {flown} s"
    return ""


def try_moments(command, longest, moments, seed):
    """Interrupt a flight at random moments of `longest` [s]; return what went wrong."""
    draw = random.Random(seed)
    wrong = []
    for number in range(moments):
        how = draw.choice(["INT", "INT", "TERM", "HUP"])
        after = draw.uniform(0.0, longest)
        with TemporaryDirectory() as folder:
            end = interrupted([AHV, *command, "--out", "out"], folder, after, how)
            if end is None:
                print(f"{number} {how} at {after:.2f} s: had ended before")
                continue
            reason = fault(end, how, Path(folder) / "out" / "bag")
        last = end.said.strip().splitlines()[-1:] or [""]
        print(
            f"{number} {how} at {after:.2f} s: {end.code} in {end.took:.2f} s {last[0]} {reason}"
        )
        sys.stdout.flush()
        if reason:
            wrong.append((how, after, reason, end))
    return wrong


WAYS = (
    ("--duration", "40"),
    ("--duration", "3", "--realtime"),
    ("--duration", "30", "--processes"),
    ("--duration", "3", "--processes", "--realtime"),
    ("--duration", "100", "--engine", "library"),
)


def main():
    """Try all ways to fly, and say what went wrong."""
    moments, seed = int(sys.argv[1]), int(sys.argv[2])
    wrong = []
    for ways in WAYS:
        command = ("fly", "neuro_adaptive_di", *ways)
        with TemporaryDirectory() as folder:
            interrupted([AHV, *command, "--out", "compiled"], folder, 600.0)
            started = time.monotonic()
            interrupted([AHV, *command, "--out", "out"], folder, 600.0)
            whole = time.monotonic() - started
        print(f"ahv {' '.join(command)}: {whole:.1f} s to its end", flush=True)
        wrong += try_moments(command, whole, moments, seed)
    for how, after, reason, end in wrong:
        print(f"\n{how} at {after:.2f} s: {reason}\n{end.said[-3000:]}")
    print(f"{len(wrong)} ends were wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
