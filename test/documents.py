# Copyright 2026 ahv developers, Apache-2.0
"""The code of the documents: which there is, and how to run it."""

import os
import re
import shlex
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from markdown_it import MarkdownIt

from ahv_msgs_py.graph import NODES

ROOT = Path(__file__).parent.parent
PAGES = sorted(
    page for where in ("*.md", "docs/*.md", "examples/**/*.md") for page in ROOT.glob(where)
)
SLOW = "<!-- slow -->"  # above a block that takes minutes
SHELL = ("", "sh")  # a block that does not say its language is one of commands
ELSEWHERE = ("colcon", "git", "plotjuggler", "ros2", "rosdep", "sudo")  # on another machine
TERMINALS = {f"ahv-{name}" for name in NODES}  # each of these runs in one of its own
SETTING = re.compile(r"[A-Z_]+=")  # of an environment variable, before a program
LONGEST = 1800  # [s], for `make bench`


class Block(NamedTuple):
    """A block of code of a page."""

    page: Path
    line: int
    language: str
    text: str
    slow: bool

    @property
    def commands(self) -> list[str]:
        """Its lines, each with those that it goes on in, without those that are comments."""
        lines = map(str.strip, self.text.replace("\\\n", " ").splitlines())
        return [line for line in lines if line and not line.startswith("#")]


def _tokens(page: Path):
    return MarkdownIt("commonmark").enable("table").parse(page.read_text())


def blocks(page: Path) -> Iterator[Block]:
    """Every block of code of a page, fenced or indented, in order."""
    before = None
    for token in _tokens(page):
        if token.type in ("fence", "code_block"):
            slow = before is not None and before.content.strip() == SLOW
            yield Block(page, token.map[0] + 1, token.info.strip(), token.content, slow)
        before = token if token.type == "html_block" else None


def _children(page: Path):
    return (child for token in _tokens(page) for child in token.children or ())


def spans(page: Path) -> list[str]:
    """Every piece of code within the text of a page."""
    return [child.content for child in _children(page) if child.type == "code_inline"]


def links(page: Path) -> list[str]:
    """Every address that a page points to, pictures too."""
    found = (child.attrGet("href") or child.attrGet("src") for child in _children(page))
    return [address for address in found if address]


def programs(command: str) -> list[list[str]]:
    """Words of every program that a command calls, one after another or by a pipe."""
    words = shlex.shlex(command, posix=True, punctuation_chars=True)
    words.whitespace_split = True
    parts = [[]]
    for word in words:
        if set(word) <= set("&|;"):
            parts.append([])
        elif parts[-1] or not SETTING.match(word):
            parts[-1].append(word)
    return parts


def first_word(command: str) -> str:
    """Return the first program of a command, or what stands in its place."""
    words = (word for word in command.split() if not SETTING.match(word))
    return next(words, command)


def clone(folder: Path) -> Path:
    """Copy what a clone has, with the virtual environment: what commands write stays there."""
    unwanted = shutil.ignore_patterns(".*", "__pycache__", "build", "campaigns", "flights")
    shutil.copytree(ROOT, folder, ignore=unwanted)
    (folder / ".venv").symlink_to(ROOT / ".venv")
    return folder


def run(block: Block, folder: Path, domain: int) -> None:
    """Run the code of a block in a clone as it stands, unless it is for another machine."""
    environment = os.environ | {
        "PATH": f"{ROOT / '.venv' / 'bin'}:{os.environ['PATH']}",
        "ROS_DOMAIN_ID": str(domain),
    }
    program = ["bash", "-euo", "pipefail"] if block.language in SHELL else ["python"]
    first_words = set(map(first_word, block.commands))
    if block.language in SHELL and first_words & TERMINALS:
        run_in_terminals(block.commands, folder, environment)
    elif not (block.language in SHELL and first_words & set(ELSEWHERE)):
        done = subprocess.run(
            [*program, "-c", block.text],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LONGEST,
        )
        where = f"{block.page.name}:{block.line}"
        assert done.returncode == 0, f"{where}: {done.stdout}{done.stderr}"


def run_in_terminals(commands: list[str], folder: Path, environment: dict[str, str]) -> None:
    """Run all commands at once: those of a flight end by themselves, the others by Ctrl-C."""
    terminals = {
        command: subprocess.Popen(
            ["bash", "-c", f"exec {command}"], cwd=folder, env=environment, process_group=0
        )
        for command in commands
    }
    try:
        for command, terminal in terminals.items():
            if first_word(command) in ("ahv-plant", "ahv-recorder"):
                assert terminal.wait(LONGEST) == 0, command
        for command, terminal in terminals.items():
            assert terminal.poll() in (None, 0), command
            terminal.send_signal(signal.SIGINT)
            assert terminal.wait(30) == 0, command
    finally:
        for terminal in terminals.values():
            terminal.kill()
            terminal.wait()
