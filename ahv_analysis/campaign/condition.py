# Copyright 2026 ahv developers, Apache-2.0
"""Flight conditions as axes of a map: altitude, Mach number and mass, for start and commands.

A point is flown as its case is, somewhere else. The commands are those of the point. The start is
moved with them, by as much as the trim moves: its first state differs from the trim of the point
in what the case's own first state differs from the trim at the case's own commands and mass. The
cases of the report start 0.25 m/s too fast and 0.004 deg below their trim, and so does every point
of their maps. Trims are those of the nominal vehicle, which is all that a law knows.
"""

from collections.abc import Mapping

from ahv_analysis.flight.case import make_case
from ahv_msgs_py.parameters import Parameter, ParameterError
from ahv_plant.dispersion import Truth
from ahv_plant.envelope import why_no_trim
from ahv_plant.model.aerodynamics import MACH_MINIMUM
from ahv_plant.model.atmosphere import ALTITUDE_MAXIMUM, ALTITUDE_MINIMUM, atmosphere
from ahv_plant.model.constants import DEGREES, INITIAL_MASS
from ahv_plant.model.flight_condition import CRUISE_ALTITUDE, MACH_MAXIMUM
from ahv_plant.model.mass import MASS_MAXIMUM, MASS_MINIMUM
from ahv_plant.trim import trim

ALTITUDE = Parameter(
    "altitude", CRUISE_ALTITUDE, "of start and command", "m", ALTITUDE_MINIMUM, ALTITUDE_MAXIMUM
)
MACH = Parameter("mach", 6.0, "of the speed command u*", "", MACH_MINIMUM, MACH_MAXIMUM)
MASS = Parameter("mass", INITIAL_MASS, "of the start", "kg", MASS_MINIMUM, MASS_MAXIMUM)
CONDITIONS = {parameter.name: parameter for parameter in (ALTITUDE, MACH, MASS)}
WHERE = "flight condition"  # instead of the name of a node

COMMANDED = {  # what a condition sets, by node
    "altitude": ("outer_intermediate", "altitude"),
    "mach": ("velocity", "speed"),
    "mass": ("plant", "initial.mass"),
}
MOVED = ("initial.u", "initial.w", "initial.theta", "initial.h")  # of the plant, with any of them

Given = Mapping[str, Mapping[str, object]]  # parameters by node


def at_condition(name: str, given: Given, conditions: Mapping[str, float]) -> tuple[Given, str]:
    """Parameters by node of the case `name` at `conditions`, and why it has no trim there.

    `conditions` are altitude [m], Mach number [-] and mass [kg], by name; what is not among them
    stays: h*, u*, initial.mass. The words are empty if there is a trim within the limits. Raises
    ParameterError outside the range of the model, and for a case that has no trim where it starts.
    """
    case = make_case(name, given)
    geometric = case.plant.truth.geometric
    altitude = conditions.get("altitude", case.control.altitude)
    speed = case.control.speed
    if "mach" in conditions:
        speed = conditions["mach"] * atmosphere(altitude, geometric).sound_speed
    mass = conditions.get("mass", case.plant.initial.mass)
    truth = Truth(geometric)
    own_commands = case.control.altitude, case.control.speed
    own = trim(*own_commands, case.plant.initial.mass, truth)
    if not own.converged:
        raise ParameterError(f"{name}: there is no trim at its own commands, to start others from")
    try:
        found = trim(altitude, speed, mass, truth)
    except ValueError as error:
        raise ParameterError(f"{name}: {error}") from error
    why = why_no_trim(found)
    if why:
        return given, why
    changed = {node: dict(values) for node, values in given.items()}
    for condition, value in (("altitude", altitude), ("mach", speed), ("mass", mass)):
        node, parameter = COMMANDED[condition]
        changed.setdefault(node, {})[parameter] = value
    plant = changed["plant"]
    for parameter in MOVED:
        field = parameter.removeprefix("initial.")
        moved = float(getattr(found.state, field)) - float(getattr(own.state, field))
        unit = DEGREES if field == "theta" else 1.0
        plant[parameter] = float(case.parameters["plant"][parameter]) + moved * unit
    return changed, ""
