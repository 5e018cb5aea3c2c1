# Copyright 2026 ahv developers, Apache-2.0
"""Case files: a flight's settings as a ROS parameter file. One may name a base, and what differs.

A node that is given such a file by `--params-file` reads its base as `ahv fly` does.
"""

import logging
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from ahv_msgs_py.config import config_folder
from ahv_msgs_py.graph import NODES, case_nodes
from ahv_msgs_py.parameter_file import read_parameter_file
from ahv_msgs_py.parameters import (
    BASE,
    SIMULATED_TIME,
    ParameterError,
    check_time,
    ignored,
    meant,
)
from ahv_msgs_py.topics import NAMESPACE

EVERY_NODE = "/**"
Given = dict[str, dict[str, object]]  # parameters by node


def case_names() -> list[str]:
    """Cases that come with the package."""
    return sorted(path.stem for path in (config_folder() / "cases").glob("*.yaml"))


def case_path(name: str) -> Path:
    """File of a case of the package; ParameterError lists what there is."""
    if name not in case_names():
        raise ParameterError(
            f"there is no case {name!r}; {meant(name, case_names())}"
            f"valid are {', '.join(case_names())}"
        )
    return config_folder() / "cases" / f"{name}.yaml"


def with_base(node: str, given: Mapping[str, object]) -> dict[str, object]:
    """Parameters `given` to a node; those of the base that they name stand where they have none.

    ParameterError if there is no such base.
    """
    own = {name: value for name, value in given.items() if name != BASE}
    if BASE not in given:
        return own
    try:
        base = _base(str(given[BASE]))
    except ParameterError as error:
        raise ParameterError(f"{node}: {BASE}: {error}") from error
    return base.get(node, {}) | own


@cache
def _base(name: str) -> Given:
    return read_case_file(case_path(name))


def read_case_file(path: Path, namespace: str = NAMESPACE) -> Given:
    """Parameters by node, read as nodes in `namespace` do; ParameterError names what is wrong.

    Those of `/**` are given to all nodes that know them; what none knows is ignored, which is
    logged.
    """
    sections = read_parameter_file(path)
    # of one node in any namespace, or in its own, as ROS has it
    places = {
        f"{where.rstrip('/')}/{node}": node
        for where in (EVERY_NODE, namespace)
        for node in case_nodes()
    }
    valid = [EVERY_NODE, *places]
    if not sections:
        raise ParameterError(f"{path.name}: must have sections {', '.join(valid)}")
    for section in sections:
        if section not in valid:
            raise ParameterError(
                f"{path.name}: there is no node {section!r}; {meant(section, valid)}"
                f"valid are {', '.join(valid)}"
            )
    shared = sections.get(EVERY_NODE, {})
    known = {
        node: {BASE} | {parameter.name for parameter in NODES[node].parameters}
        for node in case_nodes()
    }
    check_time(f"{path.name}: {EVERY_NODE}", shared.get(SIMULATED_TIME, False))
    everything = set().union(*known.values())
    for name in sorted(shared.keys() - everything - {SIMULATED_TIME}):
        logging.getLogger(__name__).warning(
            "%s: %s: %s", path.name, EVERY_NODE, ignored(name, everything)
        )
    own: Given = {node: {} for node in case_nodes()}
    for section, node in places.items():
        body = sections.get(section, {})
        twice = sorted((shared.keys() | own[node].keys()) & body.keys())
        if twice:
            other = EVERY_NODE if twice[0] in shared else f"{EVERY_NODE}/{node}"
            raise ParameterError(
                f"{path.name}: {twice[0]} stands in {other} and in {section}; once is enough"
            )
        own[node] |= body
    return {
        node: with_base(
            node, {name: shared[name] for name in shared if name in known[node]} | own[node]
        )
        for node in case_nodes()
    }
