# Copyright 2026 ahv developers, Apache-2.0
"""The health of a node: what it counts and times between two reports."""

from array import array
from collections import Counter
from collections.abc import Callable
from statistics import median

from ahv_msgs_py.node.faults import Fault

OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"  # the levels of diagnostic_msgs/DiagnosticStatus
MILLISECONDS = 1e-6  # [ms/ns]


def percentile(sorted_values: "array[int]", share: float) -> int:
    """Nearest-rank percentile of values of any unit in rising order; `share` is 0 to 1."""
    rank = max(1, -(-len(sorted_values) * round(share * 1000) // 1000))
    return sorted_values[rank - 1]


class Health:
    """Counts of faults, steps and latencies; `window` is one report, `total` the whole flight."""

    def __init__(self, clock: Callable[[], int]):
        """`clock()` is steady, in ns."""
        self._clock = clock
        self.total: Counter[Fault] = Counter()
        self.window: Counter[Fault] = Counter()
        self.extremes: dict[str, float] = {}  # of what a law says of itself, over the window
        self._latencies = array("q")  # [ns] from the state to the answer, over the window
        self._state_came = 0  # [ns]
        self._since = clock()

    def count(self, fault: Fault, times: int = 1) -> bool:
        """Count a fault; True if it is the first of its kind since the last report."""
        self.total[fault] += times
        self.window[fault] += times
        return self.window[fault] == times

    def state_came(self) -> None:
        """Start the clock of one step."""
        self._state_came = self._clock()

    def answered(self) -> None:
        """Stop it."""
        self._latencies.append(self._clock() - self._state_came)

    def extreme(self, name: str, value: float) -> None:
        """Keep the largest `value` of a name, in any unit."""
        if value > self.extremes.get(name, float("-inf")):
            self.extremes[name] = value

    def report(self) -> tuple[bytes, str, dict[str, str]]:
        """Level, text and facts since the last report, and start anew."""
        now = self._clock()
        facts: dict[str, str] = {}
        latencies = array("q", sorted(self._latencies))
        if latencies:
            facts["rate_hz"] = f"{len(latencies) / max(1e-9, (now - self._since) * 1e-9):.1f}"
            facts["latency_ms_p50"] = f"{median(latencies) * MILLISECONDS:.3f}"
            facts["latency_ms_p99"] = f"{percentile(latencies, 0.99) * MILLISECONDS:.3f}"
            facts["latency_ms_max"] = f"{latencies[-1] * MILLISECONDS:.3f}"
        facts |= {name: f"{value:.6g}" for name, value in self.extremes.items()}
        facts |= {fault.name.lower(): str(count) for fault, count in self.total.items()}
        worst = OK
        if self.window:
            worst = ERROR if any(fault.value.error for fault in self.window) else WARN
        text = ", ".join(
            f"{fault.name.lower().replace('_', ' ')}: {count}"
            for fault, count in self.window.items()
        )
        self.window.clear()
        self.extremes.clear()
        del self._latencies[:]
        self._since = now
        return worst, text or "healthy", facts
