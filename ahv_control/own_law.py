# Copyright 2026 ahv developers, Apache-2.0
"""A law of somebody's own in the place of the report's loops (Fig. 3.1), and which one flies.

    start(measured, reference, control) -> memory, commands
    step(memory, before, commands, measured, reference, control) -> memory, commands
    followed(reference, control) -> reference

`control` is a `FlightControl`, whose functions flight_control.py has, or the `OwnLaw` of a law
that was loaded (law_file.py). Between such a law and the vehicle stands `sound`, for nobody
looked at what it may answer.
"""

import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ahv_control.flight_control import NEUTRAL, FlightControl
from ahv_control.flight_control import followed as followed_by_loops
from ahv_control.flight_control import start as start_of_loops
from ahv_control.flight_control import step as step_of_loops
from ahv_control.guidance import Guidance
from ahv_control.law import Commands
from ahv_control.newton_raphson import SolverStatus
from ahv_control.reference import Reference, held
from ahv_plant.model.constants import THROTTLE_MINIMUM
from ahv_plant.model.vectors import (
    Attitude,
    Measurement,
    Rates,
    Surfaces,
    limit_surfaces,
    limit_throttle,
)
from ahv_plant.numerics.by_type import by_type
from ahv_plant.numerics.cache import keep_machine_code
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.identity import Definition, identity
from ahv_plant.numerics.optional import optional
from ahv_plant.numerics.simd import widen

SATURATED, SINGULAR = int(SolverStatus.SATURATED), int(SolverStatus.SINGULAR)
NO_ANSWER = int(SolverStatus.NO_ANSWER)
# what is flown while a law has answered nothing yet
RESTING = Commands(Attitude(0.0, 0.0, 0.0), Rates(0.0, 0.0, 0.0), NEUTRAL, THROTTLE_MINIMUM, 0)


class OwnLaw(NamedTuple):
    """A law as it flies; every law that is loaded has a class of its own beneath this one.

    Without guidance it is told to hold altitude and speed.
    """

    settings: Any  # what its `start` and `step` are given
    altitude: float  # [m]
    speed: float  # [m/s]
    guidance: Guidance | None = None

    @property
    def learner(self) -> None:
        """None: the disturbance learner is one of the report's laws."""
        return None


class Functions(NamedTuple):
    """What a class of `OwnLaw` is flown with."""

    start: Callable[..., Any]
    step: Callable[..., Any]
    compiled: bool


Control = FlightControl | OwnLaw
FUNCTIONS: dict[type, Functions] = {}  # by the class of a law that was loaded
TROUBLES: Counter[str] = Counter()  # what laws in plain Python raised, in this process


def _told(control: OwnLaw, reference: Reference) -> Reference:
    return reference


def _own(control: OwnLaw) -> Reference:
    return held(control.altitude, control.speed)


_wanted = optional(_told, otherwise=_own)


@elementwise
def _followed_by_own(reference: Reference | None, control: OwnLaw) -> Reference:
    wanted: Reference = _wanted(control, reference)
    return wanted


@elementwise
def _followed_by_loops(reference: Reference | None, control: FlightControl) -> Reference:
    wanted: Reference = followed_by_loops(control, reference)
    return wanted


@elementwise
def sound(answered: Commands, held: Commands) -> Commands:
    """What is flown of an answer: within the stops; `held` where there is a NaN or an infinity.

    Surfaces are in [rad], the throttle in [-].
    """
    attitude, rates, surfaces = answered.attitude, answered.rates, answered.surfaces
    nothing = 0.0 * (
        (surfaces.right_elevon + surfaces.left_elevon + surfaces.rudder + answered.throttle)
        + (attitude.phi + attitude.theta + attitude.psi)
        + (rates.P + rates.Q + rates.R)
    )
    good = nothing == 0.0
    within = limit_surfaces(surfaces)
    throttle = limit_throttle(answered.throttle)
    inside = (
        (within.right_elevon == surfaces.right_elevon)
        & (within.left_elevon == surfaces.left_elevon)
        & (within.rudder == surfaces.rudder)
    )
    told = select(answered.status == SINGULAR, SINGULAR, select(inside, 0, SATURATED))
    return Commands(
        Attitude(
            select(good, attitude.phi, held.attitude.phi),
            select(good, attitude.theta, held.attitude.theta),
            select(good, attitude.psi, held.attitude.psi),
        ),
        Rates(
            select(good, rates.P, held.rates.P),
            select(good, rates.Q, held.rates.Q),
            select(good, rates.R, held.rates.R),
        ),
        Surfaces(
            select(good, within.right_elevon, held.surfaces.right_elevon),
            select(good, within.left_elevon, held.surfaces.left_elevon),
            select(good, within.rudder, held.surfaces.rudder),
        ),
        select(good, throttle, held.throttle),
        select(good, told, NO_ANSWER),
    )


def compiled_functions(
    start: Callable[..., Any], step: Callable[..., Any], law_identity: str
) -> Functions:
    """How an element-wise law is flown: compiled with whatever flies it."""

    @elementwise
    def first(measured: Measurement, reference: Reference | None, control: OwnLaw) -> Any:
        one = measured.state.u
        wanted = widen(_followed_by_own(reference, control), one)
        memory, answered = start(measured, wanted, control.settings)
        return memory, sound(widen(answered, one), widen(RESTING, one))

    @elementwise
    def later(
        memory: Any,
        before: Measurement,
        commands: Commands,
        measured: Measurement,
        reference: Reference | None,
        control: OwnLaw,
    ) -> Any:
        one = measured.state.u
        wanted = widen(_followed_by_own(reference, control), one)
        after, answered = step(memory, before, commands, measured, wanted, control.settings)
        return after, sound(widen(answered, one), commands)

    if hasattr(first, "py_func"):  # the compiler is on
        # both are closures, whose sources alone do not say what they are
        made_of = f"{law_identity} {identity(Definition(Path(__file__).resolve()))}"
        keep_machine_code(first, "own_law.start", made_of)
        keep_machine_code(later, "own_law.step", made_of)
    return Functions(first, later, compiled=True)


def plain_functions(
    start: Callable[..., Any], step: Callable[..., Any], source: Path
) -> Functions:
    """How a law in ordinary Python is flown: whatever it raises is counted, and ends no flight."""

    def first(measured: Measurement, reference: Reference | None, control: OwnLaw) -> Any:
        wanted = _followed_by_own(reference, control)
        try:
            memory, answered = start(measured, wanted, control.settings)
            return memory, sound(_numbers(answered), RESTING)
        except (Exception, SystemExit) as error:
            TROUBLES[place_of(error, source)] += 1
            return None, RESTING._replace(status=NO_ANSWER)

    def later(
        memory: Any,
        before: Measurement,
        commands: Commands,
        measured: Measurement,
        reference: Reference | None,
        control: OwnLaw,
    ) -> Any:
        wanted = _followed_by_own(reference, control)
        try:
            after, answered = step(memory, before, commands, measured, wanted, control.settings)
            return after, sound(_numbers(answered), commands)
        except (Exception, SystemExit) as error:
            TROUBLES[place_of(error, source)] += 1
            return memory, commands._replace(status=NO_ANSWER)

    return Functions(first, later, compiled=False)


def _numbers(answered: Commands) -> Commands:
    """An answer in plain numbers, whatever numbers the law reckons with."""
    if not isinstance(answered, Commands):
        raise TypeError(f"its answer is {type(answered).__name__}, and not Commands")
    attitude, rates, surfaces, throttle, status = answered
    return Commands(
        Attitude(*map(float, attitude)),
        Rates(*map(float, rates)),
        Surfaces(*map(float, surfaces)),
        float(throttle),
        int(status),
    )


def place_of(error: BaseException, source: Path) -> str:
    """What was raised, in a sentence, with the last line of `source` that it came through."""
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).resolve() == source
    ]
    if isinstance(error, SyntaxError) and error.lineno is not None:
        lines.append(error.lineno)
    where = f", line {lines[-1]}" if lines else ""
    words = " ".join(str(error).split())[:300]
    return f"{source.name}{where}: {type(error).__name__}: {words}"


def is_compiled(control: Control) -> bool:
    """Whether a law is compiled: the report's are; of others those that are element-wise."""
    return isinstance(control, FlightControl) or _functions(type(control)).compiled


def _functions(kind: type) -> Functions:
    return FUNCTIONS[kind]


def _start_of(kind: type) -> Callable[..., Any]:
    return _functions(kind).start if issubclass(kind, OwnLaw) else start_of_loops


def _step_of(kind: type) -> Callable[..., Any]:
    return _functions(kind).step if issubclass(kind, OwnLaw) else step_of_loops


def _followed_of(kind: type) -> Callable[..., Any]:
    return _followed_by_own if issubclass(kind, OwnLaw) else _followed_by_loops


start = by_type(_start_of)
step = by_type(_step_of)
followed = by_type(_followed_of)
