# Copyright 2026 ahv developers, Apache-2.0
"""From the report's equations to the code and its tests, read from the citations in the sources.

An equation belongs to the functions that cite it, in a docstring or beside a line; to a class if
no function does; and to a whole file if only the docstring of the file does.
"""

import ast
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

SOURCES = ("ahv_plant", "ahv_control")
KINDS = (ast.FunctionDef, ast.ClassDef, ast.Module)  # what may cite, the most telling first
CITATION = re.compile(r"\beqs? (\d\.\d+(?:(?:-|, | and |, and )\d\.\d+)*)")
MOST = 3  # functions and tests of an equation that are named

Equation = tuple[int, int]  # chapter and number


class Place(NamedTuple):
    """A definition, or a file when `name` is empty."""

    kind: int  # index in KINDS
    file: str  # from the root of the source tree
    name: str


def cited(text: str) -> set[Equation]:
    """Equations that a text cites, ranges spelled out: `eqs 4.3-4.5 and 5.11` are four."""
    found: set[Equation] = set()
    for citation in CITATION.finditer(" ".join(text.replace("#", " ").split())):
        for span in re.split(r", and |, | and ", citation[1]):
            chapter, first = map(int, span.partition("-")[0].split("."))
            last = int(span.rpartition(".")[2])
            found |= {(chapter, number) for number in range(first, last + 1)}
    return found


def places(root: Path) -> dict[Equation, list[Place]]:
    """Where each equation is built; those that cite the fewest equations come first."""
    citations: dict[Place, set[Equation]] = {}
    for path in (path for source in SOURCES for path in sorted((root / source).rglob("*.py"))):
        text, file = path.read_text(encoding="utf-8"), str(path.relative_to(root))
        tree = ast.parse(text)
        citations[Place(len(KINDS) - 1, file, "")] = cited(ast.get_docstring(tree) or "")
        for node in tree.body:
            if isinstance(node, KINDS):
                place = Place(KINDS.index(type(node)), file, node.name)
                citations[place] = cited(ast.get_source_segment(text, node) or "")
    equations = sorted(set().union(*citations.values()))
    built: dict[Equation, list[Place]] = {}
    for equation in equations:
        found = [place for place in citations if equation in citations[place]]
        best = min(place.kind for place in found)
        built[equation] = sorted(
            (place for place in found if place.kind == best),
            key=lambda place: len(citations[place]),
        )
    return built


def tests_by_name(root: Path) -> dict[tuple[str, str], list[str]]:
    """Tests that use a name of a file of ours, themselves or by a helper beside them."""
    users: defaultdict[tuple[str, str], list[str]] = defaultdict(list)
    for path in sorted((root / "test").glob("test_*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        origin = {
            alias.name: f"{(node.module or '').replace('.', '/')}.py"
            for node in tree.body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        used = {node.name: set(_names(node)) for node in tree.body if isinstance(node, KINDS[:2])}
        for test, names in used.items():
            if test.startswith("test_"):
                for name in names.union(*(used[name] for name in names & used.keys())):
                    if name in origin:
                        users[origin[name], name].append(f"{path.name}::{test}")
    return users


def _names(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.arg):  # a fixture
            yield node.arg


def equation_rows(root: Path) -> Iterator[tuple[str, str, str]]:
    """Rows of the index: equation, where it is built, what tests it."""
    users = tests_by_name(root)
    for (chapter, number), where in places(root).items():
        builders = (
            f"`{place.name}` in [{place.file}](../{place.file})"
            if place.name
            else f"[{place.file}](../{place.file})"
            for place in where[:MOST]
        )
        tests = Counter(test for place in where for test in users.get(place[1:], ()))
        named = (f"`{test}`" for test, _ in tests.most_common(MOST))
        yield f"{chapter}.{number}", "<br>".join(builders), "<br>".join(named)
