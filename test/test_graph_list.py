# Copyright 2026 ahv developers, Apache-2.0
"""The graph is written down once: no other file lists its nodes."""

import ast
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest

from ahv_msgs_py.graph import NODES, case_nodes, controllers, listeners
from ahv_msgs_py.topics import BY_NAME

pytestmark = pytest.mark.unit

ROOT = Path(__file__).parent.parent
LIST = ROOT / "ahv_msgs_py" / "graph.py"
SOURCES = [
    path
    for where in ("ahv_*/**/*.py", "launch/*.py", "setup.py", "test/*.py")
    for path in ROOT.glob(where)
]
MOST = 2  # names side by side that are no list of the graph


def node_names(tree):
    """Names of nodes that stand side by side as elements or keys of one literal."""
    for literal in ast.walk(tree):
        elements = getattr(literal, "elts", None) or getattr(literal, "keys", None) or ()
        constants = {one.value for one in elements if isinstance(one, ast.Constant)}
        yield constants & set(NODES)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_lists_the_nodes_again(path):
    listed = max(node_names(ast.parse(path.read_text())), key=len, default=set())
    assert len(listed) <= MOST, f"{path.name} lists {listed}: read them in {LIST.name}"


def test_a_list_would_be_found():
    code = 'FIRST = ("plant", "inner_loop", "velocity")\nSECOND = {"plant": 1, "velocity": 2}'
    assert sorted(len(names) for names in node_names(ast.parse(code)) if names) == [2, 3]


def test_the_list_is_read_before_anything_is_installed():
    """As setup.py reads it, by its path; without site-packages there is nothing but Python."""
    code = f"import runpy; print(*runpy.run_path({str(LIST)!r})['NODES'])"
    read = subprocess.run([sys.executable, "-I", "-S", "-c", code], capture_output=True, text=True)
    assert read.stdout.split() == list(NODES), read.stderr


def test_every_topic_of_the_loop_has_one_sender():
    for own_law in (False, True):
        names = ["plant", *controllers(adaptive=not own_law, guided=True, own_law=own_law)]
        sent = [topic for name in names for topic in NODES[name].sends]
        learned = {"disturbance_estimate", "learner"} if own_law else set()
        assert sorted(sent) == sorted({*BY_NAME} - learned)
    assert {topic for node in NODES.values() for topic in node.hears} <= set(BY_NAME)
    assert not listeners("attitude_command"), "it is for those who look on"


def test_controllers_answer_in_the_order_of_the_loop():
    """None of them waits in a step for one that comes after it, but the learner for all."""
    for adaptive, guided, own_law in product((False, True), repeat=3):
        heard = ["state", "surfaces"] if own_law else ["state"]
        names = controllers(adaptive and not own_law, guided, own_law)
        for name in names:
            if name != "disturbance_learner":
                flown = [node.sends for node in map(NODES.get, names)]
                missing = {*NODES[name].hears} & {topic for sent in flown for topic in sent}
                assert missing <= {*heard}
            heard += NODES[name].sends
    loops = controllers(adaptive=True, guided=True)
    own = controllers(adaptive=False, guided=True, own_law=True)
    assert own == ["guidance", "flight_control"], "it takes the place of every loop"
    assert set(case_nodes()) == {"plant", *loops, *own}
