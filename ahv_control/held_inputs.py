# Copyright 2026 ahv developers, Apache-2.0
"""What the control nodes go on with while an input stays away, in real time.

Each takes the last values, None if there were none, and their age in steps.
"""

from ahv_control.flight_control import NEUTRAL
from ahv_msgs_py.node.faults import HOLD, PERIOD
from ahv_msgs_py.node.synchronizer import Values
from ahv_plant.model.vectors import Surfaces
from ahv_plant.safe_command import level_surfaces


def held_rates(last: Values | None, age: int) -> Values:
    """Rate command [rad/s]: the last one for a while, then zero rates."""
    if last is not None and age * PERIOD <= HOLD:
        return last
    return 0.0, 0.0, 0.0


def held_reference(last: Values | None, age: int) -> Values | None:
    """Reference: where it was, without its rates; none if there never was one."""
    return None if last is None else (*last[:4], 0.0, 0.0, 0.0)


def held_surfaces(last: Values | None, age: int) -> Values:
    """Surfaces [rad]: those that the plant holds, and then its safe command."""
    if last is None:
        return NEUTRAL
    return last if age * PERIOD <= HOLD else level_surfaces(Surfaces(*last))


def held_positions(last: Values | None, age: int) -> Values | None:
    """Measured positions [rad]: the last ones for a while, then none, and commands must do."""
    return last if age * PERIOD <= HOLD else None


def held_estimate(last: Values | None, age: int) -> Values:
    """Disturbance estimate: the last one; what the vehicle lacks, it still lacks."""
    return last or (0.0,) * 6


def nothing(last: Values | None, age: int) -> None:
    """Stand in for what cannot be held: an old observer, a state of long ago."""
