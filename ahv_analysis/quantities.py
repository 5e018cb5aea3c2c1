# Copyright 2026 ahv developers, Apache-2.0
"""The quantities of a flight: names, symbols, units, frames, and how they come from a record.

One table. Figures, pages, metrics, exports and replays read it; a quantity that is added to it
here is in all of them.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ahv_analysis.bag.record import FlightRecord
from ahv_analysis.bag.rows import Array, Rows
from ahv_control.own_law import Control
from ahv_msgs_py.topics import (
    ATTITUDE_COMMAND,
    BASIS_NAMES,
    BODY_FRAME,
    DISTURBANCE_ESTIMATE,
    EARTH_FRAME,
    LEARNER,
    RATE_COMMAND,
    REFERENCE,
    STATE,
    SURFACE_COMMAND,
    SURFACES,
    THROTTLE_COMMAND,
    TRUTH,
    LoopTopic,
)
from ahv_plant.model.constants import (
    DEGREES,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
    UNSTART_ALPHA,
)

Settings = Control | None  # None where a bag does not tell them
Bounds = tuple[float, float] | None

# Units for people, and what a number in SI units is multiplied by.
SCALES = {
    "deg": DEGREES,
    "deg/s": DEGREES,
    "deg/s²": DEGREES,
    "km": 1e-3,
    "t": 1e-3,
    "kPa": 1e-3,
}


class Quantity(NamedTuple):
    """One quantity of a flight, in SI units and radians; weights of the learner in degrees."""

    name: str  # in datasets and files
    words: str  # the same for people
    symbol: str  # `_` and `^` before what stands lower and higher; empty: it is not drawn
    unit: str
    frame: str  # in which it is given; empty for one that has none
    topic: LoopTopic | None  # that recorded it; None: it is derived
    values: Callable[[FlightRecord], Array | None]  # (N+1,), None where a flight has none of it
    index: int = -1  # of the field of the topic
    note: str = ""  # what else is to be known of it
    shown: str = ""  # unit for people, of SCALES; empty: `unit`
    plate: str = ""  # figure of the report that has it
    group: str = ""  # of the page that has it
    reference: Callable[[FlightRecord, Settings], Array | None] = lambda record, settings: None
    reference_words: str = "command"
    band: float | None = None  # of a tracked quantity, as shown: |error| within it is settled
    bounds: Callable[[Settings], Bounds] = lambda settings: None

    @property
    def shown_unit(self) -> str:
        """Unit for people; a plain number has none."""
        return self.shown or self.unit.removesuffix("1")

    def shown_values(self, values: Array, unit: str = "") -> Array:
        """SI values in the unit for people, or in `unit`."""
        return values * SCALES.get(unit or self.shown, 1.0)

    def drawn(self, record: FlightRecord, unit: str = "") -> Array | None:
        """Values (N+1,) of a flight in the unit for people, or in `unit`."""
        values = self.values(record)
        return None if values is None else self.shown_values(values, unit)

    def drawn_reference(
        self, record: FlightRecord, settings: Settings, unit: str = ""
    ) -> Array | None:
        """What the quantity is to follow (N+1,), in the unit for people, or in `unit`."""
        values = self.reference(record, settings)
        return None if values is None else self.shown_values(values, unit)

    def drawn_bounds(self, settings: Settings) -> Bounds:
        """Bounds in the unit for people."""
        bounds = self.bounds(settings)
        if bounds is None:
            return None
        low, high = self.shown_values(np.array(bounds)).tolist()
        return low, high

    def label(self, unit: str = "") -> str:
        """Label of an axis of a figure."""
        tex = self.symbol.replace("d̂", r"\hat d").replace("q̄", r"\bar q")
        shown = (unit or self.shown_unit or "-").replace("²", "$^2$")
        return f"${tex}$ [{shown}]"


# The arrays of a record that hold a topic's fields, and the first field that they hold.
ARRAYS: dict[LoopTopic, tuple[Callable[[FlightRecord], Rows | None], int]] = {
    STATE: (lambda record: record.states, 0),
    REFERENCE: (lambda record: record.references, 0),
    ATTITUDE_COMMAND: (lambda record: record.attitude_commands, 0),
    RATE_COMMAND: (lambda record: record.rate_commands, 0),
    SURFACE_COMMAND: (lambda record: record.surfaces, 0),
    THROTTLE_COMMAND: (lambda record: record.throttle[:, None], 0),
    LEARNER: (lambda record: record.learner, 0),
    DISTURBANCE_ESTIMATE: (lambda record: record.estimates, 3),  # no linear part
}


def _recorded(
    topic: LoopTopic, field: str, name: str, words: str, symbol: str, unit: str, frame: str
) -> Quantity:
    """A field of a topic."""
    index = topic.layout.fields.index(field)
    array, first = ARRAYS[topic]

    def values(record: FlightRecord) -> Array | None:
        rows = array(record)
        return None if rows is None else rows[:, index - first]

    return Quantity(name, words, symbol, unit, frame, topic, values, index)


def _derived(
    name: str,
    words: str,
    symbol: str,
    unit: str,
    frame: str,
    values: Callable[[FlightRecord], Array | None],
) -> Quantity:
    return Quantity(name, words, symbol, unit, frame, None, values)


def _wanted(
    field: str, own: Callable[[Control], float]
) -> Callable[[FlightRecord, Settings], Array | None]:
    """A field of the reference of a guided flight; of any other the loops' own command."""
    index = REFERENCE.layout.fields.index(field)

    def values(record: FlightRecord, settings: Settings) -> Array | None:
        if record.references is not None:
            return record.references[:, index]
        return None if settings is None else np.full(len(record.stamps), own(settings))

    return values


def _within(half: float) -> Callable[[Settings], Bounds]:
    return lambda settings: (-half, half)


def _observer_bounds(settings: Settings) -> Bounds:
    if settings is None or settings.learner is None:
        return None
    k_b = settings.learner.k_b / DEGREES
    return -k_b, k_b


def _channel(
    array: Callable[[FlightRecord], Array | None], index: int
) -> Callable[..., Array | None]:
    """A column of a derived array, None where there is none."""

    def values(record: FlightRecord) -> Array | None:
        rows = array(record)
        return None if rows is None else rows[:, index]

    return values


def _padded(record: FlightRecord, index: int) -> Array:
    """The actual disturbance; the last step has not flown yet and is taken as the one before."""
    return np.pad(record.actual_disturbance[:, index], (0, 1), mode="edge")


def _asked(commands: Rows, index: int) -> Array | None:
    """A column of commands; None of a law that commands none, which are zero then throughout."""
    return commands[:, index] if any(np.any(commands[:, other]) for other in range(3)) else None


def _velocity(name: str, words: str) -> Quantity:
    one = _recorded(STATE, name, name, words, name, "m/s", BODY_FRAME)
    return one._replace(plate="velocity")


def _rate(index: int, name: str, words: str) -> Quantity:
    one = _recorded(STATE, name, name, words, name, "rad/s", BODY_FRAME)
    return one._replace(
        shown="deg/s",
        plate="rates",
        group="Rates",
        reference=lambda record, settings: _asked(record.rate_commands, index),
        band=0.1,
    )


def _angle(index: int, name: str, words: str, symbol: str) -> Quantity:
    one = _recorded(STATE, name, name, words, symbol, "rad", EARTH_FRAME)
    return one._replace(
        shown="deg",
        plate="attitude",
        group="Attitude",
        reference=lambda record, settings: _asked(record.attitude_commands, index),
        band=0.25,
    )


def _surface(name: str, words: str, side: str, symbol: str) -> Quantity:
    one = _recorded(SURFACE_COMMAND, name, name, words, symbol, "rad", "")
    return one._replace(
        shown="deg",
        note=f"commanded, trailing edge {side}",
        plate="controls",
        group="Controls",
        bounds=lambda settings: (SURFACE_MINIMUM, SURFACE_MAXIMUM),
    )


def _estimate(index: int, rate: str) -> Quantity:
    words, symbol = f"learned disturbance of the rate of {rate}", f"d̂_{rate}"
    one = _recorded(DISTURBANCE_ESTIMATE, rate, f"d_{rate}", words, symbol, "rad/s^2", BODY_FRAME)
    return one._replace(
        shown="deg/s²",
        group="Learner",
        reference=lambda record, settings: _padded(record, index),
        reference_words="actual",
    )


def _observed(index: int, rate: str) -> Quantity:
    return _derived(
        f"{rate}_observer_error",
        f"observer error of {rate}",
        f"{rate} − {rate}_a",
        "rad/s",
        BODY_FRAME,
        _channel(lambda record: record.observer_error, index),
    )._replace(shown="deg/s", group="Learner", bounds=_observer_bounds)


def _measured(true: Quantity) -> Quantity:
    """A state as the flight software was told it, beside what is true."""
    drawn = true.plate in ("rates", "attitude")
    return true._replace(
        name=f"{true.name}_measured",
        words=f"measured {true.words}",
        symbol=f"{true.symbol}_m" if drawn else "",
        values=_channel(lambda record: record.measured, true.index),
        plate="measured" if drawn else "",
        group="Hardware" if drawn else "",
        reference=lambda record, settings: true.values(record),
        reference_words="true",
        band=None,
    )


def _position(commanded: Quantity) -> Quantity:
    """A surface as it was measured, beside what was commanded."""
    return commanded._replace(
        name=f"{commanded.name}_position",
        words=f"position of the {commanded.words}",
        topic=SURFACES,
        values=_channel(lambda record: record.positions, commanded.index),
        note=commanded.note.replace("commanded", "measured"),
        plate="surfaces",
        group="Hardware",
        reference=lambda record, settings: commanded.values(record),
    )


WEIGHT_UNITS = ("deg/s^2", *(f"deg/s^2/(deg/s)^{n}" for n in (1, 2, 1, 2, 4, 1, 2, 4, 4, 6)))
QUANTITIES = (
    _velocity("u", "forward speed")._replace(
        group="Path",
        reference=_wanted("speed", lambda settings: settings.speed),
        band=1.0,
    ),
    _velocity("v", "velocity right"),
    _velocity("w", "velocity down"),
    _rate(0, "P", "roll rate"),
    _rate(1, "Q", "pitch rate"),
    _rate(2, "R", "yaw rate"),
    _angle(0, "phi", "roll angle", "φ"),
    _angle(1, "theta", "pitch angle", "θ"),
    _angle(2, "psi", "yaw angle", "ψ"),
    _recorded(STATE, "x", "x", "distance north", "x", "m", EARTH_FRAME),
    _recorded(STATE, "y", "y", "distance east", "y", "m", EARTH_FRAME)._replace(group="Path"),
    _recorded(STATE, "h", "h", "altitude", "h", "m", EARTH_FRAME)._replace(
        plate="path",
        group="Path",
        reference=_wanted("altitude", lambda settings: settings.altitude),
        band=25.0,
    ),
    _recorded(STATE, "mass", "mass", "mass", "M_v", "kg", "")._replace(
        plate="path", group="Air and mass"
    ),
    *(
        _recorded(
            ATTITUDE_COMMAND,
            name,
            f"{name}_command",
            f"commanded {words}",
            symbol,
            "rad",
            EARTH_FRAME,
        )._replace(shown="deg")
        for name, words, symbol in (
            ("phi", "roll angle", "φ^*"),
            ("theta", "pitch angle", "θ^*"),
            ("psi", "yaw angle", "ψ^*"),
        )
    ),
    *(
        _recorded(
            RATE_COMMAND,
            name,
            f"{name}_command",
            f"commanded {words}",
            f"{name}^*",
            "rad/s",
            BODY_FRAME,
        )._replace(shown="deg/s")
        for name, words in (("P", "roll rate"), ("Q", "pitch rate"), ("R", "yaw rate"))
    ),
    *(
        _recorded(REFERENCE, name, f"{name}_reference", words, symbol, unit, EARTH_FRAME)
        for name, words, symbol, unit in (
            ("altitude", "altitude to follow", "h^*", "m"),
            ("speed", "speed to follow", "u^*", "m/s"),
            ("phi", "bank to follow", "φ^*", "rad"),
            ("psi", "heading to follow", "ψ^*", "rad"),
        )
    ),
    _surface("right_elevon", "right elevon", "down", "δ_e"),
    _surface("left_elevon", "left elevon", "down", "δ_a"),
    _surface("rudder", "rudder", "left", "δ_r"),
    _recorded(THROTTLE_COMMAND, "throttle", "throttle", "throttle", "σ_T", "1", "")._replace(
        note="commanded",
        plate="controls",
        group="Controls",
        bounds=lambda settings: (THROTTLE_MINIMUM, THROTTLE_MAXIMUM),
    ),
    _derived("mach", "Mach number", "M", "1", "", lambda record: record.air.mach)._replace(
        plate="air", group="Air and mass"
    ),
    _derived(
        "alpha", "angle of attack", "α", "rad", BODY_FRAME, lambda record: record.air.alpha
    )._replace(shown="deg", plate="air", group="Air and mass", bounds=_within(UNSTART_ALPHA)),
    _derived(
        "beta", "angle of sideslip", "β", "rad", BODY_FRAME, lambda record: record.air.beta
    )._replace(shown="deg", plate="air", group="Air and mass"),
    _derived(
        "gamma",
        "flight path angle",
        "γ",
        "rad",
        EARTH_FRAME,
        lambda record: record.climb_angle,
    )._replace(shown="deg", note="above the horizon", plate="path", group="Air and mass"),
    _derived(
        "dynamic_pressure",
        "dynamic pressure",
        "q̄",
        "Pa",
        "",
        lambda record: record.air.dynamic_pressure,
    )._replace(shown="kPa", group="Air and mass"),
    _derived("speed", "airspeed", "V", "m/s", "", lambda record: record.air.speed),
    *(
        _recorded(
            LEARNER,
            f"{plant}.{rate}",
            f"{plant}_{rate}",
            f"{words} {rate}",
            f"{rate}_{plant[-1]}",
            "rad/s",
            BODY_FRAME,
        )._replace(shown="deg/s")
        for plant, words in (("X_a", "approximate"), ("X_d", "desired"))
        for rate in "PQR"
    ),
    *(
        _recorded(
            LEARNER,
            f"W_{rate}.{term}",
            f"W_{rate}_{term}",
            f"weight of {term} in d_{rate}",
            "",
            unit,
            "",
        )
        for rate in "PQR"
        for term, unit in zip(BASIS_NAMES, WEIGHT_UNITS, strict=True)
    ),
    *(_estimate(index, rate) for index, rate in enumerate("PQR")),
    *(_observed(index, rate) for index, rate in enumerate("PQR")),
)
# what flights have whose hardware is not ideal
QUANTITIES += (
    *(_position(one) for one in QUANTITIES if one.topic is SURFACE_COMMAND),
    *(_measured(one) for one in QUANTITIES if one.topic is STATE),
)
BY_NAME = {quantity.name: quantity for quantity in QUANTITIES}
AXES = (("roll", "P"), ("pitch", "Q"), ("yaw", "R"))
TRACKED = tuple(quantity for quantity in QUANTITIES if quantity.band is not None)
CONTROLS = tuple(quantity for quantity in QUANTITIES if quantity.group == "Controls")


def source(one: Quantity, record: FlightRecord) -> LoopTopic | None:
    """Topic that a quantity of a flight is from: of what truly flew the state, if it is told."""
    true = one.topic is STATE and not one.name.endswith("_measured")
    return TRUTH if true and record.measured is not None else one.topic


def of_group(group: str) -> Sequence[Quantity]:
    """Quantities that stand together on a page."""
    return [quantity for quantity in QUANTITIES if quantity.group == group]


def of_plate(plate: str) -> Sequence[Quantity]:
    """Quantities of a figure of the report."""
    return [quantity for quantity in QUANTITIES if quantity.plate == plate]


def of_topic(topic: LoopTopic) -> Sequence[Quantity]:
    """Quantities that a topic records and that are drawn."""
    return [quantity for quantity in QUANTITIES if quantity.topic is topic and quantity.symbol]
