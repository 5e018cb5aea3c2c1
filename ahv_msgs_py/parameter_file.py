# Copyright 2026 ahv developers, Apache-2.0
"""ROS parameter files, read the one way that YAML and ROS agree on.

YAML readers and rcl_yaml_param_parser differ in what a value without quotes means, both let the
last of two equal keys win, and neither says so. What they take differently is refused here, with
what was meant; a node reads the files of its `--params-file` here before ROS does.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import yaml  # type: ignore[import-untyped]

from ahv_msgs_py.parameters import ParameterError

PARAMETERS = "ros__parameters"
DEEPEST = 16  # sections within sections
LARGEST = 2**63  # integers that ROS holds are below

INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]*|0x[0-9a-fA-F]+)")
NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
NOT_FINITE = re.compile(r"([-+]?)\.?(inf|infinity|nan)", re.IGNORECASE)
SEXAGESIMAL = re.compile(r"([-+]?)([0-9]+(?::[0-9]+)+)(\.[0-9]*)?")
TRUTH = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
# what YAML and ROS do not take alike, and why
DOUBTFUL = (
    (re.compile(r"[-+]?0[0-9_]+"), "it begins with a zero, which makes it octal"),
    (re.compile(r"[-+]?0b[01_]+"), "it is binary"),
    (re.compile(r"[-+]?0x.*"), "it is no hexadecimal integer"),
    (re.compile(r"[-+]?[0-9.][0-9_.]*_[0-9_.]*([eE].*)?"), "it has underscores"),
    (re.compile(r"[yYnN]"), "it is a truth to ROS and a letter to YAML"),
    (re.compile(r"|~|null|Null|NULL"), "it has no value"),
)


def read_parameter_file(path: Path) -> dict[str, dict[str, object]]:
    """Parameters of every section by dotted names, as ROS has them.

    ParameterError names file, line and what is valid.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        events = list(yaml.parse(text, Loader=yaml.SafeLoader))
    except (yaml.YAMLError, UnicodeDecodeError, OSError) as error:
        reason = " ".join(str(error).split())
        raise ParameterError(f"{path.name}: not a readable YAML file: {reason}") from error
    try:
        return _sections(events)
    except _Wrong as wrong:
        raise ParameterError(f"{path.name}, line {wrong.args[0]}: {wrong.args[1]}") from None


def given_files(arguments: Sequence[str]) -> list[dict[str, dict[str, object]]]:
    """Parameters of the files that a command line gives to ROS, each by section."""
    return [
        read_parameter_file(Path(value))
        for option, value in pairwise(arguments)
        if option == "--params-file"
    ]


def shared_names(files: Iterable[dict[str, dict[str, object]]], node: str) -> set[str]:
    """Parameters that files give to nodes of any name, and not to `node` by its own."""
    names: dict[str, set[str]] = {}
    for sections in files:
        for section, body in sections.items():
            names.setdefault(section.rpartition("/")[2], set()).update(body)
    return (names.get("*", set()) | names.get("**", set())) - names.get(node, set())


class _Wrong(Exception):
    """Line and sentence."""


def _wrong(event: yaml.Event, sentence: str) -> _Wrong:
    return _Wrong(event.start_mark.line + 1, sentence)


def _sections(events: Sequence[yaml.Event]) -> dict[str, dict[str, object]]:
    documents = [event for event in events if isinstance(event, yaml.DocumentStartEvent)]
    if len(documents) > 1:
        raise _wrong(documents[1], "a second document begins; a parameter file has one")
    parts = yaml.NodeEvent | yaml.CollectionEndEvent
    inside = iter([event for event in events if isinstance(event, parts)])
    first = next(inside, None)
    if first is None:
        return {}
    if not isinstance(first, yaml.MappingStartEvent):
        raise _wrong(first, "it must have sections, each with ros__parameters")
    found: dict[str, dict[str, object]] = {}
    for section, event in _entries(first, inside):
        if not isinstance(event, yaml.MappingStartEvent):
            raise _wrong(event, f"{section} must hold a section {PARAMETERS}")
        body: dict[str, object] | None = None
        for name, parameters in _entries(event, inside):
            if name != PARAMETERS or not isinstance(parameters, yaml.MappingStartEvent):
                raise _wrong(
                    parameters, f"{section} must hold a section {PARAMETERS}, no {name!r}"
                )
            body = {}
            _fill(body, "", parameters, inside, 1)
        if body is None:
            raise _wrong(event, f"{section} must hold a section {PARAMETERS}")
        found[section] = body
    return found


def _fill(
    body: dict[str, object],
    prefix: str,
    start: yaml.Event,
    inside: Iterator[yaml.Event],
    depth: int,
) -> None:
    """Put the values of a section, and of sections within, under their dotted names."""
    if depth > DEEPEST:
        raise _wrong(start, f"more than {DEEPEST} sections within sections")
    for key, event in _entries(start, inside):
        name = prefix + key
        if isinstance(event, yaml.MappingStartEvent):
            _fill(body, f"{name}.", event, inside, depth + 1)
        elif name in body:
            raise _wrong(event, f"{name} is given twice; once is enough")
        elif isinstance(event, yaml.ScalarEvent):
            body[name] = _value(name, event)
        else:
            body[name] = list(_list(name, inside))


def _entries(start: yaml.Event, inside: Iterator[yaml.Event]) -> Iterator[tuple[str, yaml.Event]]:
    """Keys of a mapping and the events that their values begin with, which the user consumes."""
    keys: set[str] = set()
    _plain(start)
    for event in inside:
        if isinstance(event, yaml.MappingEndEvent):
            return
        _plain(event)
        if not isinstance(event, yaml.ScalarEvent) or event.value in ("", "<<"):
            raise _wrong(event, "a key must be a name")
        if event.value in keys:
            raise _wrong(event, f"{event.value} is given twice; once is enough")
        keys.add(event.value)
        value = next(inside)
        _plain(value)
        yield event.value, value


def _list(name: str, inside: Iterator[yaml.Event]) -> Iterator[object]:
    for event in inside:
        if isinstance(event, yaml.SequenceEndEvent):
            return
        _plain(event)
        if not isinstance(event, yaml.ScalarEvent):
            raise _wrong(event, f"{name} is a list, which may hold values only")
        yield _value(name, event)


def _plain(event: yaml.Event) -> None:
    """Refuse what ROS does not read, or not as YAML does."""
    if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
        raise _wrong(event, "ROS reads no anchors and aliases: write the value out")
    if event.tag is not None and event.tag != "!":
        raise _wrong(event, f"ROS reads no tags: leave {event.tag!r} out")


def _value(name: str, event: yaml.ScalarEvent) -> bool | int | float | str:
    """Value of a scalar as YAML and ROS both have it."""
    text: str = event.value
    if not event.implicit[0]:  # in quotes, or a block
        return text
    sexagesimal = SEXAGESIMAL.fullmatch(text)
    if sexagesimal:
        total = 0.0
        for part in sexagesimal[2].split(":"):
            total = 60.0 * total + int(part)
        raise _wrong(
            event, f"{name} is {text}, which is sexagesimal: write {total:g}, or put it in quotes"
        )
    if text.lower() in TRUTH:
        return TRUTH[text.lower()]
    if INTEGER.fullmatch(text):
        number = int(text, 16 if "x" in text else 10)
        return number if -LARGEST <= number < LARGEST else float(number)
    for pattern, why in DOUBTFUL:
        if pattern.fullmatch(text):
            meant = _meant(text)
            raise _wrong(event, f"{name} is {text or 'empty'}: {why}; {meant}")
    if NUMBER.fullmatch(text):
        return float(text)
    if NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def _meant(text: str) -> str:
    """What may have been meant by a doubtful text."""
    digits = text.replace("_", "")
    if re.fullmatch(r"[-+]?0[0-9]+", digits):
        meant = f"write {int(digits)}"
        if not set(digits) & set("89"):
            meant += f", or {int(digits, 8)} if octal was meant"
        return meant
    if re.fullmatch(r"[-+]?0b[01]+", digits):
        return f"write {int(digits, 2)}"
    if NUMBER.fullmatch(digits):
        return f"write {digits}"
    return "write a number, true, false, or a text in quotes"
