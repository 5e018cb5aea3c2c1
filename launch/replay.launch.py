# Copyright 2026 ahv developers, Apache-2.0
"""Replay a recorded flight where tools can watch it, and compare every command.

    ros2 launch ahv replay.launch.py bag:=flights/first/bag rate:=2.0

`ros2 launch ahv replay.launch.py --show-args` lists the arguments. Recorded messages come on their
own topics, replayed commands under /replay; nobody may fly in the ROS domain. The launch ends with
the replay, which prints what differs.
"""

import sys

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration

ARGUMENTS = ("bag", "nodes", "parameters", "rate", "out")


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; the replay follows when their values are known."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="Folder of the bag to replay."),
            DeclareLaunchArgument(
                "nodes",
                default_value="",
                description="Controllers to replay, separated by spaces; if empty, all.",
            ),
            DeclareLaunchArgument(
                "parameters",
                default_value="",
                description="Case to replay with, name or YAML file; if empty, the flown one.",
            ),
            DeclareLaunchArgument(
                "rate",
                default_value="1.0",
                description="Pace in times real time; if empty, as fast as possible and unseen.",
            ),
            DeclareLaunchArgument(
                "out",
                default_value="",
                description="Folder for figures of all commands; if empty, none are drawn.",
            ),
            OpaqueFunction(function=_replay),
        ]
    )


def _replay(context: LaunchContext) -> list[ExecuteProcess]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    # as a module: pip and colcon put the command `ahv` into different folders
    command = [sys.executable, "-P", "-m", "ahv_analysis.command.main", "replay", given["bag"]]
    for node in given["nodes"].split():
        command += ["--node", node]
    for name in ("parameters", "rate", "out"):
        if given[name]:
            command += [f"--{name}", given[name]]
    return [ExecuteProcess(cmd=command, output="screen", on_exit=_ended)]


def _ended(event: ProcessExited, context: LaunchContext) -> list[Shutdown]:
    """End as the replay has; only an exception gives a launch another exit code than 0."""
    if event.returncode and not context.is_shutdown:
        raise RuntimeError(f"the replay ended with exit code {event.returncode}")
    return [Shutdown(reason="the replay is over")]
