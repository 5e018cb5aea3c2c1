# Copyright 2026 ahv developers, Apache-2.0
"""What the documents say of topics, parameters and the graph, written from the code.

A page asks for a part between the marks `<!-- reference NAME -->` and `<!-- end -->`, and
`python -m ahv_analysis.reference` fills in what stands between them; a test sees that it has.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from ahv_analysis.equation_index import equation_rows
from ahv_msgs_py.graph import NODES, listeners, sender
from ahv_msgs_py.node.faults import fault_rows
from ahv_msgs_py.node.managed_node import SHELL_PARAMETERS
from ahv_msgs_py.parameters import Parameter, Value
from ahv_msgs_py.topics import BY_NAME, FINITE, FLIGHT, LOOP_TOPICS, VIEWER_TOPICS, LoopTopic

ROOT = Path(__file__).resolve().parent.parent
MARKED = re.compile(r"(?<=<!-- reference )(\w+)( -->\n).*?(?=<!-- end -->)", re.DOTALL)

PLACES = {
    "geometry_msgs/msg/Vector3Stamped": [f"vector.{axis}" for axis in "xyz"],
    "geometry_msgs/msg/AccelStamped": [
        f"accel.{part}.{axis}" for part in ("linear", "angular") for axis in "xyz"
    ],
}


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)


def graph() -> str:
    """Mermaid flowchart of the control loop, dashed what adaptive cases and guidance add."""
    lines = ["```mermaid", "flowchart LR"]
    for topic in BY_NAME:
        speaker = sender(topic)
        for listener in listeners(topic):
            ends = NODES[speaker], NODES[listener]
            dashed = any(end.adaptive or end.guided for end in ends)
            arrow = f"-. {topic} .->" if dashed else f"-- {topic} -->"
            lines.append(f"    {speaker} {arrow} {listener}")
    return "\n".join(lines) + "\n```\n"


def loop_topics() -> str:
    """Table of the topics of the loop, then of the numbers in each message."""
    rows = (
        (
            f"`{topic.name}`",
            topic.layout.type_name.replace("/msg/", "/"),
            f"`{topic.layout.frame}`",
            sender(name),
            ", ".join(listeners(name)),
        )
        for name, topic in BY_NAME.items()
    )
    parts = [table(("topic", "type", "frame", "from", "to"), rows)]
    parts += (
        f"\n### {topic.name}\n\n"
        f"{topic.description[0].upper()}{topic.description[1:]}.\n\n{_numbers(topic)}"
        for topic in (*LOOP_TOPICS, FLIGHT)
    )
    return "".join(parts)


def _numbers(topic: LoopTopic) -> str:
    """Table of the numbers of a message: where they stand, what they are, in what unit."""
    names, units = topic.layout.fields, topic.units.split(", ")
    places = PLACES.get(topic.layout.type_name, [f"position[{i}]" for i in range(len(names))])
    if len(units) == 1:
        units *= len(names)
    rows = [
        (f"`{place}`", name, unit, _range(*bounds) if bounds != FINITE else "finite")
        for place, name, unit, bounds in zip(places, names, units, topic.bounds, strict=True)
    ]
    return table(("place", "name", "unit", "range"), rows)


def _range(low: float | None, high: float | None) -> str:
    return "" if low is None or high is None else f"{low:g} to {high:g}"


def viewer_topics() -> str:
    """Table of the topics that nothing in the loop reads."""
    rows = (
        (f"`{topic.name}`", topic.type_name.replace("/msg/", "/"), topic.description)
        for topic in VIEWER_TOPICS
    )
    return table(("topic", "type", "what"), rows)


def parameters() -> str:
    """Table of the parameters of every node, first those that all have."""
    head = ("parameter", "default", "unit", "range", "in flight", "meaning")
    rooms = {"every node": SHELL_PARAMETERS}
    rooms |= {name: node.parameters for name, node in NODES.items()}
    return "\n".join(
        f"## {node}\n\n{table(head, map(_parameter, known))}" for node, known in rooms.items()
    )


def _parameter(parameter: Parameter) -> tuple[str, ...]:
    return (
        f"`{parameter.name}`",
        f"`{_yaml(parameter.default)}`",
        parameter.unit,
        _range(parameter.minimum, parameter.maximum),
        "yes" if parameter.in_flight else "",
        parameter.description,
    )


def _yaml(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value!r}".replace("'", '"')


def faults() -> str:
    """Table of the faults, as `ahv faults` lists them."""
    return table(("fault", "noticed by", "detection", "response", "latency"), fault_rows())


def equations() -> str:
    """Table from the report's equations to the code and its tests."""
    return table(("equation", "built by", "tested by"), equation_rows(ROOT))


PARTS: dict[str, Callable[[], str]] = {
    part.__name__: part
    for part in (graph, loop_topics, viewer_topics, parameters, faults, equations)
}


def filled(page: str) -> str:
    """The text of a page with every part that it asks for; KeyError if there is no such part."""
    return MARKED.sub(lambda mark: mark[1] + mark[2] + PARTS[mark[1]](), page)


def main() -> None:
    """Fill in the parts that README and docs ask for."""
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        text = path.read_text()
        if MARKED.search(text):
            path.write_text(filled(text))
            print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
