# Copyright 2026 ahv developers, Apache-2.0
"""The quantities that a flight is read by: names, units, commands, bounds. Angles in degrees."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ahv_analysis.bag.record import Array, FlightRecord
from ahv_control.flight_control import FlightControl
from ahv_plant.model.constants import (
    DEGREES,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
    UNSTART_ALPHA,
)

Settings = FlightControl | None  # None where a bag does not tell them


class Signal(NamedTuple):
    """One quantity of a flight; arrays are (N+1,), None where the flight has none of it."""

    name: str
    symbol: str
    unit: str
    values: Callable[[FlightRecord], Array | None]
    reference: Callable[[FlightRecord, Settings], Array | None] = lambda record, settings: None
    reference_name: str = "command"
    band: float | None = None  # of a tracked quantity: |error| within it is settled
    bounds: Callable[[Settings], tuple[float, float] | None] = lambda settings: None


class Group(NamedTuple):
    """Signals that are read together."""

    title: str
    signals: tuple[Signal, ...]


def _state(name: str, symbol: str, unit: str, field: str) -> Signal:
    return Signal(name, symbol, unit, lambda record: record.column(field))


def _guided(
    name: str,
    symbol: str,
    unit: str,
    field: str,
    command: Callable[[FlightControl], float],
    band: float,
) -> Signal:
    """Return a state with a constant command among the settings."""
    return Signal(
        name,
        symbol,
        unit,
        lambda record: record.column(field),
        lambda record, settings: (
            None if settings is None else np.full(len(record.stamps), command(settings))
        ),
        band=band,
    )


def _attitude(name: str, symbol: str, index: int) -> Signal:
    return Signal(
        name,
        symbol,
        "deg",
        lambda record: record.states[:, 6 + index] * DEGREES,
        lambda record, settings: record.attitude_commands[:, index] * DEGREES,
        band=0.25,
    )


def _rate(name: str, symbol: str, index: int) -> Signal:
    return Signal(
        name,
        symbol,
        "deg/s",
        lambda record: record.states[:, 3 + index] * DEGREES,
        lambda record, settings: record.rate_commands[:, index] * DEGREES,
        band=0.1,
    )


def _surface(name: str, symbol: str, index: int) -> Signal:
    return Signal(
        name,
        symbol,
        "deg",
        lambda record: record.surfaces[:, index] * DEGREES,
        bounds=lambda settings: (SURFACE_MINIMUM * DEGREES, SURFACE_MAXIMUM * DEGREES),
    )


def _estimate(name: str, symbol: str, index: int) -> Signal:
    def values(record: FlightRecord) -> Array | None:
        return None if record.estimates is None else record.estimates[:, index] * DEGREES

    return Signal(
        f"{name} disturbance",
        symbol,
        "deg/s²",
        values,
        # the last step has not flown yet: it is drawn like the one before
        lambda record, settings: np.pad(
            record.actual_disturbance[:, index] * DEGREES, (0, 1), mode="edge"
        ),
        "actual",
    )


def _observed(name: str, symbol: str, index: int) -> Signal:
    def values(record: FlightRecord) -> Array | None:
        error = record.observer_error
        return None if error is None else error[:, index] * DEGREES

    def bounds(settings: Settings) -> tuple[float, float] | None:
        if settings is None or settings.learner is None:
            return None
        return -settings.learner.k_b, settings.learner.k_b

    return Signal(f"{name} observer error", symbol, "deg/s", values, bounds=bounds)


ALPHA = Signal(
    "angle of attack",
    "α",
    "deg",
    lambda record: record.air.alpha * DEGREES,
    bounds=lambda settings: (-UNSTART_ALPHA * DEGREES, UNSTART_ALPHA * DEGREES),
)
CONTROLS = (
    _surface("right elevon", "δe", 0),
    _surface("left elevon", "δa", 1),
    _surface("rudder", "δr", 2),
    Signal(
        "throttle",
        "σT",
        "",
        lambda record: record.throttle,
        bounds=lambda settings: (THROTTLE_MINIMUM, THROTTLE_MAXIMUM),
    ),
)
AXES = (("roll", "P"), ("pitch", "Q"), ("yaw", "R"))
GROUPS = (
    Group(
        "Path",
        (
            _guided("altitude", "h", "m", "h", lambda settings: settings.outer.altitude, 25.0),
            _guided("speed", "u", "m/s", "u", lambda settings: settings.velocity.speed, 1.0),
            _state("drift east", "y", "m", "y"),
        ),
    ),
    Group(
        "Air and mass",
        (
            ALPHA,
            Signal("sideslip angle", "β", "deg", lambda record: record.air.beta * DEGREES),
            Signal("flight path angle", "γ", "deg", lambda record: record.climb_angle * DEGREES),
            Signal("Mach number", "M", "", lambda record: record.air.mach),
            Signal(
                "dynamic pressure", "q̄", "kPa", lambda record: record.air.dynamic_pressure * 1e-3
            ),
            _state("mass", "m", "kg", "mass"),
        ),
    ),
    Group(
        "Attitude",
        (
            _attitude("roll angle", "φ", 0),
            _attitude("pitch angle", "θ", 1),
            _attitude("yaw angle", "ψ", 2),
        ),
    ),
    Group("Rates", tuple(_rate(f"{axis} rate", rate, i) for i, (axis, rate) in enumerate(AXES))),
    Group("Controls", CONTROLS),
    Group(
        "Learner",
        (
            *(_estimate(axis, f"d̂{rate}", i) for i, (axis, rate) in enumerate(AXES)),
            *(_observed(axis, f"{rate} − {rate}a", i) for i, (axis, rate) in enumerate(AXES)),
        ),
    ),
)
TRACKED = tuple(signal for group in GROUPS for signal in group.signals if signal.band)
