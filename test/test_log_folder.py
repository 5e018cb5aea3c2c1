# Copyright 2026 ahv developers, Apache-2.0
"""ROS logs where it can, and says where; a refusal is told once."""

import os
import subprocess
import sys

import pytest

from test.waiting import PATIENCE


def node(*arguments, **environment):
    """Run a node as a process, with another environment."""
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        capture_output=True,
        text=True,
        env={name: os.environ[name] for name in ("PATH", "ROS_DOMAIN_ID")} | environment,
        timeout=PATIENCE,
    )


PROGRAM = "from ahv_control.velocity_node import main; main()"
REFUSED = ("--ros-args", "-p", "k_u:=-1.0")


@pytest.mark.parametrize("home", [{"HOME": "/proc"}, {"HOME": ""}, {"ROS_HOME": "/proc"}])
def test_a_home_without_room_for_a_log_is_done_without(home, tmp_path):
    result = node(*REFUSED, TMPDIR=str(tmp_path), XDG_CACHE_HOME=str(tmp_path / "cache"), **home)
    assert result.returncode == 2
    said, refused = result.stderr.splitlines()
    assert "no log can be written to" in said and "ROS_LOG_DIR names another folder" in said
    assert f"ROS logs to {tmp_path}/ros-log-" in said
    assert "k_u" in refused


def test_a_log_folder_that_was_named_must_do():
    result = node(*REFUSED, ROS_LOG_DIR="/proc/log")
    assert result.returncode == 2
    assert result.stderr == "ROS_LOG_DIR is '/proc/log', but no log can be written there\n"


def test_a_refusal_is_told_once(tmp_path):
    result = node(*REFUSED, ROS_LOG_DIR=str(tmp_path))
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.count("k_u") == 1 and result.stderr.count("\n") == 1
