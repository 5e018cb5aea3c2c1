"""Replay a recorded flight where tools can watch it, and compare every command.

    ros2 launch ahv replay.launch.py bag:=flights/first/bag rate:=2.0

`ros2 launch ahv replay.launch.py --show-args` lists the arguments. Recorded messages come on their
own topics, replayed commands under /replay; nobody may fly in the ROS domain. The launch ends with
the replay, which prints what differs.
"""

import sys

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration

ARGUMENTS = {
    "bag": "Folder of the bag to replay.",
    "nodes": "Controllers to replay, separated by spaces; all that the flight had, if empty.",
    "parameters": "Case (name or YAML file) to replay with; that of the flight, if empty.",
    "rate": "Pace in times real time; as fast as possible and unseen by tools, if empty.",
    "out": "Folder for figures of recorded and replayed commands; no figures, if empty.",
}
DEFAULTS = {"nodes": "", "parameters": "", "rate": "1.0", "out": ""}


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; the replay follows when their values are known."""
    arguments = [
        DeclareLaunchArgument(name, default_value=DEFAULTS.get(name), description=description)
        for name, description in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_replay)])


def _replay(context: LaunchContext) -> list[ExecuteProcess]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    # as a module: pip and colcon put the command `ahv` into different folders
    command = [sys.executable, "-m", "ahv_analysis.command", "replay", given["bag"]]
    for node in given["nodes"].split():
        command += ["--node", node]
    for name in ("parameters", "rate", "out"):
        if given[name]:
            command += [f"--{name}", given[name]]
    over = Shutdown(reason="the replay is over")
    return [ExecuteProcess(cmd=command, output="screen", on_exit=over)]
