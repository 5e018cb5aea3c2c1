# Copyright 2026 ahv developers, Apache-2.0
"""Case files: a flight's settings as a ROS parameter file, read and checked without ROS.

The same file sets up a flight here and a node by `--ros-args --params-file`.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ahv_analysis.bag.notes import Notes
from ahv_analysis.versions import versions
from ahv_control.flight_control import FlightControl
from ahv_control.guidance import Guidance
from ahv_control.guidance_parameters import GUIDED, guidance
from ahv_control.law_file import Law, law_identity, load_law
from ahv_control.own_law import Control, OwnLaw
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
from ahv_control.reach import check_reach
from ahv_msgs_py.case_file import case_names, case_path, read_case_file
from ahv_msgs_py.config import config_folder
from ahv_msgs_py.graph import NODES, case_nodes, controllers
from ahv_msgs_py.layout import excerpt
from ahv_msgs_py.parameters import Parameter, ParameterError, Value, check_parameters
from ahv_msgs_py.topics import NAMESPACE
from ahv_plant.dispersion import Dispersion
from ahv_plant.hardware.wind_parameters import WIND_PARAMETERS
from ahv_plant.model.flight_condition import check_flight_condition
from ahv_plant.parameters import HARDWARE_PARAMETERS, PlantSettings, plant_settings

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
OWN_LAW = "flight_control"  # the node that flies a law of one's own
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
    control: Control
    draw: Draw | None = None  # of the dispersion among the parameters, if it was drawn
    law: Law | None = None  # of one's own, in the place of the report's loops

    @property
    def controllers(self) -> list[str]:
        """Names of the controller nodes that fly it."""
        control = self.control
        return controllers(
            adaptive=control.learner is not None,
            guided=control.guidance is not None,
            own_law=isinstance(control, OwnLaw),
        )


def notes(case: Case) -> str:
    """What to file with the bag of a flight, as JSON: case, parameters, draw and versions."""
    content = {"case": case.name, "parameters": case.parameters, "versions": versions()}
    if case.draw is not None:
        content["draw"] = case.draw._asdict()
    if case.law is not None:
        content["law"] = {"name": case.law.name, "source": case.law.identity}
    return json.dumps(content)


def read_case(
    name: str,
    namespace: str = NAMESPACE,
    hardware: str | None = None,
    profile: str | None = None,
    law: str | None = None,
) -> tuple[str, dict[str, dict[str, object]]]:
    """Name of a case, and its parameters by node as case, hardware, profile and law give them."""
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
    if law is not None:
        return f"{path.stem}-{Path(law).stem}", dict(with_law(given, law))
    named = given[OWN_LAW].get("law")
    if isinstance(named, str) and named.endswith(".py"):
        given[OWN_LAW]["law"] = _law_place(str(path.parent / named))
    return path.stem, given


def with_law(given: Mapping[str, Mapping[str, object]], law: str) -> dict[str, dict[str, object]]:
    """Parameters `given` for each node with another law; settings of one of its name stay."""
    own, place = dict(given.get(OWN_LAW, {})), _law_place(law)
    if Path(str(own.get("law", ""))).stem not in ("", Path(law).stem):
        known = {parameter.name for parameter in NODES[OWN_LAW].parameters}
        own = {name: value for name, value in own.items() if name in known}
    changed = {node: dict(values) for node, values in given.items()}
    return changed | {OWN_LAW: own | {"law": place}}


def why_another_law(notes: Notes) -> str:
    """Why the law of a flight cannot be flown again as it was, in words; empty if it can."""
    flown, named = notes.content.get("law"), notes.parameters.get(OWN_LAW, {}).get("law")
    if not isinstance(flown, dict):
        return "names a law, but not its source" if named else ""
    try:
        here = law_identity(str(named))
    except ParameterError as error:
        return f"was flown by a law that is not here ({error})"
    if here == flown.get("source"):
        return ""
    return f"was flown by another source of its law ({flown.get('source')} there, {here} here)"


def _law_place(law: str) -> str:
    """A law as nodes and other processes find it, wherever they were started."""
    return str(Path(law).resolve()) if law.endswith(".py") else law


def load_case(
    name: str,
    plant: Mapping[str, object] | None = None,
    draw: Draw | None = None,
    namespace: str = NAMESPACE,
    hardware: str | None = None,
    profile: str | None = None,
    law: str | None = None,
) -> Case:
    """Case of a name in config/cases, or of a file; ParameterError names what is wrong with it.

    `plant` replaces parameters of the plant: a dispersion, another start or duration; `draw` says
    where the dispersion comes from, if it was drawn. The file is read as nodes in `namespace` do.
    `hardware` is a name of config/hardware, or a file, and `profile` one of config/profiles;
    their parameters stand above the case's. `law` is the name of a law, or its file, which flies
    in the place of the case's.
    """
    name, given = read_case(name, namespace, hardware, profile, law)
    given["plant"] |= plant or {}
    if draw is not None:  # the noise is that of the run, as in the campaign
        given["plant"] |= {"noise.seed": draw.seed, "noise.run": draw.run}
    case = make_case(name, given, draw)
    selected = str(case.parameters["guidance"]["selected"])
    if selected:
        raise ParameterError(
            f"{name}: guidance: selected is {excerpt(selected)}, but must be empty before a flight"
        )
    return case


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
    name: str,
    given: Mapping[str, Mapping[str, object]],
    draw: Draw | None = None,
    *,
    to_fly: bool = True,
) -> Case:
    """Case of the parameters `given` for each node; ParameterError names what is wrong.

    A case that is not `to_fly` runs no law of anybody's: it tells what was flown, no more.
    """
    named = given.get(OWN_LAW, {}).get("law", "")
    law = load_law(str(named)) if named and to_fly else None
    parameters = {
        node: check_parameters(
            f"{name}: {node}",
            (*NODES[node].parameters, *_of_law(node, law, given)),
            given.get(node, {}),
        )
        for node in case_nodes()
    }
    outer, velocity = parameters["outer_intermediate"], parameters["velocity"]
    held = {"altitude": outer["altitude"], "speed": velocity["speed"]}
    for node in ("guidance", OWN_LAW):
        own = parameters[node]
        own |= held | {key: own[key] for key in held if key in given.get(node, {})}
    plant = plant_settings(parameters["plant"])
    parameters[OWN_LAW]["surfaces_measured"] = plant.hardware is not None
    if plant.hardware is None:  # surfaces are where they are commanded to be: nobody measures them
        learner = parameters["disturbance_learner"]
        if learner["observer_surfaces"] == MEASURED:
            learner["observer_surfaces"] = COMMANDED
    _check_commands(parameters, plant)
    guiding = _guidance(name, parameters, plant)
    if named:
        values = parameters[OWN_LAW]
        to_hold = float(values["altitude"]), float(values["speed"]), guiding
        flown = OwnLaw(None, *to_hold) if law is None else law.control(values, *to_hold)
        return Case(name, parameters, plant, flown, draw, law)
    adaptive = parameters["inner_loop"]["adaptive"]
    control = FlightControl(
        outer_loop(parameters["outer_intermediate"]),
        intermediate_loop(parameters["outer_intermediate"]),
        inner_loop(parameters["inner_loop"]),
        velocity_loop(parameters["velocity"]),
        learner_settings(parameters["disturbance_learner"]) if adaptive else None,
        guiding,
    )
    return Case(name, parameters, plant, control, draw)


def _of_law(
    node: str, law: Law | None, given: Mapping[str, Mapping[str, object]]
) -> tuple[Parameter, ...]:
    """Settings of a law among the parameters of a node; of one that is not loaded as given."""
    values = given.get(OWN_LAW, {})
    if node != OWN_LAW or not values.get("law"):
        return ()
    if law is not None:
        return law.parameters
    known = {parameter.name for parameter in NODES[OWN_LAW].parameters}
    return tuple(
        Parameter(name, value, "setting of the law")
        for name, value in values.items()
        if name not in known and isinstance(value, bool | int | float | str)
    )


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
    check_reach(made, plant.initial.mass, plant.truth.geometric)
    return made


def _check_commands(parameters: Mapping[str, Mapping[str, Value]], plant: PlantSettings) -> None:
    """Raise ParameterError for an altitude or a speed at which the vehicle model does not hold."""
    altitude = float(parameters["outer_intermediate"]["altitude"])
    speed = float(parameters["velocity"]["speed"])
    try:
        check_flight_condition(altitude, speed, plant.initial.mass, plant.truth.geometric)
    except ValueError as error:
        raise ParameterError(f"outer_intermediate, velocity: commanded {error}") from error
