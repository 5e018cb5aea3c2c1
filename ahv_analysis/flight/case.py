# Copyright 2026 ahv developers, Apache-2.0
"""Case files: a flight's settings as a ROS parameter file, read and checked without ROS.

The same file sets up a flight here and a node by `--ros-args --params-file`.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ahv_analysis.flight.reach import check_reach
from ahv_analysis.versions import versions
from ahv_control.flight_control import FlightControl
from ahv_control.guidance import Guidance
from ahv_control.guidance_parameters import GUIDED, guidance
from ahv_control.parameters import (
    COMMANDED,
    LEARNER_PARAMETERS,
    MEASURED,
    inner_loop,
    intermediate_loop,
    learner_settings,
    outer_loop,
    velocity_loop,
)
from ahv_msgs_py.case_file import case_names, case_path, read_case_file
from ahv_msgs_py.config import config_folder
from ahv_msgs_py.graph import NODES, case_nodes, controllers
from ahv_msgs_py.parameters import ParameterError, Value, check_parameters
from ahv_msgs_py.topics import NAMESPACE
from ahv_plant.dispersion import Dispersion
from ahv_plant.hardware.wind_parameters import WIND_PARAMETERS
from ahv_plant.parameters import HARDWARE_PARAMETERS, PlantSettings, plant_settings
from ahv_plant.trim import check_flight_condition

HARDWARE = {("plant", parameter.name) for parameter in HARDWARE_PARAMETERS + WIND_PARAMETERS}
HARDWARE |= {
    ("disturbance_learner", parameter.name)  # what the flight software knows of the hardware
    for parameter in LEARNER_PARAMETERS
    if parameter.name.startswith(("observer_surfaces", "servo_model."))
}

GUIDED_NODES = [
    name
    for name in case_nodes()
    if any(parameter is GUIDED for parameter in NODES[name].parameters)
]
TRUE = ("dispersion.", "disturbance.", "wind.", "gust.", "turbulence.")  # of the plant alone


class Draw(NamedTuple):
    """Where a drawn vehicle comes from: it can be drawn again, with the same bits."""

    level: float  # [-]
    seed: int  # of the campaign
    run: int
    random_start: bool = False  # the start is drawn as well


class Case(NamedTuple):
    """A flight as it is set up."""

    name: str
    parameters: dict[str, dict[str, Value]]  # of every node, complete and checked
    plant: PlantSettings
    control: FlightControl
    draw: Draw | None = None  # of the dispersion among the parameters, if it was drawn

    @property
    def controllers(self) -> list[str]:
        """Names of the controller nodes that fly it."""
        control = self.control
        return controllers(
            adaptive=control.learner is not None, guided=control.guidance is not None
        )


def notes(case: Case) -> str:
    """What to file with the bag of a flight, as JSON: case, parameters, draw and versions."""
    content = {"case": case.name, "parameters": case.parameters, "versions": versions()}
    if case.draw is not None:
        content["draw"] = case.draw._asdict()
    return json.dumps(content)


def read_case(
    name: str,
    namespace: str = NAMESPACE,
    hardware: str | None = None,
    profile: str | None = None,
) -> tuple[str, dict[str, dict[str, object]]]:
    """Name of a case, and its parameters by node as case, hardware and profile give them."""
    path = Path(name)
    if path.suffix not in (".yaml", ".yml") and name in case_names():
        path = case_path(name)
    elif not path.is_file():
        raise ParameterError(
            f"case {name!r} is neither a YAML file nor one of {', '.join(case_names())}"
        )
    given = read_case_file(path, namespace)
    if hardware is not None:
        for node, values in load_hardware(hardware, namespace).items():
            given[node] |= values
    if profile is not None:
        for node, values in load_profile(profile, namespace).items():
            given[node] |= values
    return path.stem, given


def load_case(
    name: str,
    plant: Mapping[str, object] | None = None,
    draw: Draw | None = None,
    namespace: str = NAMESPACE,
    hardware: str | None = None,
    profile: str | None = None,
) -> Case:
    """Case of a name in config/cases, or of a file; ParameterError names what is wrong with it.

    `plant` replaces parameters of the plant: a dispersion, another start or duration; `draw` says
    where the dispersion comes from, if it was drawn. The file is read as nodes in `namespace` do.
    `hardware` is a name of config/hardware, or a file, and `profile` one of config/profiles;
    their parameters stand above the case's.
    """
    name, given = read_case(name, namespace, hardware, profile)
    given["plant"] |= plant or {}
    if draw is not None:  # the noise is that of the run, as in the campaign
        given["plant"] |= {"noise.seed": draw.seed, "noise.run": draw.run}
    return make_case(name, given, draw)


def hardware_names() -> list[str]:
    """Hardware that comes with the package."""
    return _names("hardware")


def profile_names() -> list[str]:
    """Profiles that come with the package: what to fly, by time or by waypoints."""
    return _names("profiles")


def _names(folder: str) -> list[str]:
    return sorted(path.stem for path in (config_folder() / folder).glob("*.yaml"))


def load_hardware(name: str, namespace: str = NAMESPACE) -> dict[str, dict[str, object]]:
    """Parameters by node of a name in config/hardware, or of a file that says nothing else."""
    path = _file_of(name, "hardware", "hardware")
    given = read_case_file(path, namespace)
    for node, values in given.items():
        for parameter in values:
            if (node, parameter) not in HARDWARE:
                raise ParameterError(
                    f"{path.name}: {node}: {parameter} has no place in a hardware file; valid are "
                    "the plant's actuators, latency, failures, sensors and wind, and "
                    "observer_surfaces and servo_model of the disturbance_learner"
                )
    return given


def load_profile(name: str, namespace: str = NAMESPACE) -> dict[str, dict[str, object]]:
    """Parameters by node of a name in config/profiles, or of a file that says nothing else."""
    path = _file_of(name, "profile", "profiles")
    given = read_case_file(path, namespace)
    for node, values in given.items():
        for parameter in values:
            known = node == "guidance" or (node, parameter) == ("plant", "duration")
            if not known and parameter != GUIDED.name:
                raise ParameterError(
                    f"{path.name}: {node}: {parameter} has no place in a profile; valid are "
                    "parameters of guidance, guided of all nodes, and duration of the plant"
                )
    if given["guidance"].get(GUIDED.name) is not True:
        raise ParameterError(f"{path.name}: a profile must have guided: true for all nodes")
    return given


def _file_of(name: str, kind: str, folder: str) -> Path:
    """File of a name in a folder of config, or of a path."""
    path = Path(name)
    if path.suffix not in (".yaml", ".yml") and name in _names(folder):
        return config_folder() / folder / f"{name}.yaml"
    if not path.is_file():
        raise ParameterError(
            f"{kind} {name!r} is neither a YAML file nor one of {', '.join(_names(folder))}"
        )
    return path


def dispersion_parameters(dispersion: Dispersion) -> dict[str, object]:
    """Plant parameters of a dispersion."""
    return {f"dispersion.{name}": value for name, value in dispersion._asdict().items()}


def load_dispersion(path: Path, namespace: str = NAMESPACE) -> dict[str, object]:
    """Plant parameters of a dispersion file: a ROS parameter file with the plant alone."""
    given = read_case_file(path, namespace)
    for node, values in given.items():
        for name in values:
            if node != "plant" or not name.startswith(TRUE):
                raise ParameterError(
                    f"{path.name}: {node}: {name} has no place in a dispersion file; "
                    f"valid are the plant's {'*, '.join(TRUE)}*"
                )
    return given["plant"]


def make_case(
    name: str, given: Mapping[str, Mapping[str, object]], draw: Draw | None = None
) -> Case:
    """Case of the parameters `given` for each node; ParameterError names what is wrong."""
    parameters = {
        node: check_parameters(f"{name}: {node}", NODES[node].parameters, given.get(node, {}))
        for node in case_nodes()
    }
    outer, velocity = parameters["outer_intermediate"], parameters["velocity"]
    held = {"altitude": outer["altitude"], "speed": velocity["speed"]}
    guiding = parameters["guidance"]
    guiding |= held | {key: guiding[key] for key in held if key in given.get("guidance", {})}
    plant = plant_settings(parameters["plant"])
    if plant.hardware is None:  # surfaces are where they are commanded to be: nobody measures them
        learner = parameters["disturbance_learner"]
        if learner["observer_surfaces"] == MEASURED:
            learner["observer_surfaces"] = COMMANDED
    _check_commands(parameters, plant)
    adaptive = parameters["inner_loop"]["adaptive"]
    control = FlightControl(
        outer_loop(parameters["outer_intermediate"]),
        intermediate_loop(parameters["outer_intermediate"]),
        inner_loop(parameters["inner_loop"]),
        velocity_loop(parameters["velocity"]),
        learner_settings(parameters["disturbance_learner"]) if adaptive else None,
        _guidance(name, parameters, plant),
    )
    return Case(name, parameters, plant, control, draw)


def _guidance(
    name: str, parameters: Mapping[str, Mapping[str, Value]], plant: PlantSettings
) -> Guidance | None:
    """Guidance of a case, None without; ParameterError where what it leads to cannot be flown."""
    guided = {node: parameters[node][GUIDED.name] for node in GUIDED_NODES}
    if len(set(guided.values())) > 1:
        raise ParameterError(
            f"{name}: guided is {guided}, but must be the same for all of them: set it by /**"
        )
    made = guidance(parameters["guidance"])
    if not guided["guidance"]:
        return None
    check_reach(made, plant)
    return made


def _check_commands(parameters: Mapping[str, Mapping[str, Value]], plant: PlantSettings) -> None:
    """Raise ParameterError for an altitude or a speed at which the vehicle model does not hold."""
    altitude = float(parameters["outer_intermediate"]["altitude"])
    speed = float(parameters["velocity"]["speed"])
    try:
        check_flight_condition(altitude, speed, plant.initial.mass, plant.truth.geometric)
    except ValueError as error:
        raise ParameterError(f"outer_intermediate, velocity: commanded {error}") from error
