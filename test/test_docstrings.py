# Copyright 2026 ahv developers, Apache-2.0
"""Docstrings of the pure packages say what a number is measured in, and where a law comes from.

Read from the source, so that compiled functions count like any other. That there is a docstring at
all is ruff's business.
"""

import ast
import itertools
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.unit

ROOT = Path(__file__).parent.parent
SOURCES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts): path.read_text()
    for package in ("ahv_plant", "ahv_control", "ahv_msgs_py")
    for path in sorted((ROOT / package).rglob("*.py"))
    if not path.name.endswith(("_node.py", "__init__.py"))
}
# Tools, and what crosses a topic: no equation of the report stands behind them.
_NUMERICS = (
    "compiling",
    "elementwise",
    "simd",
    "elementary",
    "optional",
    "identity",
    "cache",
    "by_type",
    "lane_rules",
)
OWN = {f"ahv_plant.numerics.{name}" for name in _NUMERICS}
OWN |= {
    "ahv_plant.model.vectors",
    "ahv_plant.termination",
    "ahv_plant.safe_command",
    "ahv_plant.viewer_pose",
    "ahv_plant.winged_cone",
    "ahv_control.held_inputs",
    "ahv_plant.parameters",
    "ahv_plant.plant",
    "ahv_plant.plant_flight",
    "ahv_plant.hardware.actuator_parameters",
    "ahv_plant.hardware.actuators",
    "ahv_plant.hardware.delay",
    "ahv_plant.hardware.motion",
    "ahv_plant.hardware.parameters",
    "ahv_plant.hardware.wind_parameters",
    "ahv_control.parameters",
    "ahv_control.law_file",
    "ahv_control.learner_message",
}
assert set(SOURCES) >= OWN
LAWS = [name for name in SOURCES if name not in OWN and not name.startswith("ahv_msgs_py")]

_FACTOR = r"(?:m|s|kg|N|Pa|J|K|rad|deg|ms|ns|Hz|1)(?:\^\d)?"
UNIT = re.compile(rf"\[(?:-|{_FACTOR}(?:[ /]\(?{_FACTOR}\)?)*(?:, [^]]+)?)[\] ]")
IN_WORDS = re.compile(r"in degrees|in deg/s|any unit|their units|units of")
ORIGIN = re.compile(r"\b(?:eqs?|[Ss]ections?|[Cc]hapters?|Table|Fig\.) [1-5]|\b(?:19|20)\d\d\b")


def says_its_unit(text):
    return bool(text and (UNIT.search(text) or IN_WORDS.search(text)))


def public(nodes, kind):
    return [node for node in nodes if isinstance(node, kind) and not node.name.startswith("_")]


def functions(tree):
    """Public functions, and public methods of public classes."""
    found = public(tree.body, ast.FunctionDef)
    for owner in public(tree.body, ast.ClassDef):
        found += public(owner.body, ast.FunctionDef)
    return found


def handles_numbers(function):
    notes = [argument.annotation for argument in function.args.args] + [function.returns]
    return any(note and re.search(r"\bfloat\b", ast.unparse(note)) for note in notes)


def comments_on(text, node):
    """What is written behind a statement, and at the head of its paragraph for all of it."""
    lines = text.splitlines()
    behind = [line.partition("#")[2] for line in lines[node.lineno - 1 : node.end_lineno]]
    head = node.lineno - 1
    while head > 0 and lines[head - 1].strip():
        head -= 1
    above = itertools.takewhile(lambda line: line.startswith("#"), lines[head:])
    return behind + [line[1:] for line in above]


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("speed [m/s]", True),
        ("inertia [kg m^2]", True),
        ("air [J/(kg K)]", True),
        ("rates [rad/s^2, rad/s]", True),
        ("ratio [-]", True),
        ("weights of the learner, in degrees", True),
        ("between [lower, upper]", False),
        ("from [0.1, 0.9]", False),
        ("speed in knots [kn]", False),
        (None, False),
    ],
)
def test_a_unit_is_known_when_it_is_seen(text, unit):
    assert says_its_unit(text) == unit


@pytest.mark.parametrize("name", SOURCES)
def test_functions_of_numbers_say_their_units(name):
    for function in functions(ast.parse(SOURCES[name])):
        if handles_numbers(function):
            assert says_its_unit(ast.get_docstring(function)), function.name


@pytest.mark.parametrize("name", SOURCES)
def test_fields_that_are_numbers_say_their_units(name):
    """Each beside the field, or one for all in the docstring of the class."""
    lines = SOURCES[name].splitlines()
    for owner in public(ast.parse(SOURCES[name]).body, ast.ClassDef):
        if says_its_unit(ast.get_docstring(owner)):
            continue
        for field in owner.body:
            if isinstance(field, ast.AnnAssign) and ast.unparse(field.annotation) == "float":
                comment = lines[field.end_lineno - 1].partition("#")[2]
                assert says_its_unit(comment), f"{owner.name}.{field.target.id}"


@pytest.mark.parametrize("name", SOURCES)
def test_constants_say_their_units(name):
    for node in ast.parse(SOURCES[name]).body:
        if not isinstance(node, ast.Assign) or isinstance(node.value, ast.Call):
            continue  # the type that is called says its units
        values = [part.value for part in ast.walk(node.value) if isinstance(part, ast.Constant)]
        if float in map(type, values) and str not in map(type, values):
            said = any(map(says_its_unit, comments_on(SOURCES[name], node)))
            assert said, ast.unparse(node.targets[0])


@pytest.mark.parametrize("name", LAWS)
def test_laws_say_where_they_come_from(name):
    """Equation, section or publication: in the module's docstring, or in every function's."""
    tree = ast.parse(SOURCES[name])
    if not ORIGIN.search(ast.get_docstring(tree)):
        for function in functions(tree):
            assert ORIGIN.search(ast.get_docstring(function)), function.name
