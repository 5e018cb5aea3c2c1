# Copyright 2026 ahv developers, Apache-2.0
"""Fly one case on the graph, a process per node, until the plant ends the flight.

    ros2 launch ahv flight.launch.py case:=nominal_di out:=flights/first

`ros2 launch ahv flight.launch.py --show-args` lists the arguments. What can be refused is refused
before a node starts: a case, a dispersion, a bag that exists. The nodes come up in order: the
recorder, the controllers, then the plant, which starts to fly when all of them listen. A node that
fails, as a plant that loses its vehicle does, fails the launch; in real time a controller is
started again instead, and the flight goes on.
"""

import json
from collections.abc import Callable
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown, TimerAction
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from ahv_analysis.flight.case import load_case, load_dispersion, load_hardware, load_profile
from ahv_msgs_py.config import config_folder
from ahv_msgs_py.namespace import remappings
from ahv_msgs_py.topics import NAMESPACE

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
DRAIN = 2.0  # [s] for the recorder to take what is still under way
REFUSED = 2  # exit code of a node that cannot be set up
ARGUMENTS = {
    "case": ("nominal_di", "Name of a case in share/ahv/config/cases, or path of a YAML file."),
    "hardware": ("", "ideal, typical, poor, or path of a YAML file; that of the case, if empty."),
    "profile": ("", "Name of what is flown, in config/profiles, or path of a YAML file."),
    "dispersion": ("", "YAML file of the vehicle's dispersion; that of the case, if empty."),
    "realtime": ("false", "true: 100 Hz by the wall clock; false: lockstep, as fast as it goes."),
    "network": ("false", "true: other machines hear the graph and speak to it; false: none does."),
    "record": ("true", "Whether a recorder flies along."),
    "out": ("flight", "Folder for the bag, which must not have one: OUT/bag."),
    "namespace": (NAMESPACE, "Of the nodes and topics: vehicles in one ROS domain differ in it."),
    "listeners": ("0", "Subscribers of the state to wait for, beside the nodes launched here."),
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
    namespace = f"/{given['namespace'].strip('/')}"
    realtime, record = _truth(given, "realtime"), _truth(given, "record")
    shell = {"realtime": realtime, "autostart": _truth(given, "autostart")}
    # nodes keep to the loopback interface by themselves, unless a range is set
    wide = {"additional_env": {RANGE: "SUBNET"}} if _truth(given, "network") else {}
    file = _case_file(given["case"])
    hardware, profile = given["hardware"] or None, given["profile"] or None
    case = load_case(file, namespace=namespace, hardware=hardware, profile=profile)
    above: dict[str, dict[str, object]] = {}  # what stands above the case's parameters
    for part in (
        {} if hardware is None else load_hardware(hardware, namespace),
        {} if profile is None else load_profile(profile, namespace),
    ):
        above |= {name: above.get(name, {}) | values for name, values in part.items()}
    plant = []
    if given["dispersion"]:
        plant = [str(_absolute(given["dispersion"]))]
        load_dispersion(Path(plant[0]), namespace)
    plant += [shell | {"listeners": len(case.controllers) + record + _count(given, "listeners")}]
    bag = _absolute(given["out"]) / "bag"
    if record and bag.exists():
        raise FileExistsError(f"cannot write a bag to {bag}: it exists already")
    notes = json.dumps({"case": case.name})
    failures: list[str] = []

    def node(name: str, parameters: list[object], **options: object) -> Node:
        # name and namespace make launch file the parameters under the node, where they win
        return Node(
            package="ahv",
            executable=name,
            name=name,
            namespace=namespace,
            remappings=remappings(namespace),
            parameters=[file, *filter(None, [above.get(name)]), *parameters],
            output="screen",
            on_exit=_end_of(name, failures, realtime),
            **wide,
            **options,
        )

    nodes = [node("recorder", [shell | {"bag": str(bag), "notes": notes}])] if record else []
    # guidance starts at the altitude and speed that the loops of the case would hold
    known = {name: case.parameters["guidance"][name] for name in ("altitude", "speed")}
    of_case = {"guidance": known, "flight_control": case.parameters["flight_control"]}
    nodes += [
        node(name, [shell | of_case.get(name, {})], respawn=realtime) for name in case.controllers
    ]
    return [*nodes, node("plant", plant)]


def _end_of(name: str, failures: list[str], realtime: bool) -> Callable[..., list[object]]:
    """What follows when a node has ended: in real time a flight goes on without any but the plant.

    A launch whose handlers raise an exception ends with exit code 1, and in no other way.
    """

    def over(context: LaunchContext) -> list[object]:
        if failures:
            raise RuntimeError("; ".join(failures))
        return [Shutdown(reason=f"{name} has ended")]

    def ended(event: ProcessExited, context: LaunchContext) -> list[object]:
        code = event.returncode
        if context.is_shutdown:
            return []
        if code and not (realtime and name not in ("plant", "recorder") and code != REFUSED):
            failures.append(f"{name} ended with exit code {code}")
        if name == "plant":
            return [TimerAction(period=DRAIN, actions=[OpaqueFunction(function=over)])]
        if code == REFUSED or not (realtime or (name == "recorder" and code == 0)):
            return over(context)
        return []

    return ended


def _truth(given: dict[str, str], name: str) -> bool:
    """Value of an argument that is true or false."""
    if given[name].lower() not in ("true", "false"):
        raise ValueError(f"{name} is {given[name]!r}, but must be true or false")
    return given[name].lower() == "true"


def _count(given: dict[str, str], name: str) -> int:
    """Value of an argument that is a number of things."""
    if not given[name].isdecimal():
        raise ValueError(f"{name} is {given[name]!r}, but must be an integer from 0 on")
    return int(given[name])


def _case_file(case: str) -> str:
    """Path of the parameter file of a case."""
    if Path(case).suffix in (".yaml", ".yml"):
        return str(_absolute(case))
    return str(config_folder() / "cases" / f"{case}.yaml")


def _absolute(name: str) -> Path:
    return Path(name).expanduser().resolve()
