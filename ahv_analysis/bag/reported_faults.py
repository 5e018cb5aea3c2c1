# Copyright 2026 ahv developers, Apache-2.0
"""How often each node met each fault, by the counts that it reported on /diagnostics."""

from collections.abc import Iterable
from contextlib import suppress

from ahv_analysis.bag.messages import deserialized
from ahv_msgs_py.graph import NODES
from ahv_msgs_py.layout import MessageError
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.topics import DIAGNOSTICS

FAULTS = {fault.name.lower() for fault in Fault}
LONGEST = 12  # digits of a count


def reported_faults(messages: Iterable[bytes], namespace: str) -> dict[str, dict[str, int]]:
    """Counts of the faults that every node of a `namespace` reported, of CDR `messages` in order.

    A node counts from its start on; what one had counted that was started again is added.
    """
    before: dict[tuple[str, str], int] = {}  # of those who were started again
    last: dict[tuple[str, str], int] = {}
    for data in messages:
        with suppress(MessageError):
            for status in deserialized(data, DIAGNOSTICS.type_name).status:
                where, _, node = status.name.rpartition("/")
                if where != namespace or node not in NODES:
                    continue
                for fact in status.values:
                    if fact.key in FAULTS and fact.value.isdecimal() and len(fact.value) < LONGEST:
                        key, count = (node, fact.key), int(fact.value)
                        if count < last.get(key, 0):
                            before[key] = before.get(key, 0) + last[key]
                        last[key] = count
    found: dict[str, dict[str, int]] = {}
    for (node, fault), count in last.items():
        found.setdefault(node, {})[fault] = before.get((node, fault), 0) + count
    return found
