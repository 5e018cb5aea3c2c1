# Copyright 2026 ahv developers, Apache-2.0
"""A parameter file means the same to `ahv fly`, to a node and to ROS, or is refused."""

import json
import subprocess
import sys

import pytest

from ahv_msgs_py.parameter_file import given_files, read_parameter_file, shared_names
from ahv_msgs_py.parameters import ParameterError
from test.test_command import ahv
from test.waiting import PATIENCE

NODE = "/ahv/velocity"
AHEAD = f"{NODE}:\n  ros__parameters:\n"
VALUES = [
    "0.01",
    "1e-2",
    "1e3",
    "1E3",
    ".5",
    "5.",
    "+1.5",
    "1.e+3",
    "2",
    "-3",
    "0",
    "0.10",
    "0x10",
    "-0x1",
    "99999999999999999999",
    "inf",
    "yes",
    "On",
    "True",
    "false",
    "no",
    ".inf",
    "text",
    "'2.0'",
    '"1"',
    "'024000'",
    "'6:40:00'",
    "2001-01-01",
    "0o17",
    "[1.0,2.0]",
    "[a,b]",
]


@pytest.fixture
def read(tmp_path):
    def reader(text):
        path = tmp_path / "case.yaml"
        path.write_text(text, encoding="utf-8")
        return read_parameter_file(path)

    return reader


BY_ROS = """
import json, sys
import rclpy
from rclpy.node import Node
found = []
for path in sys.argv[1:]:
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "--params-file", path], context=context)
    node = Node("velocity", namespace="/ahv", context=context,
                automatically_declare_parameters_from_overrides=True)
    value = node.get_parameter("k_u").value
    found.append(value if isinstance(value, (bool, int, float, str)) else list(value))
    rclpy.shutdown(context=context)
print(json.dumps(found))
"""


@pytest.mark.graph
def test_a_value_is_to_ros_what_it_is_here(tmp_path):
    paths = [tmp_path / f"{number}.yaml" for number in range(len(VALUES))]
    for path, value in zip(paths, VALUES, strict=True):
        path.write_text(f"{AHEAD}    k_u: {value}\n")
    result = subprocess.run(
        [sys.executable, "-c", BY_ROS, *paths], capture_output=True, text=True, check=True
    )
    here = [read_parameter_file(path)[NODE]["k_u"] for path in paths]
    there = json.loads(result.stdout.splitlines()[-1])
    for value, mine, ros in zip(VALUES, here, there, strict=True):
        assert (type(mine), mine) == (type(ros), ros), value


@pytest.mark.unit
@pytest.mark.parametrize(
    "text, words",
    [
        (AHEAD + "    k_u: 024000\n", ("line 3", "k_u is 024000", "octal", "24000", "10240")),
        (AHEAD + "    k_u: 08\n", ("k_u is 08", "write 8")),
        (AHEAD + "    k_u: 6:40:00\n", ("k_u is 6:40:00", "sexagesimal", "write 24000")),
        (AHEAD + "    k_u: 1_000\n", ("underscores", "write 1000")),
        (AHEAD + "    k_u: 0b101\n", ("binary", "write 5")),
        (AHEAD + "    k_u: 0x1.8p1\n", ("hexadecimal",)),
        (AHEAD + "    k_u: y\n", ("truth to ROS", "true")),
        (AHEAD + "    k_u: ~\n", ("no value",)),
        (AHEAD + "    k_u:\n", ("k_u is empty", "no value")),
        (AHEAD + "    k_u: 1.0\n    k_u: 2.0\n", ("line 4", "k_u is given twice")),
        (AHEAD + "    a.b: 1.0\n    a: {b: 2.0}\n", ("a.b is given twice",)),
        (AHEAD + "    k_u: 1.0\n" + AHEAD + "    k_u: 2.0\n", ("/ahv/velocity is given twice",)),
        (AHEAD + "    k_u: &a 1.0\n", ("line 3", "no anchors")),
        (AHEAD + "    k_u: &a 1.0\n    k_v: *a\n", ("no anchors",)),
        (f"{NODE}: &x\n  ros__parameters: *x\n", ("no anchors",)),
        (AHEAD + "    <<: {k_u: 1.0}\n", ("a key must be a name",)),
        (AHEAD + "    k_u: !!float 2\n", ("no tags",)),
        (
            AHEAD + "    k_u: " + "{a: " * 100 + "1" + "}" * 100 + "\n",
            ("more than 16 sections",),
        ),
        (AHEAD + "    k_u: " + "[" * 100 + "]" * 100 + "\n", ("values only",)),
        (AHEAD + "    k_u: 1.0\n---\n" + AHEAD, ("second document",)),
        (AHEAD + "\t\tk_u: 1.0\n", ("not a readable YAML file",)),
        (f"{NODE}:\n  k_u: 1.0\n", ("ros__parameters",)),
        (f"{NODE}: 3\n", ("ros__parameters",)),
        ("[1, 2]\n", ("sections",)),
    ],
)
def test_what_yaml_and_ros_do_not_take_alike_is_refused(read, text, words):
    with pytest.raises(ParameterError) as error:
        read(text)
    sentence = str(error.value)
    assert sentence.startswith("case.yaml") and "\n" not in sentence
    assert all(word in sentence for word in words), sentence


@pytest.mark.unit
def test_dots_and_sections_are_the_same_names(read):
    nested = read(AHEAD + "    a: {b: {c: 1}, d: x}\n")
    assert nested == read(AHEAD + "    a.b.c: 1\n    a.d: x\n") == {NODE: {"a.b.c": 1, "a.d": "x"}}
    assert read("") == read("# a comment\n") == {}


NODE_PROGRAM = "from ahv_control.velocity_node import main; main()"


@pytest.mark.graph
def test_a_node_and_the_command_refuse_the_same_file_in_the_same_words(tmp_path):
    path = tmp_path / "twice.yaml"
    path.write_text(AHEAD + "    k_u: 0.01\n    k_u: 0.02\n")
    node = subprocess.run(
        [sys.executable, "-c", NODE_PROGRAM, "--ros-args", "--params-file", path],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    command = ahv("fly", path)
    assert node.returncode == command.returncode == 2
    assert node.stderr.strip() == "twice.yaml, line 4: k_u is given twice; once is enough"
    assert command.stderr.strip() == f"ahv: {node.stderr.strip()}"


@pytest.mark.unit
def test_what_is_for_all_nodes_is_told_from_what_is_for_one(tmp_path):
    paths = [tmp_path / "a.yaml", tmp_path / "b.yaml"]
    body = ":\n  ros__parameters: "
    paths[0].write_text(f"/**{body}{{a: 1, b: 1}}\n/**/velocity{body}{{b: 2, c: 2}}\n")
    paths[1].write_text(f"/ahv/*{body}{{d: 3}}\n/ahv/plant{body}{{a: 4}}\n")
    options = [word for path in paths for word in ("--params-file", str(path))]
    files = given_files(["velocity", "--ros-args", *options, "-p", "e:=5"])
    assert shared_names(files, "velocity") == {"a", "d"}
    assert shared_names(files, "plant") == {"b", "d"}


@pytest.mark.graph
def test_a_node_ignores_what_is_for_all_and_refuses_what_is_misspelt_for_it(tmp_path):
    path = tmp_path / "mine.yaml"
    shared = "/**:\n  ros__parameters:\n    k_x: 1.0\n    lambda: 0.8\n"
    path.write_text(f"{shared}{AHEAD}    k_uu: 0.01\n")
    node = subprocess.run(
        [sys.executable, "-c", NODE_PROGRAM, "--ros-args", "--params-file", path],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    ignored, refused = node.stderr.splitlines()
    assert ignored.startswith("[WARN]")
    assert "no parameter 'k_x'; did you mean 'k_u'? ignored, as it is for all nodes" in ignored
    assert refused.startswith("velocity: there is no parameter 'k_uu'; did you mean 'k_u'? valid")
    assert node.returncode == 2


@pytest.mark.unit
def test_a_number_that_never_ends_is_read_at_once(tmp_path):
    """Its digits are looked at once: twice as many do not take four times as long."""
    path = tmp_path / "long.yaml"
    path.write_text(f"/**: {{ros__parameters: {{a: {'9' * 200_000}x}}}}")
    code = "import sys; from pathlib import Path; from ahv_msgs_py.parameter_file import *; "
    code += "print(len(read_parameter_file(Path(sys.argv[1]))['/**']['a']))"
    done = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.stdout == "200001\n", done.stderr
