# Copyright 2026 ahv developers, Apache-2.0
"""What the view in three dimensions of a page moves by: a flight at the steps that it shows."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ahv_analysis.bag.rows import Array
from ahv_analysis.report.page_flight import Flight
from ahv_plant.dispersion import Dispersion
from ahv_plant.model.aerodynamic_fits import CL_basic, CL_elevon
from ahv_plant.model.constants import DEGREES, GRAVITY, WING_AREA
from ahv_plant.winged_cone import body, surfaces

MOST = 6000  # steps of a flight that are shown
FASTEST = 20_000.0  # [m/s] beyond which a lost vehicle's numbers say nothing any more


def scene_data(flight: Flight, encode: Callable[[Array], str]) -> dict[str, Any]:
    """Time and motion of a flight, each as `encode` writes an array (n,), SI units and radians.

    Of a lost flight these end where the state stops being one of a vehicle.
    """
    return {name: encode(values) for name, values in scene_channels(flight).items()}


def scene_channels(flight: Flight) -> dict[str, Array]:
    """Arrays (n,) of what the view shows, at the steps that it shows; positions in `map_ned`.

    `lift` is that of the model as flown [weights of the vehicle]. `reference` is the altitude to
    follow, left out where the bag does not tell it.
    """
    record, settings = flight.record, flight.settings
    step = -(-len(record.stamps) // MOST)
    states = record.states[::step]
    with np.errstate(all="ignore"):
        usable = np.all(np.isfinite(states), axis=1)
        usable &= np.linalg.norm(states[:, :3], axis=1) < FASTEST
    count = len(usable) if np.all(usable) else max(1, int(np.argmin(usable)))
    part = slice(0, count * step, step)
    rows = states[:count]
    moved = record.surfaces if record.positions is None else record.positions
    deflections, air = moved[part], record.air
    alpha, pressure = air.alpha[part], air.dynamic_pressure[part]
    by = Dispersion() if flight.case is None else flight.case.plant.truth.dispersion
    coefficient = by.CL * lift_coefficient(alpha, air.mach[part], deflections)
    channels = {
        "time": record.time[part],
        "x": rows[:, 9],
        "y": rows[:, 10],
        "h": rows[:, 11],
        "phi": np.unwrap(rows[:, 6]),
        "theta": rows[:, 7],
        "psi": np.unwrap(rows[:, 8]),
        "alpha": alpha,
        "beta": air.beta[part],
        "speed": air.speed[part],
        "mach": air.mach[part],
        "lift": pressure * WING_AREA * coefficient / (rows[:, 12] * GRAVITY),
        "throttle": record.throttle[part],
        "right_elevon": deflections[:, 0],
        "left_elevon": deflections[:, 1],
        "rudder": deflections[:, 2],
        "phi_command": record.attitude_commands[part, 0],
        "theta_command": record.attitude_commands[part, 1],
        "psi_command": record.attitude_commands[part, 2],
    }
    if record.references is not None:
        channels["reference"] = record.references[part, 0]
    elif settings is not None:
        channels["reference"] = np.full(count, settings.altitude)
    with np.errstate(over="ignore"):
        return {name: np.nan_to_num(values.astype("<f4")) for name, values in channels.items()}


def lift_coefficient(alpha: Array, mach: Array, deflections: Array) -> Array:
    """Nominal C_L (n,) at alpha [rad] with surfaces (n, 3) [rad] deflected, section 2.2."""
    degrees = alpha * DEGREES
    basic, elevon = _plain(CL_basic), _plain(CL_elevon)
    with np.errstate(all="ignore"):
        lift: Array = basic(degrees, mach)
        for side in (0, 1):
            lift = lift + elevon(degrees, mach, deflections[:, side] * DEGREES)[0]
    return lift


def _plain(function: Any) -> Any:
    """Return the function as Python, which takes arrays as numbers; nothing is compiled for it."""
    return getattr(function, "py_func", function)


def vehicle_data() -> dict[str, Any]:
    """The winged cone: corners of triangles [m] in `base_link_frd`, and surfaces with hinges."""

    def rounded(corners: list[tuple[float, float, float]]) -> list[float]:
        return [round(value, 3) for corner in corners for value in corner]

    return {
        "body": rounded(body()),
        "surfaces": [
            {
                "name": part.name,
                "hinge": part.hinge,
                "axis": part.axis,
                "corners": rounded(part.corners),
            }
            for part in surfaces()
        ],
    }
