"""Fly one case on the graph, a process per node, until the plant ends the flight.

    ros2 launch ahv flight.launch.py case:=nominal_di bag:=flights/first

`ros2 launch ahv flight.launch.py --show-args` lists the arguments. A node that ends before its
time, as one that refuses a parameter does, ends the launch.
"""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown, TimerAction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

CONTROLLERS = ("outer_intermediate", "inner_loop", "velocity")
LEARNER = "disturbance_learner"  # flies with the cases whose inner loop is adaptive
DRAIN = 2.0  # [s] for the recorder to take what is still under way


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; the nodes follow when their values are known."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "case",
                default_value="nominal_di",
                description="Name of a case in share/ahv/config/cases, or path of a YAML file.",
            ),
            DeclareLaunchArgument(
                "bag",
                default_value="bag",
                description="Folder of the bag to record to; it must not exist.",
            ),
            OpaqueFunction(function=_nodes),
        ]
    )


def _nodes(context: LaunchContext) -> list[Node]:
    case = _case_file(LaunchConfiguration("case").perform(context))
    bag = str(Path(LaunchConfiguration("bag").perform(context)).expanduser().resolve())
    controllers = (*CONTROLLERS, LEARNER) if _adaptive(case) else CONTROLLERS
    over = TimerAction(period=DRAIN, actions=[Shutdown(reason="the flight is over")])
    return [
        _node("recorder", case, {"bag": bag}, Shutdown(reason="the recorder ended")),
        *(_node(name, case, {}, Shutdown(reason=f"{name} ended")) for name in controllers),
        _node("plant", case, {"listeners": len(controllers) + 1}, over),
    ]


def _case_file(case: str) -> str:
    """Path of the parameter file of a case."""
    if Path(case).suffix in (".yaml", ".yml"):
        file = Path(case).expanduser().resolve()
    else:
        share = Path(get_package_share_directory("ahv"))
        file = share / "config" / "cases" / f"{case}.yaml"
    if not file.is_file():
        raise FileNotFoundError(f"case {case!r}: there is no file {file}")
    return str(file)


def _adaptive(case: str) -> bool:
    """Whether the case's parameter file has an adaptive inner loop."""
    sections = yaml.safe_load(Path(case).read_text())
    return any(body["ros__parameters"].get("adaptive") for body in sections.values())


def _node(name: str, case: str, parameters: dict, on_exit: object) -> Node:
    # name and namespace make launch file the parameters under the node, where they win
    return Node(
        package="ahv",
        executable=name,
        name=name,
        namespace="/ahv",
        parameters=[case, parameters] if parameters else [case],
        output="screen",
        on_exit=on_exit,
    )
