# Copyright 2026 ahv developers, Apache-2.0
"""Limits of a trim, section 3.5.2: the inlet's angle of attack, stops of elevons and throttle."""

from typing import NamedTuple

from ahv_plant.model.constants import (
    DEGREES,
    SURFACE_MAXIMUM,
    SURFACE_MINIMUM,
    THROTTLE_MAXIMUM,
    THROTTLE_MINIMUM,
    UNSTART_ALPHA,
)


class Limit(NamedTuple):
    """A quantity of a trim, and between what it must be."""

    name: str
    low: float  # in any unit, as it is told to people
    high: float  # in any unit
    unit: str

    def margin(self, value: float) -> float:
        """Distance of `value` to the nearer end, in any unit; negative beyond it."""
        return min(value - self.low, self.high - value)

    def relative_margin(self, value: float) -> float:
        """Return the margin [-] of `value`: 1 in the middle and 0 at the ends."""
        return 2.0 * self.margin(value) / (self.high - self.low)

    def passed_by(self, value: float) -> str:
        """Which end `value`, in any unit, is beyond, in words; empty between them."""
        for end, word, beyond in (
            (self.low, "below", value < self.low),
            (self.high, "above", value > self.high),
        ):
            if beyond:
                return f"{self.name} {word} {end:g} {self.unit}".rstrip()
        return ""


BOUND = round(UNSTART_ALPHA * DEGREES, 9)  # [deg]
ALPHA = Limit("alpha", -BOUND, BOUND, "deg")
ELEVON = Limit(
    "elevons", round(SURFACE_MINIMUM * DEGREES, 9), round(SURFACE_MAXIMUM * DEGREES, 9), "deg"
)
THROTTLE = Limit("throttle", THROTTLE_MINIMUM, THROTTLE_MAXIMUM, "")
LIMITS = (ALPHA, ELEVON, THROTTLE)
NOT_FOUND = "the solver did not converge"
