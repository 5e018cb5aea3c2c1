# Copyright 2026 ahv developers, Apache-2.0
"""Faults injected into flights in real time, one process per node, and what became of them."""

import json
import math
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from std_msgs.msg import String

from ahv_analysis.bag.info import bag_info
from ahv_analysis.bag.reader import load_bag
from ahv_analysis.bag.recovery import recover
from ahv_analysis.errors import BagError, GraphError
from ahv_analysis.faults.faulty_node import INJECT, faulty
from ahv_analysis.faults.whole_flights import fly_with, whole_flight_faults
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.one_process import Leave, at_once
from ahv_analysis.flight.process_per_node import (
    LONGEST_START,
    NodeChange,
    ProcessGraph,
)
from ahv_analysis.flight.watcher import LOOK, Watcher
from ahv_analysis.interrupt import signals_wait
from ahv_analysis.report.page import render
from ahv_analysis.report.page_flight import read_flights
from ahv_analysis.report.summary import summarize
from ahv_msgs_py.graph import NODES, controllers, listeners
from ahv_msgs_py.node.faults import Fault
from ahv_msgs_py.node.log_folder import log_where_it_can
from ahv_msgs_py.node.messages import message_class
from ahv_msgs_py.node.network import keep_to_this_machine
from ahv_msgs_py.node.quality import newest, quality
from ahv_msgs_py.node.subscription import gids
from ahv_msgs_py.topics import (
    BY_NAME,
    DIAGNOSTICS,
    FLIGHT,
    FLOWN,
    LOOP_TOPICS,
    NAMESPACE,
    RATE_COMMAND,
    SPECIAL_TOPICS,
    STATE,
    SURFACE_COMMAND,
    THROTTLE_COMMAND,
    LoopTopic,
)
from ahv_plant.model.constants import DEGREES, STEP_NS, UNSTART_ALPHA
from ahv_plant.model.vectors import State

CASE = "neuro_adaptive_sc_gdi"
LEAD = 2.0  # [s] of undisturbed flight
LONGEST_OUTAGE = 1.0  # [s] of a node
LONGEST_LOSS = 0.5  # [s] of a bag whose recorder was killed
SETTLE = 1.0  # [s] after an injection, in which it must be noticed
HEARD_AGAIN = 0.6  # [s] of flight in which a node is, that goes on or has joined the graph again
LONGEST_SILENCE = 5.0  # [s] for which that is waited for
PER_FLIGHT = 75  # injections, so that a flight stays within its 150 s
CONTROLLERS = tuple(controllers(adaptive=True))
RECEIVED = tuple(  # without guidance and on ideal hardware, as the case flies
    topic.name
    for name, topic in BY_NAME.items()
    if listeners(name) and topic not in SPECIAL_TOPICS
)
COMMANDS = tuple(name for name in RECEIVED if name != STATE.name)
# What somebody must report, any one of them, by the kind of the injection.
EXPECTED = {
    "killed": {Fault.INPUT_MISSING, Fault.LATE, Fault.COMMAND_LOST},
    "stopped": {Fault.INPUT_MISSING, Fault.LATE, Fault.COMMAND_LOST, Fault.TICK_MISSED},
    "silent": {Fault.INPUT_MISSING, Fault.LATE},
    "nan": {Fault.NOT_FINITE},
    "infinity": {Fault.NOT_FINITE},
    "out of range": {Fault.OUT_OF_RANGE},
    "wrong names": {Fault.MALFORMED},
    "cut short": {Fault.MALFORMED},
    "garbage": {Fault.MALFORMED},
    "twice": {Fault.DUPLICATE},
    "out of order": {Fault.OUT_OF_ORDER},
    "stale": {Fault.STALE, Fault.OUT_OF_ORDER},
    "ahead": {Fault.WRONG_STAMP},
    "off the grid": {Fault.WRONG_STAMP},
    "wild": {Fault.SURFACES_SATURATED, Fault.NEWTON_LIMIT, Fault.NEWTON_SINGULAR},
    "second publisher": {Fault.SECOND_PUBLISHER},
}
# Nobody has to report these: they are refused, or nothing comes of them.
REFUSED = ("use_sim_time", "foreign diagnostic")
FOREIGN = ("/factory/plant", f"{NAMESPACE}/plant")  # whose diagnostics say that all is over


class Injection(NamedTuple):
    """One fault, as it was injected and what was seen of it."""

    kind: str
    target: str  # a node or a topic
    time: float  # [s] of the flight
    length: float  # [s] that it lasted
    noticed: str  # the first report that was expected, by whom; empty if there was none
    latency: float | None  # [s] of simulated time until then
    max_abs_alpha: float  # [deg] until the next one
    silence: float | None = None  # [s] of flight until a node that was let go was heard again


def draw_injections(random: Random, count: int) -> Iterator[tuple[str, str, float]]:
    """Kind, target and length [s]; every kind comes up about equally often, none is left out."""
    plans: list[tuple[str, tuple[str, ...]]] = [("killed", CONTROLLERS)]
    plans.append(("stopped", (*CONTROLLERS, "plant")))
    for kind in EXPECTED:
        if kind == "wild":
            plans.append((kind, (RATE_COMMAND.name,)))
        elif kind == "out of range":
            plans.append((kind, (SURFACE_COMMAND.name, THROTTLE_COMMAND.name)))
        elif kind in ("ahead", "stale", "silent", "second publisher"):
            plans.append((kind, COMMANDS))
        elif kind not in ("killed", "stopped"):
            plans.append((kind, RECEIVED))
    plans += [
        ("use_sim_time", (*CONTROLLERS, "plant", "recorder")),
        ("foreign diagnostic", FOREIGN),
    ]
    queue: list[tuple[str, tuple[str, ...]]] = []
    for _ in range(count):
        if not queue:
            queue = random.sample(plans, len(plans))
        kind, targets = queue.pop()
        longest = {"killed": LONGEST_OUTAGE, "stopped": LONGEST_OUTAGE, "wild": 0.02}
        yield kind, random.choice(targets), random.uniform(0.01, longest.get(kind, 0.3))


class Liar(Watcher):
    """Says what is not so, and is nobody to say it."""

    def __init__(self, interrupted: Callable[[], bool] = lambda: False):
        """Be ready to speak."""
        super().__init__(interrupted)
        durable = quality(durable=True, depth=10)
        self._slander = self._node.create_publisher(DiagnosticArray, DIAGNOSTICS.name, durable)
        self._end = self._node.create_publisher(
            message_class(FLIGHT.layout.type_name), FLIGHT.name, durable
        )

    def slander(self, name: str) -> None:
        """Publish diagnostics of a name that is not one's own: it is over, for no known reason."""
        over = DiagnosticStatus(name=name, values=[KeyValue(key="over", value="True")])
        self._slander.publish(DiagnosticArray(status=[over]))

    def end(self) -> None:
        """Say falsely that the flight has ended."""
        self._end.publish(FLIGHT.layout.encode(max(1, self.step) * STEP_NS, (1.0, 1.0, FLOWN)))


class Spectator(Liar):
    """Sees the states, and can speak where it should not."""

    def __init__(self, interrupted: Callable[[], bool] = lambda: False):
        """Be ready to look on."""
        super().__init__(interrupted)
        self._orders = self._node.create_publisher(String, INJECT, quality(durable=False))
        self._voices: dict[str, Any] = {}
        self._speaking: LoopTopic | None = None
        self.state: State | None = None
        self.stamp = 0  # [ns]
        self.max_abs_alpha = 0.0  # [rad] since it was last reset
        self._let_go = 0  # [ns] flight time when a node was let go
        self._heard: dict[
            str, int
        ] = {}  # [ns] the first command of a topic that answers a later state

    @contextmanager
    def looking_on(self, interrupted: Callable[[], bool] = lambda: False) -> Iterator[None]:
        """See one flight, by a listener that its plant waits for; no look once `interrupted()`."""
        takes: dict[LoopTopic, Callable[[bytes], None]] = {STATE: self._see}
        takes |= {
            BY_NAME[name]: partial(self._hear, name)
            for node in CONTROLLERS
            for name in NODES[node].sends
        }
        subscriptions = [
            self._node.create_subscription(
                message_class(topic.layout.type_name), topic.name, take, newest(), raw=True
            )
            for topic, take in takes.items()
        ]
        self.look(LOOK)  # what was still under way of the flight before
        self.state, self.stamp, self._interrupted = None, 0, interrupted
        try:
            yield
        finally:
            self._interrupted = lambda: False
            for subscription in subscriptions:
                self._node.destroy_subscription(subscription)
            while self._voices:  # or the next plant refuses to fly: a command has two publishers
                self._node.destroy_publisher(self._voices.popitem()[1])

    def _hear(self, name: str, data: bytes) -> None:
        known = BY_NAME[name].layout.decode(data)
        if known is not None and known[0] > self._let_go:
            self._heard.setdefault(name, known[0])

    def wait_for_another(self, node: str, start: Callable[[], None]) -> None:
        """Start a node, and wait until it is known in the graph."""
        topic = BY_NAME[NODES[node].sends[-1]].name
        before = {*gids(self._node, topic)}
        start()
        until = time.monotonic() + LONGEST_START
        while {*gids(self._node, topic)} <= before and time.monotonic() < until:
            self.look(0.02)

    def let_go(self) -> None:
        """Wait from now on for commands that answer states to come."""
        self._let_go, self._heard = self.stamp, {}

    def silence(self, node: str) -> float:
        """Seconds of flight from when a node was let go to its first answer, on all its topics.

        That of the plant is the answer to its states.
        """
        topics = NODES[node].hears if node == "plant" else NODES[node].sends
        until = time.monotonic() + LONGEST_SILENCE
        while not self._heard.keys() >= {*topics} and time.monotonic() < until:
            self.look(0.1)
        heard = [self._heard.get(topic, self.stamp) for topic in topics]
        return (max(heard) - self._let_go) * 1e-9

    def _see(self, data: bytes) -> None:
        known = STATE.layout.decode(data)
        if known is None or not math.isfinite(sum(known[1])):
            return  # one of the wrong ones
        self.stamp, self.state = known[0], State(*known[1])
        alpha = abs(math.atan2(self.state.w, self.state.u))
        self.max_abs_alpha = max(self.max_abs_alpha, alpha)
        if self._speaking is not None:
            topic = self._speaking
            values = [0.3] * len(topic.layout.fields)  # plausible, and wrong
            self._voices[topic.name].publish(topic.layout.encode(self.stamp, values))

    def order(self, topic: str, kind: str, count: int) -> None:
        """Tell the node that publishes a topic to fail."""
        text = json.dumps({"topic": topic, "kind": kind, "count": count})
        self._orders.publish(String(data=text))

    def use_sim_time(self, node: str) -> bool:
        """Ask a node to go by simulated time; whether it does."""
        client = self._node.create_client(SetParameters, f"{NAMESPACE}/{node}/set_parameters")
        value = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True)
        request = SetParameters.Request(
            parameters=[ParameterMessage(name="use_sim_time", value=value)]
        )
        client.wait_for_service(SETTLE)
        answer = client.call_async(request)
        self._executor.spin_until_future_complete(answer, SETTLE)
        self._node.destroy_client(client)
        return answer.done() and answer.result().results[0].successful

    def speak(self, topic: LoopTopic, seconds: float) -> None:
        """Publish commands of one's own on a topic that has its publisher."""
        if topic.name not in self._voices:
            self._voices[topic.name] = self._node.create_publisher(
                message_class(topic.layout.type_name), topic.name, quality(durable=False, depth=10)
            )
            self.look(0.2)  # until it is heard
        self._speaking = topic
        self.look(seconds)
        self._speaking = None


def run_campaign(
    injections: int,
    seed: int,
    out: Path,
    progress: Callable[[int], None] = lambda done: None,
    whole_flights: bool = True,
    leave: Leave = at_once,
) -> dict[str, Any]:
    """Fly and disturb until so many faults were injected; bags and `faults.json` go to `out`.

    Then the faults that decide how a flight ends, with `whole_flights`: half a minute each.
    `leave` is given what ends the looking on, as that of a flight.
    """
    keep_to_this_machine()
    log_where_it_can()
    spectator = Spectator()
    try:
        return _run_campaign(spectator, injections, seed, out, progress, whole_flights)
    finally:
        leave(spectator.close)


def _run_campaign(
    spectator: Spectator,
    injections: int,
    seed: int,
    out: Path,
    progress: Callable[[int], None],
    whole_flights: bool,
) -> dict[str, Any]:
    random = Random(seed)
    done: list[Injection] = []
    flights: list[dict[str, Any]] = []
    out.mkdir(parents=True, exist_ok=True)
    while len(done) < injections:
        count = min(PER_FLIGHT, injections - len(done))
        bag = out / f"bag-{len(flights)}"
        before = len(done)
        flight = _disturbed_flight(
            spectator,
            list(draw_injections(random, count)),
            bag,
            done,
            lambda: progress(len(done)),
        )
        flights.append(flight | _judge_bag(bag, done[before:]))
    flights.append(_bereaved_flight(spectator, out / "bag-of-a-killed-recorder", done))
    if whole_flights:
        done += _whole_flights(spectator, out)
    report = _report(done, flights, seed)
    (out / "faults.json").write_text(json.dumps(report, indent=1, allow_nan=False) + "\n")
    return report


@contextmanager
def _watched_flight(
    spectator: Spectator, bag: Path, change: NodeChange | None = None
) -> Iterator[ProcessGraph]:
    """Fly while somebody looks on; a signal ends it in order, and the looks at once."""
    case = load_case(CASE, {"duration": 3600.0})
    graph = ProcessGraph(case, bag, realtime=True, spectators=1, change=change)
    with signals_wait() as interrupted, spectator.looking_on(interrupted), graph:
        _wait_for_flight(spectator)
        spectator.look(LEAD)
        yield graph
        graph.end_flight()


def _disturbed_flight(
    spectator: Spectator,
    plan: list[tuple[str, str, float]],
    bag: Path,
    done: list[Injection],
    progress: Callable[[], None],
) -> dict[str, Any]:
    """One flight with the injections of a plan."""
    unexpected: list[str] = []
    with _watched_flight(spectator, bag, faulty) as graph:
        for kind, target, length in plan:
            done.append(_inject(spectator, graph, kind, target, length))
            unexpected += [f"{name}: {code}" for name, code in graph.ended().items()]
            progress()
    return {"steps": spectator.stamp // STEP_NS, "unexpected_ends": unexpected}


def _bereaved_flight(spectator: Spectator, bag: Path, done: list[Injection]) -> dict[str, Any]:
    """One flight that loses its recorder, and then its plant, and gets a new one."""
    with _watched_flight(spectator, bag) as graph:
        killed = spectator.stamp
        graph.kill("recorder")
        spectator.look(SETTLE)
        went_on = spectator.stamp - killed
        alpha = spectator.max_abs_alpha * DEGREES
        goes_on = "the flight goes on" if went_on > 0.5 * SETTLE * 1e9 else ""
        done.append(
            Injection("recorder killed", "recorder", killed * 1e-9, 0.0, goes_on, 0.0, alpha)
        )

        start, seen = spectator.stamp, len(spectator.statuses)
        spectator.max_abs_alpha = 0.0
        graph.kill("plant")
        spectator.look(2.0)
        lost = {node for _, node, _, text, _ in spectator.statuses[seen:] if "state lost" in text}
        graph.values["plant"] |= {"listeners": len(graph.controllers) + 1}  # no recorder
        graph.start("plant")
        spectator.look(5.0)
        restarted = 1e9 < spectator.stamp != start and spectator.max_abs_alpha > 0.0
        noticed = "all controllers: state lost" if lost >= {*CONTROLLERS} and restarted else ""
        alpha = spectator.max_abs_alpha * DEGREES
        done.append(Injection("plant killed", "plant", start * 1e-9, 2.0, noticed, 1.5, alpha))
    recovered = bag.with_name(bag.name + "-recovered")
    recover(bag, recovered)
    stamps = [
        known[0]
        for data in load_bag(recovered)[STATE.name].messages
        if (known := STATE.layout.decode(data)) is not None
    ]
    return {
        "steps": killed // STEP_NS,
        "unexpected_ends": [],
        "not_finite": {},
        "states_missing_in_bag": 0,
        "unreadable": _unreadable(recovered),
        "lost_with_the_recorder_s": max(0.0, (killed - max(stamps)) * 1e-9),
    }


def _whole_flights(liar: Liar, out: Path) -> Iterator[Injection]:
    """Flights by the command, one for each fault that decides how a flight ends."""
    for fault in whole_flight_faults(liar.end):
        liar.step = -1
        end = fly_with(fault, out / fault.kind.replace(" ", "-"), liar)
        since = max(0, liar.step) * STEP_NS * 1e-9
        yield Injection(fault.kind, fault.target, since, 0.0, end.words, 0.0, end.max_abs_alpha)


def _wait_for_flight(spectator: Spectator) -> None:
    for _ in range(int(LONGEST_START / 0.1)):
        spectator.look(0.1)
        if spectator.state is not None:
            return
    raise GraphError(f"no flight after {LONGEST_START:g} s")


def _inject(
    spectator: Spectator, graph: ProcessGraph, kind: str, target: str, length: float
) -> Injection:
    """Inject one fault and see what becomes of it."""
    spectator.max_abs_alpha = 0.0
    seen = len(spectator.statuses)
    start = spectator.stamp
    noticed, latency = "", None
    if kind == "killed":
        graph.kill(target)
        spectator.look(length)
        spectator.wait_for_another(target, lambda: graph.start(target))
        spectator.let_go()
        spectator.look(1.0)
    elif kind == "stopped":
        length = max(length, 0.05)
        graph.signal(target, signal.SIGSTOP)
        spectator.look(length)
        graph.signal(target, signal.SIGCONT)
        spectator.let_go()
    elif kind == "use_sim_time":
        noticed = "" if spectator.use_sim_time(target) else f"{target}: refused"
    elif kind == "foreign diagnostic":
        spectator.slander(target)
    elif kind == "second publisher":
        topic = next(topic for topic in LOOP_TOPICS if topic.name == target)
        spectator.speak(topic, length)
    else:
        spectator.order(target, kind, max(1, round(length * 1e9 / STEP_NS)))
        spectator.look(length)
    settled = spectator.stamp
    spectator.look(SETTLE)
    if kind == "foreign diagnostic" and spectator.stamp - settled > 0.5 * SETTLE * 1e9:
        noticed = "the flight goes on"
    silence = spectator.silence(target) if kind in ("killed", "stopped") else None
    if noticed:
        latency = (settled - start) * 1e-9
    names = {fault.name.lower().replace("_", " ") for fault in EXPECTED.get(kind, ())}
    for stamp, node, _, text, _ in spectator.statuses[seen:]:
        if any(text.startswith(f"{name}:") for name in names):
            noticed, latency = f"{node}: {text.partition(':')[0]}", (stamp - start) * 1e-9
            break
    return Injection(
        kind,
        target,
        start * 1e-9,
        length,
        noticed,
        latency,
        spectator.max_abs_alpha * DEGREES,
        silence,
    )


def _judge_bag(bag: Path, injected: list[Injection]) -> dict[str, Any]:
    """Whether the bag holds every state, and numbers that are not finite beyond the injected."""
    wrong = {entry.target for entry in injected if entry.kind in ("nan", "infinity")}
    stamps: set[int] = set()
    spoilt = 0  # states that were sent wrongly, and are in the bag as they were sent
    not_finite: Counter[str] = Counter()
    recorded = load_bag(bag)
    for topic in LOOP_TOPICS:
        for data in recorded[topic.name].messages if topic.name in recorded else ():
            known = topic.layout.decode(data)
            if known is None or known[0] % STEP_NS:
                spoilt += topic is STATE
                continue
            if not math.isfinite(sum(known[1])) and topic.name not in wrong:
                not_finite[topic.name] += 1
            if topic is STATE:
                stamps.add(known[0] // STEP_NS)
    last = max(stamps)
    return {
        "not_finite": dict(not_finite),
        "states_missing_in_bag": max(0, len(set(range(last + 1)) - stamps) - spoilt),
        "unreadable": _unreadable(bag),
    }


def _unreadable(bag: Path) -> str:
    """Why what a user does with a bag cannot be done with this one; empty if it can."""
    try:
        facts = bag_info(bag)
        flight = read_flights([bag])[0]
        assert flight.case is not None
        summarize(flight.record, flight.ended_early)
        page = render([flight])
    except (BagError, AssertionError) as error:
        return str(error) or "it has no notes"
    return "" if facts["steps"] and page else "it is empty"


def _report(done: list[Injection], flights: list[dict[str, Any]], seed: int) -> dict[str, Any]:
    """Everything, and the verdict."""
    alpha = max(entry.max_abs_alpha for entry in done)
    kinds = {}
    for kind in dict.fromkeys(entry.kind for entry in done):
        of_kind = [entry for entry in done if entry.kind == kind]
        if of_kind:
            latencies = [entry.latency for entry in of_kind if entry.latency is not None]
            silences = [entry.silence for entry in of_kind if entry.silence is not None]
            kinds[kind] = {
                "injected": len(of_kind),
                "noticed": sum(bool(entry.noticed) for entry in of_kind),
                "latency_s_max": max(latencies, default=None),
                "max_abs_alpha_deg": max(entry.max_abs_alpha for entry in of_kind),
                "silence_s_max": max(silences, default=None),
            }
    unnoticed = [entry._asdict() for entry in done if not entry.noticed]
    deaf = [
        entry._asdict()
        for entry in done
        if entry.silence is not None and entry.silence > HEARD_AGAIN
    ]
    passed = (
        alpha <= UNSTART_ALPHA * DEGREES
        and not unnoticed
        and not deaf
        and all(flight.get("lost_with_the_recorder_s", 0.0) < LONGEST_LOSS for flight in flights)
        and all(
            not (flight["unexpected_ends"] or flight["not_finite"] or flight["unreadable"])
            and flight["states_missing_in_bag"] == 0
            for flight in flights
        )
    )
    return {
        "seed": seed,
        "injections": len(done),
        "passed": passed,
        "max_abs_alpha_deg": alpha,
        "unnoticed": unnoticed,
        "deaf": deaf,
        "kinds": kinds,
        "flights": flights,
        "log": [entry._asdict() for entry in done],
    }
