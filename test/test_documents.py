# Copyright 2026 ahv developers, Apache-2.0
"""Every command and every block of code of the documents works, every name in them exists.

The blocks of a page run in a clone of their own, in order and as they stand. A block without a
language is one of commands; one that starts nodes runs in as many terminals as it has lines. Above
a block, `<!-- slow -->` puts it off to `make test-slow`. Printed output is of language `text`.
Blocks for a machine with a ROS installation are checked by their names alone.
"""

import re
import shlex
from collections import defaultdict
from importlib.util import find_spec

import pytest
import typer
import yaml

from ahv_analysis.command.app import app
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.topics import LOOP_TOPICS, VIEWER_TOPICS
from test.documents import (
    ELSEWHERE,
    PAGES,
    ROOT,
    SHELL,
    TERMINALS,
    blocks,
    clone,
    first_word,
    links,
    programs,
    run,
    spans,
)

BLOCKS = [block for page in PAGES for block in blocks(page)]
COMMANDS = {
    f"{block.page.name}:{block.line}": block.commands
    for block in BLOCKS
    if block.language in SHELL
}
COMMANDS |= {
    page.name: [span for span in spans(page) if re.match(r"(ahv|make|ros2|python -m) .", span)]
    for page in PAGES
}
TARGETS = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
PROGRAMS = (*ELSEWHERE, *TERMINALS, ".", "ahv", "export", "make", "python", "timeout")
by_name = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def check_ahv(words):
    command = typer.main.get_command(app)
    while words and words[0] in getattr(command, "commands", {}):
        command, words = command.commands[words[0]], words[1:]
    known = {name for parameter in command.params for name in parameter.opts}
    unknown = {word for word in words if word.startswith("--")} - known - {"--help"}
    assert not unknown, f"{command.name} has no {unknown}"


def check_make(words):
    assert {word for word in words if "=" not in word} <= set(TARGETS)


def check_python(words):
    if words[0] == "-m":
        assert find_spec(words[1]), words[1]
    else:
        assert (ROOT / words[0]).exists(), words[0]


def check_ros2(words):
    if words[:2] == ["launch", "ahv"]:
        file = (ROOT / "launch" / words[2]).read_text()
        for name in (word.partition(":=")[0] for word in words[3:] if ":=" in word):
            assert f'"{name}"' in file, name
    elif words[:2] == ["run", "ahv"]:
        assert words[2] in (*NODES, "ahv") or words[2].isupper(), words[2]
    topics = [topic.name for topic in (*LOOP_TOPICS, *VIEWER_TOPICS)]
    for name in (word for word in words if word.startswith("/ahv/")):
        node, _, service = name.removeprefix("/ahv/").partition("/")
        assert name in topics or (node in NODES and service in ("", *SERVICES[node])), name


SERVICES = defaultdict(tuple, {"guidance": ("hold", "resume")})  # of their own
CHECKS = {"ahv": check_ahv, "make": check_make, "python": check_python, "ros2": check_ros2}


@pytest.mark.parametrize("place", COMMANDS)
def test_what_a_command_names_exists(place):
    for command in COMMANDS[place]:
        assert first_word(command) in PROGRAMS, "no command: give its block the language `text`"
        for program, *words in programs(command):
            if program in CHECKS:
                CHECKS[program](words)


@pytest.mark.parametrize(
    "command",
    [
        "ahv fly nominal_di --outt flights/one",
        "ahv monte-carlo --contoller neuro_adaptive_di",
        "make tset",
        "python -m ahv_analysis.stdy",
        "ros2 launch ahv flight.launch.py cas:=nominal_di",
        "ros2 run ahv plnt",
        "ros2 topic echo /ahv/stat",
    ],
)
def test_a_misprint_is_noticed(command):
    program, *words = shlex.split(command)
    with pytest.raises(AssertionError):
        CHECKS[program](words)


@by_name
def test_links_lead_somewhere(page):
    for address in links(page):
        if not address.startswith(("http", "#", "mailto:")):
            assert (page.parent / address.partition("#")[0]).exists(), address


@by_name
def test_files_that_are_named_exist(page):
    for span in spans(page):
        if re.fullmatch(r"(ahv_\w+|config|docs|examples|launch|studies|test)/[\w./-]+", span):
            assert (ROOT / span).exists(), span


@pytest.mark.parametrize(
    "block", BLOCKS, ids=lambda block: f"{block.page.name}:{block.line}:{block.language}"
)
def test_a_block_is_of_a_language_that_is_tested(block):
    """Commands and Python are run, settings are read, listings stand in a file of examples."""
    assert "make test-slow" not in block.text, "it would run itself"
    if block.language in ("cpp", "cmake", "xml"):
        listings = (path for path in (ROOT / "examples").rglob("*") if path.is_file())
        assert any(block.text in path.read_text() for path in listings)
    elif block.language == "yaml":
        assert yaml.safe_load(block.text)
    elif block.language == "python":
        compile(block.text, block.page.name, "exec")
    elif block.language == "mermaid":
        assert "<!-- reference graph -->" in block.page.read_text()
    else:
        assert block.language in (*SHELL, "text")


def run_page(page, slow, folder, domain):
    languages = (*SHELL, "python")
    chosen = [
        block for block in blocks(page) if block.slow == slow and block.language in languages
    ]
    if not chosen:
        pytest.skip("no such block")
    if not (ROOT / ".venv" / "ready").exists():
        pytest.skip("the documents speak of .venv: make venv")
    clone(folder)
    for block in chosen:
        run(block, folder, domain)


@pytest.mark.docs
@by_name
def test_the_commands_of_a_page_run(page, tmp_path, domain):
    run_page(page, False, tmp_path / "ahv", domain)


@pytest.mark.slow
@by_name
def test_the_slow_commands_of_a_page_run(page, tmp_path, domain):
    run_page(page, True, tmp_path / "ahv", domain)
