# Copyright 2026 ahv developers, Apache-2.0
"""Results of checks as JUnit XML, which continuous integration services read."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, ElementTree, SubElement, indent


class Check(NamedTuple):
    """One thing that was asked."""

    name: str
    said: str  # what was found
    passed: bool


def write_junit(path: Path, suite: str, checks: Sequence[Check]) -> None:
    """Write checks as one suite of test cases; raises OSError."""
    failures = str(sum(not check.passed for check in checks))
    root = Element("testsuites", tests=str(len(checks)), failures=failures)
    suites = SubElement(root, "testsuite", name=_text(suite), tests=str(len(checks)))
    suites.set("failures", failures)
    for check in checks:
        case = SubElement(suites, "testcase", classname=_text(suite), name=_text(check.name))
        kind = "system-out" if check.passed else "failure"
        found = SubElement(case, kind)
        found.text = _text(check.said)
        if not check.passed:
            found.set("message", _text(check.said))
    indent(root)
    path.parent.mkdir(parents=True, exist_ok=True)
    ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _text(text: str) -> str:
    """Text without what XML cannot hold."""
    return "".join(letter if letter.isprintable() or letter == "\n" else "?" for letter in text)
