# Copyright 2026 ahv developers, Apache-2.0
"""What no vehicle of this kind could follow is refused before it flies."""

from math import atan

from ahv_control.guidance import Guidance, conditions, fastest_turn
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import NOMINAL
from ahv_plant.envelope import why_no_trim
from ahv_plant.model.constants import DEGREES, GRAVITY, THROTTLE_MAXIMUM
from ahv_plant.model.mass import MASS_MINIMUM
from ahv_plant.parameters import PlantSettings
from ahv_plant.trim import CRUISE_SPEED, check_flight_condition, trim
from ahv_plant.vehicle import state_rate


def check_reach(guidance: Guidance, plant: PlantSettings) -> None:
    """Raise ParameterError for a reference that leads where the nominal vehicle cannot fly level.

    It is refused only where that is certain: with the mass that full throttle since the start
    would have left. A turn is refused whose bank is beyond the limit.
    """
    nominal = NOMINAL._replace(geometric=plant.truth.geometric)
    level = trim(truth=nominal)
    burning = -state_rate(level.state, level.surfaces, THROTTLE_MAXIMUM, 0.0, nominal).mass
    for place, altitude, speed, time in conditions(guidance):
        lightest = max(plant.initial.mass - burning * time, MASS_MINIMUM)
        try:
            check_flight_condition(altitude, speed, plant.initial.mass, nominal.geometric)
            why = why_no_trim(trim(altitude, speed, lightest, nominal))
        except ValueError as error:
            raise ParameterError(f"guidance: {place}: {error}") from error
        if why:
            raise ParameterError(
                f"guidance: {place}: no vehicle of {lightest / 1e3:.0f} t or more flies level at "
                f"{altitude:g} m and {speed:g} m/s: {why}"
            )
    turn = fastest_turn(guidance)
    bank = atan(CRUISE_SPEED * turn / GRAVITY)
    if guidance.coordinated and bank > guidance.bank_limit:
        raise ParameterError(
            f"guidance: a turn of {turn * DEGREES:.3g} deg/s takes a bank of {bank * DEGREES:.3g} "
            f"deg at {CRUISE_SPEED:g} m/s, but bank_limit is {guidance.bank_limit * DEGREES:g} deg"
        )
