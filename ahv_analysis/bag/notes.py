# Copyright 2026 ahv developers, Apache-2.0
"""The custom data of a bag: other people's texts, until they are found to be ours."""

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from ahv_msgs_py.graph import case_nodes
from ahv_msgs_py.layout import MessageError, text_of
from ahv_msgs_py.parameters import Value

NOTES = "ahv"  # key of the notes of a flight
UNNAMED = "unnamed"  # case of nodes that were started by hand
RECOVERED = "ahv_recovered"  # key of what was lost before a recovery
LONGEST_NAME = 255  # characters of a case, which is that of a file
_NODES = ("plant", "inner_loop")  # without which there is no flight


class Notes(NamedTuple):
    """What `ahv fly` files with a bag."""

    case: str
    parameters: dict[str, dict[str, Value]]  # of every node
    content: dict[str, Any]  # all of it

    @property
    def planned(self) -> float | None:
        """How long the flight should be [s]."""
        return _number(self.parameters["plant"].get("duration"))

    @property
    def adaptive(self) -> bool:
        """Whether the learner flew."""
        return self.parameters["inner_loop"].get("adaptive") is True

    @property
    def geometric(self) -> bool:
        """Whether altitudes are geometric."""
        return self.parameters["plant"].get("geometric_altitude") is True


def read_notes(custom: Mapping[str, str]) -> Notes | None:
    """Notes of a flight among the texts of a bag; None if there are none of the shape of ours."""
    content = json_object(custom.get(NOTES, ""))
    if not names_a_case(content):
        return None
    return Notes(content["case"], content["parameters"], content)


def names_a_case(content: Mapping[str, Any]) -> bool:
    """Whether something has a case and parameters of nodes, of whatever values."""
    case, parameters = content.get("case"), content.get("parameters")
    if not isinstance(case, str) or not isinstance(parameters, dict):
        return False
    if len(case) > LONGEST_NAME or not case.isprintable():
        return False
    if not all(node in parameters for node in _NODES):
        return False
    return all(
        isinstance(values, dict)
        and all(isinstance(value, bool | int | float | str) for value in values.values())
        for values in parameters.values()
    )


def told_of(data: bytes) -> tuple[str, dict[str, Value]]:
    """A node and its settings as it told them; MessageError if they are none."""
    try:
        told = json.loads(text_of(data))
        return str(told["node"]), dict(told["settings"])
    except (ValueError, KeyError, TypeError) as error:
        raise MessageError(f"no settings of a node: {error}") from error


def told_notes(messages: Iterable[bytes]) -> Notes | None:
    """Notes by what the nodes of a flight told of their settings, for a bag that has no others."""
    told: dict[str, dict[str, Value]] = {}
    for data in messages:
        with suppress(MessageError):  # what is no setting says nothing of the flight
            node, settings = told_of(data)
            told |= {node: settings} if node in case_nodes() else {}
    return read_notes({NOTES: json.dumps({"case": UNNAMED, "parameters": told})})


def read_losses(custom: Mapping[str, str]) -> dict[str, Any] | None:
    """What a recovery says that was lost; None in a bag that was not recovered."""
    if RECOVERED not in custom:
        return None
    content = json_object(custom[RECOVERED])
    lost = content.get("lost_messages")
    return content | {"lost_messages": lost if isinstance(lost, int) else None}


def json_object(text: str) -> dict[str, Any]:
    """Return the JSON object that a text is, empty if it is none that can be written again."""
    try:
        content = json.loads(text, parse_constant=_refuse, parse_int=_integer)
        text.encode()
        json.dumps(content, ensure_ascii=False, allow_nan=False).encode()
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no number of JSON")


def _integer(text: str) -> int:
    number = int(text)
    if abs(number) >= 2**63:
        raise ValueError("an integer of JSON is too large for anybody")
    return number


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None
