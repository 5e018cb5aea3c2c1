# Copyright 2026 ahv developers, Apache-2.0
"""Fly one case on the graph, a process per node, until the plant ends the flight.

    ros2 launch ahv flight.launch.py case:=nominal_di out:=flights/first

`ros2 launch ahv flight.launch.py --show-args` lists the arguments. The nodes come up in order: the
recorder, the controllers, then the plant, which starts to fly when all of them listen. A node that
ends before its time, as one that refuses a parameter does, ends the launch; in real time a
controller is started again instead, and the flight goes on.
"""

from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown, TimerAction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from ahv_msgs_py.graph import controllers

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
DRAIN = 2.0  # [s] for the recorder to take what is still under way
ARGUMENTS = {
    "case": ("nominal_di", "Name of a case in share/ahv/config/cases, or path of a YAML file."),
    "dispersion": ("", "YAML file of the vehicle's dispersion; that of the case, if empty."),
    "realtime": ("false", "true: 100 Hz by the wall clock; false: lockstep, as fast as it goes."),
    "network": ("false", "true: other machines hear the graph and speak to it; false: none does."),
    "record": ("true", "Whether a recorder flies along."),
    "out": ("flight", "Folder for the bag, which must not have one: OUT/bag."),
    "autostart": ("true", "false: the nodes wait for `ros2 lifecycle set NODE configure`."),
}


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; the nodes follow when their values are known."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    case = _case_file(given["case"])
    realtime, record = _truth(given, "realtime"), _truth(given, "record")
    shell = {"realtime": realtime, "autostart": _truth(given, "autostart")}
    # nodes keep to the loopback interface by themselves, unless a range is set
    wide = {"additional_env": {RANGE: "SUBNET"}} if _truth(given, "network") else {}
    names = controllers(_adaptive(case))
    plant = [_file(given["dispersion"])] if given["dispersion"] else []
    plant += [shell | {"listeners": len(names) + record}]
    bag = str(Path(given["out"]).expanduser().resolve() / "bag")
    over = TimerAction(period=DRAIN, actions=[Shutdown(reason="the flight is over")])
    nodes = []
    if record:
        # in real time a flight goes on without its recorder
        end = {} if realtime else {"on_exit": Shutdown(reason="the recorder ended")}
        nodes += [_node("recorder", [case, shell | {"bag": bag}], **end, **wide)]
    for name in names:
        end = {"respawn": True} if realtime else {"on_exit": Shutdown(reason=f"{name} ended")}
        nodes += [_node(name, [case, shell], **end, **wide)]
    return [*nodes, _node("plant", [case, *plant], on_exit=over, **wide)]


def _truth(given: dict[str, str], name: str) -> bool:
    """Value of an argument that is true or false."""
    if given[name].lower() not in ("true", "false"):
        raise ValueError(f"{name} is {given[name]!r}, but must be true or false")
    return given[name].lower() == "true"


def _case_file(case: str) -> str:
    """Path of the parameter file of a case."""
    if Path(case).suffix in (".yaml", ".yml"):
        return _file(case)
    share = Path(get_package_share_directory("ahv"))
    return _file(str(share / "config" / "cases" / f"{case}.yaml"))


def _file(name: str) -> str:
    file = Path(name).expanduser().resolve()
    if not file.is_file():
        raise FileNotFoundError(f"there is no file {file}")
    return str(file)


def _adaptive(case: str) -> bool:
    """Whether the case's parameter file has an adaptive inner loop."""
    sections = yaml.safe_load(Path(case).read_text())
    return any(body["ros__parameters"].get("adaptive") for body in sections.values())


def _node(name: str, parameters: list[object], **options: object) -> Node:
    # name and namespace make launch file the parameters under the node, where they win
    return Node(
        package="ahv",
        executable=name,
        name=name,
        namespace="/ahv",
        parameters=parameters,
        output="screen",
        **options,
    )
