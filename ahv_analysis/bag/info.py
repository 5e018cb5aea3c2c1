# Copyright 2026 ahv developers, Apache-2.0
"""What a bag holds, in a few facts."""

from pathlib import Path
from typing import Any

from ahv_analysis.bag.notes import read_losses
from ahv_analysis.bag.reader import Bag, flight_of, read
from ahv_analysis.bag.reported_faults import reported_faults
from ahv_msgs_py.layout import NANOSECONDS
from ahv_msgs_py.topics import DIAGNOSTICS
from ahv_plant.model.constants import STEP_NS


def bag_info(path: Path) -> dict[str, Any]:
    """Facts of the flight in the bag `path`; BagError if it is damaged or no flight.

    `complete` is whether every step of the flight is there, from the first one on, and nothing was
    lost before a recovery. `case`, `planned_s` and `notes` are None in a bag without notes.
    `faults` are the counts that nodes reported.
    """
    bag = read(path, keep=[DIAGNOSTICS.name])
    flight = flight_of(bag)
    first, last = int(flight.stamps[0]), int(flight.stamps[-1])
    missing = last // STEP_NS + 1 - len(flight.stamps)
    recovered = read_losses(bag.custom)
    whole = recovered is None or recovered["lost_messages"] == 0
    return {
        "bag": str(bag.path),
        "complete": missing == 0 and whole,
        "case": bag.notes and bag.notes.case,
        "duration_s": (last - first) / NANOSECONDS,
        "planned_s": bag.notes and bag.notes.planned,
        "steps": flight.steps,
        "missing_steps": missing,
        "refused": refused_facts(bag),
        "faults": reported_faults(bag.kept[DIAGNOSTICS.name], bag.namespace),
        "recovered": recovered,
        "bytes": bag.bytes,
        "messages": sum(topic.messages for topic in bag.topics.values()),
        "topics": [
            {"name": name, "type": topic.type_name, "messages": topic.messages}
            for name, topic in bag.topics.items()
        ],
        "notes": bag.notes and bag.notes.content,
    }


def refused_facts(bag: Bag) -> list[dict[str, Any]]:
    """What no receiver obeyed, for JSON."""
    return [entry._asdict() | {"fault": entry.fault.name.lower()} for entry in bag.refused]


def refused_words(refused: list[dict[str, Any]]) -> str:
    """The same in one line."""
    return "; ".join(
        f"{entry['messages']} on {entry['topic']}: {entry['fault'].replace('_', ' ')}, "
        f"first {entry['first']}"
        for entry in refused
    )
