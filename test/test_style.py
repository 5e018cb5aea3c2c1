# Copyright 2026 ahv developers, Apache-2.0
"""What a ROS workspace's own linters say of the package; ruff has said the same before them."""

from pathlib import Path

ROOT = Path(__file__).parent.parent
CHECKED = [str(path) for path in ROOT.glob("ahv_*")] + [str(ROOT / "launch")]


def test_ament_flake8_finds_nothing():
    from ament_flake8.main import main_with_errors

    settings = ["--config", str(ROOT / "setup.cfg")]
    code, errors = main_with_errors([*settings, *CHECKED])
    assert code == 0, "\n".join(errors)


def test_ament_pep257_finds_nothing(capsys):
    """D213 and D401 ask for another taste: the summary on the second line, as an imperative."""
    from ament_pep257.main import main

    code = main([*CHECKED, "--add-ignore", "D213", "D401"])
    assert code == 0, capsys.readouterr().out
