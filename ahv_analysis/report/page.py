# Copyright 2026 ahv developers, Apache-2.0
"""A page of one flight, or of several overlaid, as one HTML file that needs nothing else."""

import json
import math
from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib.resources import files
from io import StringIO
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib import pyplot

from ahv_analysis.bag.info import refused_words
from ahv_analysis.bag.rows import Array
from ahv_analysis.flight.case import OWN_LAW, Case
from ahv_analysis.quantities import AXES, CONTROLS, TRACKED, Quantity, of_group
from ahv_analysis.report.drawn import EXACT, drawn, drawn_time, thinned_to
from ahv_analysis.report.figures import write_figure
from ahv_analysis.report.page_figures import flight_figures
from ahv_analysis.report.page_flight import Flight
from ahv_analysis.report.page_scene import scene_data, vehicle_data
from ahv_msgs_py.graph import NODES, case_nodes
from ahv_msgs_py.parameters import Parameter, Value
from ahv_plant.model.constants import STEP

PAGE = "template"  # folder of template, styles, scripts and libraries
# each uses those before it
SCRIPTS = (
    *("page.js", "cursor.js", "motion.js", "vehicle.js", "trail.js", "orbit.js", "near.js"),
    *("path.js", "scene.js", "start.js"),
)
LIBRARIES = (
    *("uPlot.min.css", "uPlot.iife.min.js", "uPlot.LICENSE"),
    *("three.iife.min.js", "three.LICENSE"),
)
NONE = "–"  # of what does not apply


# Headings of the page, in their order.
GROUPS = ("Path", "Air and mass", "Attitude", "Rates", "Controls", "Learner", "Hardware")

SELDOM = (
    "disturbance.",
    "actuator.",
    "failure.",
    "latency.",
    "sensor.",
)  # parameters that are set


class Group(NamedTuple):
    """Quantities that stand under one heading."""

    title: str
    quantities: tuple[Quantity, ...]


class Row(NamedTuple):
    """One metric of several flights, as it is printed."""

    name: str
    unit: str
    values: list[str]


class Setting(NamedTuple):
    """One parameter of several flights."""

    node: str
    name: str
    unit: str
    description: str
    values: list[Value | None]
    usual: bool  # all have its default

    @property
    def alike(self) -> bool:
        """Whether all flights have the same."""
        return len(set(self.values)) == 1


def number(value: float | None) -> str:
    """Write a number with four digits, and what is nothing but rounding as zero."""
    if value is None:
        return NONE
    if abs(value) < 1e-6:
        return "0"
    if not 1e-3 <= abs(value) < 1e6:
        text = f"{value:.2e}"
    else:
        text = f"{value:,.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"
    return text.replace("-", "−").replace(",", "\u202f")


def symbol(text: str) -> str:
    """Write a symbol on one line."""
    return text.replace("_", "").replace("^", "")


def seconds(value: float | None, never: str = NONE) -> str:
    """Write a time [s] to the step."""
    return never if value is None else f"{value:.2f}".rstrip("0").rstrip(".") + " s"


def setting(value: Value | None) -> str:
    """Write a parameter; a drawn one with six digits."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return NONE if value is None else str(value)


def render(flights: Sequence[Flight], figures: Sequence[str] = ()) -> str:
    """HTML of a page of the flights, with `figures` as SVG."""
    environment = Environment(
        loader=PackageLoader(__package__, PAGE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters |= {
        "number": number,
        "seconds": seconds,
        "symbol": symbol,
        "setting": setting,
    }
    folder = files(__package__) / PAGE

    def text(name: str) -> str:
        return (folder / name).read_text(encoding="utf-8")

    return environment.get_template("page.html").render(
        flights=flights,
        alone=flights[0] if len(flights) == 1 else None,
        tracked=TRACKED,
        controls=CONTROLS,
        axes=AXES,
        compared=dict(_compared(flights)),
        groups=list(_groups(flights)),
        settings=list(_settings(flights)),
        figures=[b64encode(figure.encode()).decode() for figure in figures],
        data=_data(flights),
        scene=_scene(flights),
        thinned={
            flight.name: span
            for flight in flights
            if (span := thinned_to(flight.record.time)) is not None
        },
        exact=EXACT * STEP,
        refused={
            flight.name: refused_words(flight.refused) for flight in flights if flight.refused
        },
        assets={name: text(name) for name in ("page.css", "scene.css", *LIBRARIES)},
        scripts=[text(name) for name in SCRIPTS],
    )


def draw_figures(flight: Flight) -> list[str]:
    """Draw the report's figures of a flight as SVG."""
    plates, draw = flight_figures(flight.record, flight.case)
    drawings = []
    for plate in plates:
        figure, drawing = draw(plate), StringIO()
        write_figure(figure, drawing, "svg")
        pyplot.close(figure)
        drawings.append(drawing.getvalue())
    return drawings


def _compared(flights: Sequence[Flight]) -> Iterator[tuple[str, list[Row]]]:
    """Metrics of the flights side by side, under headings."""

    def row(name: str, unit: str, *path: str, form: Callable[[Any], str] = number) -> Row:
        values: list[str] = []
        for flight in flights:
            found: Any = flight.metrics
            for step in path:
                found = NONE if found in (None, NONE) else found.get(step, NONE)
            values.append(NONE if found == NONE else form(found))
        return Row(name, unit, values)

    for title, field in (("RMS error", "rms"), ("Overshoot", "overshoot")):
        yield (
            title,
            [row(one.words, one.shown_unit, "tracking", one.words, field) for one in TRACKED],
        )
    settled = partial(seconds, never="not yet")
    yield (
        "Settled",
        [row(one.words, "", "tracking", one.words, "settling_s", form=settled) for one in TRACKED],
    )
    efforts = [f"{one.shown_unit}²·s" if one.shown_unit else "s" for one in CONTROLS]
    yield (
        "Control effort",
        [
            row(one.words, unit, "controls", one.words, "effort")
            for one, unit in zip(CONTROLS, efforts, strict=True)
        ],
    )
    yield (
        "Control travel",
        [row(one.words, one.shown_unit, "controls", one.words, "travel") for one in CONTROLS],
    )
    yield (
        "At a stop",
        [
            row(one.words, "", "controls", one.words, "saturated_s", form=seconds)
            for one in CONTROLS
        ],
    )
    yield (
        "Margin to inlet unstart",
        [
            row(symbol, "deg", "margins", name, "margin_deg")
            for symbol, name in (("α", "alpha"), ("β", "beta"))
        ],
    )
    if any(flight.metrics["learner"] for flight in flights):
        for title, field, unit in (
            ("RMS error of the learned disturbance", "estimate_rms_dps2", "deg/s²"),
            ("RMS error of the observer", "observer_rms_dps", "deg/s"),
        ):
            yield title, [row(axis, unit, "learner", axis, field) for axis, _ in AXES]
    yield "Fuel", [row("burnt", "kg", "fuel_kg")]


def _groups(flights: Sequence[Flight]) -> Iterator[Group]:
    """Groups of the quantities that any of the flights has."""
    for title in GROUPS:
        quantities = tuple(
            one
            for one in of_group(title)
            if any(one.values(flight.record) is not None for flight in flights)
        )
        if quantities:
            yield Group(title, quantities)


def _settings(flights: Sequence[Flight]) -> Iterator[Setting]:
    """Parameters of the nodes that flew; of disturbances and hardware those that were set."""
    cases = [flight.case for flight in flights if flight.case]
    for node in case_nodes():
        flown = any(node in ("plant", *case.controllers) for case in cases)
        for parameter in (*NODES[node].parameters, *_of_laws(node, cases)) if flown else ():
            values = [
                None if flight.case is None else flight.case.parameters[node].get(parameter.name)
                for flight in flights
            ]
            usual = set(values) <= {parameter.default, None}
            if not (usual and parameter.name.startswith(SELDOM)):
                yield Setting(
                    node, parameter.name, parameter.unit, parameter.description, values, usual
                )


def _of_laws(node: str, cases: Sequence[Case]) -> list[Parameter]:
    """Settings of laws of one's own, as they were flown: their sources may have gone."""
    known = {parameter.name for parameter in NODES[node].parameters}
    settings = {
        name: value
        for case in cases
        for name, value in case.parameters[node].items()
        if node == OWN_LAW and name not in known
    }
    return [Parameter(name, value, "setting of the law") for name, value in settings.items()]


def _data(flights: Sequence[Flight]) -> str:
    """What page.js draws, as JSON that can stand within HTML."""
    content = {
        "flights": [
            {
                "name": flight.name,
                "lost": flight.lost_at,
                "time": _encode(drawn_time(flight.record.time)),
            }
            for flight in flights
        ],
        "plots": [_plot(one, flights) for group in _groups(flights) for one in group.quantities],
    }
    return _json(content)


def _scene(flights: Sequence[Flight]) -> str:
    """What scene.js draws, as JSON that can stand within HTML."""
    moved = [scene_data(flight, _encode) for flight in flights]
    return _json({"vehicle": vehicle_data(), "flights": moved})


def _json(content: dict[str, Any]) -> str:
    return json.dumps(content, allow_nan=False).replace("<", "\\u003c")


def _plot(one: Quantity, flights: Sequence[Flight]) -> dict[str, Any]:
    bounds = {one.drawn_bounds(flight.settings) for flight in flights} - {None}
    lines = []
    for index, flight in enumerate(flights):
        values, time = one.drawn(flight.record), flight.record.time
        if values is None:
            continue
        lines.append({"flight": index, "reference": False, "values": _encode(drawn(time, values))})
        reference = one.drawn_reference(flight.record, flight.settings)
        if reference is not None:
            lines.append(
                {"flight": index, "reference": True, "values": _encode(drawn(time, reference))}
            )
    return {
        "name": one.words,
        "referenceName": one.reference_words,
        "held": one in CONTROLS,  # from one step to the next
        "bounds": bounds.pop() if len(bounds) == 1 else None,
        "lines": lines,
    }


def _encode(values: Array) -> str:
    """Little-endian 32-bit floats in base64."""
    return b64encode(values.astype("<f4").tobytes()).decode()
