# Copyright 2026 ahv developers, Apache-2.0
"""The package installs by pip and by colcon alike: executables, index, cases, launch file."""

import json
import runpy
import shutil
import subprocess
import sys
import zipfile
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType, SimpleNamespace
from xml.etree import ElementTree

import pytest

from ahv_analysis.flight.case import case_names, load_case
from ahv_msgs_py.graph import NODES, controllers
from ahv_msgs_py.node.network import DISCOVERY_RANGE
from ahv_msgs_py.parameters import ParameterError
from ahv_msgs_py.topics import LOOP_TOPICS, VIEWER_TOPICS

ROOT = Path(__file__).parent.parent
BUILT_FROM = ("package.xml", "setup.py", "setup.cfg", "pyproject.toml", "README.md", "LICENSE")
BUILDS_WHEELS = find_spec("setuptools.command.bdist_wheel") or find_spec("wheel")


CONTROLLERS = controllers(adaptive=False)


def handed_over(monkeypatch, folder, command):
    """What setup.py in `folder` hands to setuptools when it is called with a command."""
    given = {}
    monkeypatch.chdir(folder)
    monkeypatch.setattr("sys.argv", ["setup.py", command])
    monkeypatch.setattr("setuptools.setup", lambda **options: given.update(options))
    runpy.run_path("setup.py")
    return given


@pytest.fixture
def setup(monkeypatch):
    """What setup.py hands to setuptools for colcon."""
    return handed_over(monkeypatch, ROOT, "install")


@pytest.fixture
def manifest():
    return ElementTree.parse(ROOT / "package.xml").getroot()


def executables(setup):
    return dict(line.split(" = ") for line in setup["entry_points"]["console_scripts"])


def test_every_executable_is_a_function(setup):
    names = executables(setup)
    assert set(names) == {"ahv", *NODES}
    for target in names.values():
        module, function = target.split(":")
        assert callable(getattr(import_module(module), function))


@pytest.mark.parametrize("command", ["dist_info", "bdist_wheel", "editable_wheel"])
def test_programs_of_pip_lie_among_those_of_others_and_have_a_prefix(
    monkeypatch, sources, command
):
    names = set(executables(handed_over(monkeypatch, sources, command)))
    assert names == {"ahv", *(f"ahv-{name}" for name in NODES)}


def test_launcher_becomes_the_program_of_its_name(monkeypatch, sources, tmp_path):
    data = dict(handed_over(monkeypatch, sources, "bdist_wheel")["data_files"])
    launchers = {Path(path).name: path for path in data["lib/ahv"]}
    assert set(launchers) == {"ahv", *NODES}
    launcher, program = tmp_path / "lib" / "ahv" / "plant", tmp_path / "bin" / "ahv-plant"
    for path in (launcher, program):
        path.parent.mkdir(parents=True)
    shutil.copy(sources / launchers["plant"], launcher)
    program.write_text('#!/bin/sh\nprintf "%s," $$ "$@"\nexit 7\n')
    program.chmod(0o755)
    with subprocess.Popen([launcher, "-p", "two words"], stdout=subprocess.PIPE) as process:
        assert process.stdout.read().decode() == f"{process.pid},-p,two words,"
    assert process.returncode == 7


@pytest.fixture
def sources(setup, tmp_path):
    """Copy what a build reads: it writes beside it."""
    folder = tmp_path / "sources"
    packages = {package.partition(".")[0] for package in setup["packages"]}
    for name in (*packages, "config", "launch", "resource"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in BUILT_FROM:
        shutil.copy(ROOT / name, folder)
    return folder


@pytest.mark.skipif(not BUILDS_WHEELS, reason="this setuptools cannot build a wheel")
def test_wheel_carries_what_ros_looks_for(setup, sources, tmp_path):
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--no-build-isolation", "-w", tmp_path, sources], check=True)
    (path,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(path) as wheel:
        modes = {info.filename: info.external_attr >> 16 for info in wheel.infolist()}
        commands = wheel.read(f"ahv-{setup['version']}.dist-info/entry_points.txt").decode()
    data = f"ahv-{setup['version']}.data/data"
    assert {line.split(" = ")[0] for line in commands.splitlines()[1:] if line} == {
        "ahv",
        *(f"ahv-{node}" for node in NODES),
    }
    for node in ("ahv", *NODES):
        assert modes[f"{data}/lib/ahv/{node}"] & 0o111 == 0o111
    expected = ["ament_index/resource_index/packages/ahv", "ahv/package.xml"]
    expected += [f"ahv/config/cases/{case}.yaml" for case in case_names()]
    expected += [f"ahv/config/viewers/{path.name}" for path in ROOT.glob("config/viewers/*")]
    expected += ["ahv/launch/flight.launch.py", "ahv/launch/replay.launch.py"]
    assert {f"{data}/share/{name}" for name in expected} <= set(modes)
    code = [path for path in ROOT.glob("ahv_*/**/*") if path.is_file()]
    ours = {str(path.relative_to(ROOT)) for path in code if path.parent.name != "__pycache__"}
    assert ours <= set(modes)
    assert not [name for name in modes if name.startswith(("test", "studies"))]


def test_colcon_puts_the_nodes_themselves_where_pip_puts_launchers(setup):
    assert "lib/ahv" not in dict(setup["data_files"])
    assert "install_scripts=$base/lib/ahv" in (ROOT / "setup.cfg").read_text()
    assert "pytest" in setup["extras_require"]["test"], "or `colcon test` runs nothing"


def test_package_xml_says_what_setup_says(setup, manifest):
    assert manifest.get("format") == "3"
    assert manifest.findtext("name") == setup["name"] == "ahv"
    assert manifest.findtext("version") == setup["version"]
    assert manifest.findtext("license") == setup["license"] == "Apache-2.0"
    assert manifest.findtext("export/build_type") == "ament_python"
    assert "Version 2.0, January 2004" in (ROOT / "LICENSE").read_text()


def test_package_xml_names_every_package_of_messages(manifest):
    known = {element.text for element in manifest.iter("exec_depend")}
    types = [topic.layout.type_name for topic in LOOP_TOPICS]
    types += [topic.type_name for topic in VIEWER_TOPICS]
    assert {name.split("/")[0] for name in types} <= known


class Noted(SimpleNamespace):
    """Stands for any class of ROS's launch, which cannot be had by pip: keeps its options."""

    def __init__(self, *values, **options):
        super().__init__(values=values, **options)

    def perform(self, context):
        return context[self.values[0]]


@pytest.fixture
def launch(monkeypatch):
    """The launch file: what it starts for given arguments, as options of nodes by name."""
    names = ("launch", "launch.actions", "launch.substitutions", "launch.events.process")
    for name in (*names, "launch_ros.actions"):
        module = ModuleType(name)
        module.__getattr__ = lambda _: Noted
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setitem(sys.modules, "launch_ros", ModuleType("launch_ros"))
    description = runpy.run_path(str(ROOT / "launch" / "flight.launch.py"))
    *arguments, start = description["generate_launch_description"]().values[0]
    defaults = {argument.values[0]: argument.default_value for argument in arguments}
    return lambda **given: {node.name: node for node in start.function(defaults | given)}


ADDED = """    GraphNode(
        "navigation",
        "ahv_control.velocity_node",
        "VelocityNode",
        "ahv_control.parameters.VELOCITY_PARAMETERS",
        hears=("state",),
        sends=("position",),
        controller=True,
    ),
"""


def test_one_entry_adds_a_node_to_all_that_start_nodes(monkeypatch, launch, sources, tmp_path):
    graph = sources / "ahv_msgs_py" / "graph.py"
    graph.write_text(graph.read_text().replace("_NODES = (\n", f"_NODES = (\n{ADDED}"))
    given = handed_over(monkeypatch, sources, "bdist_wheel")
    assert executables(given)["ahv-navigation"] == "ahv_msgs_py.program:navigation"
    assert "build/launchers/navigation" in dict(given["data_files"])["lib/ahv"]
    node = runpy.run_path(str(graph))["NODES"]["navigation"]
    monkeypatch.setitem(NODES, "navigation", node)
    assert set(launch()) == {"recorder", "plant", "navigation", *CONTROLLERS}
    case = tmp_path / "case.yaml"
    case.write_text("/ahv/navigation: {ros__parameters: {speed: 1800.0}}")
    flown = load_case(str(case))
    assert "navigation" in flown.controllers
    assert flown.parameters["navigation"]["speed"] == 1800.0


LOCKSTEP = {"realtime": False, "autostart": True}


def test_launch_starts_a_process_per_node_from_one_case(launch, setup):
    nodes = launch(out="flights/one")
    assert set(nodes) == {"recorder", "plant", *CONTROLLERS} <= set(executables(setup))
    assert next(iter(nodes)) == "recorder" and list(nodes)[-1] == "plant"
    for name, node in nodes.items():
        assert (node.package, node.executable, node.namespace) == ("ahv", name, "/ahv")
        assert node.parameters[0] == str(ROOT / "config" / "cases" / "nominal_di.yaml")
    bag = str(Path("flights/one/bag").resolve())
    notes = json.dumps({"case": "nominal_di"})
    assert nodes["recorder"].parameters[1:] == [LOCKSTEP | {"bag": bag, "notes": notes}]
    assert nodes["plant"].parameters[1:] == [LOCKSTEP | {"listeners": 4}]
    assert all(hasattr(node, "on_exit") for node in nodes.values())


def test_launched_guidance_starts_where_the_loops_of_the_case_would_stay(launch, tmp_path):
    case = tmp_path / "case.yaml"
    case.write_text(
        "/**: {ros__parameters: {base: nominal_di, guided: true}}\n"
        "/**/outer_intermediate: {ros__parameters: {altitude: 24300.0}}\n"
    )
    nodes = launch(case=str(case))
    start = {"altitude": 24300.0, "speed": 1786.4}
    assert nodes["guidance"].parameters[1:] == [LOCKSTEP | start]
    assert nodes["velocity"].parameters[1:] == [LOCKSTEP]


def test_launch_flies_a_profile_on_hardware_as_the_command_does(launch):
    nodes = launch(profile="waypoints", hardware="typical", case="neuro_adaptive_di")
    case = load_case("neuro_adaptive_di", hardware="typical", profile="waypoints")
    assert set(nodes) == {"recorder", "plant", *case.controllers}
    base = load_case("neuro_adaptive_di").parameters
    for name in ("plant", *case.controllers):
        above = nodes[name].parameters[1:-1]
        assert len(above) <= 1
        given = base[name] | (above[0] if above else {}) | nodes[name].parameters[-1]
        known = base[name].keys() - {"listeners"}
        assert {key: given[key] for key in known} == {
            key: case.parameters[name][key] for key in known
        }, name
    with pytest.raises(ParameterError, match="profile 'loop' is neither"):
        launch(profile="loop")


def test_launch_adds_the_learner_to_adaptive_cases(launch):
    nodes = launch(case="neuro_adaptive_di")
    assert set(nodes) == set(NODES) - {"guidance", "flight_control"}
    assert nodes["plant"].parameters[1:] == [LOCKSTEP | {"listeners": 5}]


def test_launch_in_real_time_starts_controllers_again(launch, tmp_path):
    dispersion = tmp_path / "vehicle.yaml"
    dispersion.write_text("/ahv/plant: {ros__parameters: {dispersion: {CL: 1.1}}}")
    nodes = launch(realtime="true", record="false", dispersion=str(dispersion))
    assert set(nodes) == {"plant", *CONTROLLERS}
    assert all(nodes[name].respawn for name in CONTROLLERS)
    assert nodes["plant"].parameters[1] == str(dispersion)
    assert nodes["plant"].parameters[2] == LOCKSTEP | {"realtime": True, "listeners": 3}


def test_launch_keeps_to_this_machine_unless_it_is_told_otherwise(launch):
    assert not any(hasattr(node, "additional_env") for node in launch().values())
    for node in launch(network="true").values():
        assert node.additional_env == {DISCOVERY_RANGE: "SUBNET"}


def test_launch_names_what_is_neither_true_nor_false(launch):
    with pytest.raises(ValueError, match="realtime is 'maybe'"):
        launch(realtime="maybe")


def test_launch_takes_a_file_and_names_one_that_is_not_there(launch):
    file = ROOT / "config" / "cases" / "nominal_di.yaml"
    assert launch(case=str(file))["plant"].parameters[0] == str(file)
    with pytest.raises(ParameterError, match=r"typo\.yaml' is neither a YAML file nor one of"):
        launch(case="typo")


def test_launch_refuses_before_a_node_starts_what_would_be_refused_then(launch, tmp_path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(FileExistsError, match=f"cannot write a bag to {tmp_path}/bag: it exists"):
        launch(out=str(tmp_path))
    assert launch(out=str(tmp_path), record="false")
    case = tmp_path / "case.yaml"
    case.write_text("/**/plant: {ros__parameters: {duration: -3.0}}")
    with pytest.raises(ParameterError, match=r"plant: duration is -3\.0"):
        launch(case=str(case))
    with pytest.raises(ParameterError, match="plant: duration has no place in a disp"):
        case.write_text("/**/plant: {ros__parameters: {duration: 3.0}}")
        launch(dispersion=str(case))
    with pytest.raises(ValueError, match="listeners is '-1', but must be an integer from 0 on"):
        launch(listeners="-1")


def test_launch_puts_a_vehicle_into_a_namespace_with_a_clock_of_its_own(launch, tmp_path):
    nodes = launch(namespace="uav1", listeners="2")
    for node in nodes.values():
        assert node.namespace == "/uav1"
        assert ("/clock", "clock") in node.remappings and ("/tf", "tf") in node.remappings
    assert nodes["plant"].parameters[1]["listeners"] == 4 + 2
    assert all(node.remappings == [] for node in launch().values())
    case = tmp_path / "case.yaml"
    case.write_text("/ahv/plant: {ros__parameters: {duration: 3.0}}")
    assert launch(case=str(case))
    with pytest.raises(ParameterError, match=r"no node '/ahv/plant'; did you mean '/uav1/plant'"):
        launch(case=str(case), namespace="/uav1")


def ending(node, code, shut=False):
    """Return what follows when a node ends with an exit code, as names of actions."""
    context = SimpleNamespace(is_shutdown=shut)
    actions = node.on_exit(SimpleNamespace(returncode=code), context)
    later = [action for one in actions for action in getattr(one, "actions", ())]
    return [end for one in later for end in one.function(context)] or actions


def test_a_node_that_fails_fails_the_launch(launch):
    """launch ends with exit code 1 if a handler raises, and with 0 however its processes ended."""
    nodes = launch()
    assert ending(nodes["plant"], 0) and ending(nodes["velocity"], 0)
    assert ending(nodes["recorder"], 0) == [], "the plant is still to end"
    for name in nodes:
        with pytest.raises(RuntimeError, match=f"^{name} ended with exit code 2$"):
            ending(launch()[name], 2)
        assert ending(launch()[name], 2, shut=True) == []
    nodes = launch(realtime="true")
    assert ending(nodes["velocity"], -9) == [], "it is started again"
    assert ending(nodes["recorder"], 1) == [], "the flight goes on without a record"
    with pytest.raises(RuntimeError, match="recorder ended with exit code 1"):
        ending(nodes["plant"], 0)
    with pytest.raises(RuntimeError, match="velocity ended with exit code 2"):
        ending(launch(realtime="true")["velocity"], 2)
