# Copyright 2026 ahv developers, Apache-2.0
"""What release tools read: change log and citation."""

from pathlib import Path

import yaml
from catkin_pkg.changelog import Changelog, populate_changelog_from_rst

from test.test_packaging import setup  # noqa: F401  what setup.py hands to setuptools

ROOT = Path(__file__).parent.parent


def test_the_changelog_can_be_released(setup):  # noqa: F811
    """A release gives what is forthcoming its number and day; bloom then reads it."""
    text = (ROOT / "CHANGELOG.rst").read_text()
    title = f"{setup['version']} (2000-01-01)"
    released = text.replace("Forthcoming\n-----------", f"{title}\n{'-' * len(title)}")
    changes = populate_changelog_from_rst(Changelog(setup["name"]), released)
    assert changes.get_content_of_version(setup["version"])


def test_the_citation_is_of_this_version(setup):  # noqa: F811
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    required = {"cff-version", "message", "title", "authors"}
    assert required <= set(citation)
    assert (citation["version"], citation["license"]) == (setup["version"], setup["license"])


def test_every_source_file_says_whose_it_is():
    """REP-2004 asks for a statement in each, even of a package that is an experiment."""
    folders = ("ahv_*", "docs", "examples", "launch", "resource", "studies", "test")
    kinds = ("*.py", "*.cpp", "CMakeLists.txt", "nodes/*")
    for path in (path for f in folders for kind in kinds for path in ROOT.glob(f"{f}/**/{kind}")):
        beginning = path.read_text().splitlines()[:2]
        assert any("Copyright 2026 ahv developers, Apache-2.0" in line for line in beginning), path
