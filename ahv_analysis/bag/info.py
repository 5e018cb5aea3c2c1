# Copyright 2026 ahv developers, Apache-2.0
"""What a bag holds, in a few facts."""

import json
from pathlib import Path
from typing import Any

from ahv_analysis.bag.reader import flight_of, load_bag, notes_of
from ahv_analysis.bag.recovery import RECOVERED
from ahv_msgs_py.layout import NANOSECONDS
from ahv_plant.model.constants import STEP_NS


def bag_info(path: Path) -> dict[str, Any]:
    """Facts of the flight in the bag folder `path`; BagError if it is damaged or no flight.

    `complete` is whether every step of the flight is there, from the first one on, and nothing was
    lost before a recovery. `case`, `planned_s` and `notes` are None in a bag without notes.
    """
    bag = load_bag(path)
    flight = flight_of(bag)
    notes = notes_of(bag.metadata)
    first, last = int(flight.stamps[0]), int(flight.stamps[-1])
    missing = last // STEP_NS + 1 - len(flight.stamps)
    text = (bag.metadata.get("custom_data") or {}).get(RECOVERED)
    recovered = None if text is None else json.loads(text)
    whole = recovered is None or recovered["lost_messages"] == 0
    files = [path / name for name in bag.metadata["relative_file_paths"]]
    return {
        "bag": str(path),
        "complete": missing == 0 and whole,
        "case": notes and notes["case"],
        "duration_s": (last - first) / NANOSECONDS,
        "planned_s": notes and notes["parameters"]["plant"]["duration"],
        "steps": flight.steps,
        "missing_steps": missing,
        "recovered": recovered,
        "bytes": sum(file.stat().st_size for file in files),
        "messages": sum(len(topic.messages) for topic in bag.topics.values()),
        "topics": [
            {"name": name, "type": topic.type_name, "messages": len(topic.messages)}
            for name, topic in bag.topics.items()
        ],
        "notes": notes,
    }
