# Copyright 2026 ahv developers, Apache-2.0
"""How well a vehicle was flown, in numbers with exact definitions; docs/reports.md lists them.

States are samples. A command holds from its step to the next one, as the plant flies it; that of
the last step was never flown.
"""

from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Array
from ahv_analysis.flight.case import Case
from ahv_analysis.quantities import AXES, CONTROLS, TRACKED, Settings
from ahv_plant.model.constants import DEGREES, STEP, STEP_NS, UNSTART_ALPHA
from ahv_plant.model.vectors import Controls, State, Surfaces
from ahv_plant.plant_flight import PlantFlight
from ahv_plant.termination import termination_reason

# The report bounds alpha alone. Of beta the same flow angle is taken: an assumption, on which no
# verdict depends.
UNSTART_BETA = UNSTART_ALPHA  # [rad]


class Tracking(NamedTuple):
    """How a quantity followed its command: the error, and when it was gone for good."""

    rms: float
    largest: float
    initial: float
    final: float
    overshoot: float | None  # None: it began within the band, so that there is none to speak of
    settling_s: float | None  # None: outside the band at the end


class Use(NamedTuple):
    """What a control was used for, in the unit of the control."""

    lowest: float
    highest: float
    effort: float  # [unit^2 s]
    travel: float
    saturated_s: float


class Margin(NamedTuple):
    """How far an angle [deg] stayed from its bound."""

    largest_deg: float
    largest_at_s: float
    margin_deg: float  # negative: exceeded
    beyond_s: float
    first_beyond_s: float | None


class Learning(NamedTuple):
    """How well a channel of the learner learned: errors in deg/s and deg/s^2."""

    observer_rms_dps: float
    observer_largest_dps: float
    estimate_rms_dps2: float
    estimate_final_dps2: float


def rms(values: Array) -> float:
    """Root mean square of the samples, sqrt(mean(values^2))."""
    return float(np.sqrt(np.mean(np.square(values))))


def largest(values: Array) -> float:
    """Largest magnitude of the samples."""
    return float(np.max(np.abs(values)))


def integral(time: Array, values: Array | NDArray[np.bool_]) -> float:
    """Integral over `time` (N+1,) [s] of values (N+1,) that hold from each sample to the next."""
    return float(np.sum(values[:-1] * np.diff(time)))


def overshoot(error: Array) -> float:
    """Largest excursion of an error to the side of zero where it did not begin; 0 if none."""
    return max(0.0, float(np.max(-np.sign(error[0]) * error)))


def settling_time(time: Array, error: Array, band: float) -> float | None:
    """Time [s] from the first sample to the first of those that stay within `band` to the end.

    Zero if all do, None if the last one does not.
    """
    outside = np.flatnonzero(np.abs(error) > band)
    if not len(outside):
        return 0.0
    if outside[-1] == len(error) - 1:
        return None
    return float(time[outside[-1] + 1] - time[0])


def tracking(time: Array, error: Array, band: float) -> Tracking:
    """How an error (N+1,), value less command, came to rest within plus and minus `band`."""
    return Tracking(
        rms(error),
        largest(error),
        float(error[0]),
        float(error[-1]),
        overshoot(error) if abs(error[0]) > band else None,
        settling_time(time, error, band),
    )


def use(time: Array, command: Array, stops: tuple[float, float]) -> Use:
    """Use of a control from its commands (N+1,) and its stops.

    Effort is the integral of the command's square, travel the sum of its changes, all counted
    positive, and saturated the time that it stood at a stop.
    """
    lower, upper = stops
    return Use(
        float(np.min(command)),
        float(np.max(command)),
        integral(time, np.square(command)),
        float(np.sum(np.abs(np.diff(command)))),
        integral(time, (command <= lower) | (command >= upper)),
    )


def margin(time: Array, angle: Array, bound: float) -> Margin:
    """Margin of an angle (N+1,) to plus and minus `bound`, both [rad]; Margin is in degrees."""
    size = np.abs(angle)
    beyond = size > bound
    return Margin(
        largest(angle) * DEGREES,
        float(time[np.argmax(size)]),
        (bound - largest(angle)) * DEGREES,
        integral(time, beyond),
        float(time[np.argmax(beyond)]) if np.any(beyond) else None,
    )


def margins(record: FlightRecord) -> dict[str, Margin]:
    """Margins of alpha and beta to inlet unstart."""
    return {
        "alpha": margin(record.time, record.air.alpha, UNSTART_ALPHA),
        "beta": margin(record.time, record.air.beta, UNSTART_BETA),
    }


def fuel(record: FlightRecord) -> float:
    """Fuel burnt [kg]: mass at the first state less mass at the last."""
    mass = record.column("mass")
    return float(mass[0] - mass[-1])


def learning(record: FlightRecord) -> dict[str, Learning] | None:
    """Errors of the learner by channel, None without one.

    Of the observer, X - X_a; of the estimate, d-hat less the actual disturbance of each step.
    """
    observed, estimates = record.observer_error, record.estimates
    if observed is None or estimates is None or record.steps == 0:
        return None
    observed = observed * DEGREES
    missed = (estimates[:-1] - record.actual_disturbance) * DEGREES
    return {
        axis: Learning(
            rms(observed[:, i]), largest(observed[:, i]), rms(missed[:, i]), float(missed[-1, i])
        )
        for i, (axis, _) in enumerate(AXES)
    }


def why_ended_early(record: FlightRecord, case: Case) -> str:
    """Why a flight has fewer steps than its case asks for, in words; empty if it has not.

    The state that ended it is not in the bag: the last step is flown once more.
    """
    flown = int(record.stamps[-1]) // STEP_NS  # steps, even if the bag lacks some
    if flown >= case.plant.steps:
        return ""
    geometric, end = case.plant.truth.geometric, flown * STEP
    reason = termination_reason(_one_step_later(record, case), geometric, (flown + 1) * STEP)
    return reason or f"the recording stops at {end:g} s of {case.plant.steps * STEP:g} s"


def _one_step_later(record: FlightRecord, case: Case) -> State:
    """The state that the last commands of a record led to.

    What is under way in actuators and sensors is in no record: on hardware the plant is flown
    again from the start, with all the commands. Where that does not lead to the last state, as in
    real time, which may have flown others, that state is all that is known.
    """
    flight = PlantFlight(case.plant)
    last = State(*record.states[-1].tolist())
    ideal = case.plant.hardware is None
    part = slice(-1 if ideal else 0, None)
    plant = before = flight.start._replace(state=last) if ideal else flight.start
    rows = zip(record.stamps[part], record.surfaces[part], record.throttle[part], strict=True)
    for stamp, surfaces, throttle in rows:
        command = Controls(Surfaces(*surfaces.tolist()), float(throttle))
        before, plant = plant, flight.later(plant, command, int(stamp) // STEP_NS)
    return plant.state if before.state == last else last


def measure(record: FlightRecord, settings: Settings) -> dict[str, Any]:
    """All metrics of a flight as plain numbers; None is what does not apply.

    Errors are in the units of `TRACKED`; where `settings` is None the commands of altitude and
    speed are unknown, and so is how they were tracked.
    """
    time = record.time
    tracked: dict[str, Any] = {}
    for one in TRACKED:
        command, values = one.drawn_reference(record, settings), one.drawn(record)
        assert values is not None and one.band is not None
        if command is not None:
            tracked[one.words] = tracking(time, values - command, one.band)._asdict()
    controls: dict[str, Any] = {}
    for one in CONTROLS:
        values, stops = one.drawn(record), one.drawn_bounds(settings)
        assert values is not None and stops is not None
        controls[one.words] = use(time, values, stops)._asdict()
    learned = learning(record)
    return _finite(
        {
            "tracking": tracked,
            "controls": controls,
            "margins": {name: found._asdict() for name, found in margins(record).items()},
            "learner": learned and {axis: found._asdict() for axis, found in learned.items()},
            "fuel_kg": fuel(record),
        }
    )


def _finite(facts: Any) -> Any:
    """Numbers that are none, as of a flight with absurd values, do not apply."""
    if isinstance(facts, dict):
        return {name: _finite(value) for name, value in facts.items()}
    return None if isinstance(facts, float) and not isfinite(facts) else facts
