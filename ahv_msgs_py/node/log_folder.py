# Copyright 2026 ahv developers, Apache-2.0
"""Where ROS writes its log files."""

import os
import sys
import tempfile
from pathlib import Path

from ahv_msgs_py.parameters import ParameterError

LOG_FOLDER = "ROS_LOG_DIR"


def log_where_it_can() -> None:
    """Have a folder for the log, without which ROS does not start.

    One that was named must do; instead of ROS's own, as in a home that is read-only or missing,
    it is a temporary one.
    """
    named = os.environ.get(LOG_FOLDER)
    if named:
        if not _can_log(Path(named)):
            raise ParameterError(f"{LOG_FOLDER} is {named!r}, but no log can be written there")
        return
    home = os.environ.get("HOME")
    ros = os.environ.get("ROS_HOME") or (home and f"{home}/.ros")
    if ros and _can_log(Path(ros) / "log"):
        return
    instead = Path(tempfile.gettempdir()) / f"ros-log-{os.getuid()}"
    if not _can_log(instead):
        raise ParameterError(f"ROS can write no log: name a folder for it by {LOG_FOLDER}")
    os.environ[LOG_FOLDER] = str(instead)
    print(
        f"ahv: no log can be written to {ros or '~/.ros'}/log, so ROS logs to {instead}; "
        f"{LOG_FOLDER} names another folder",
        file=sys.stderr,
    )


def _can_log(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
