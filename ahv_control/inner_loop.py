"""Inner loop: from body-rate error to the control surfaces (section 3.3)."""

from typing import NamedTuple

from ahv_control.intermediate_loop import Rates
from ahv_control.newton_raphson import Solution, solve_surfaces
from ahv_plant.compiled import elementwise
from ahv_plant.state import State, Surfaces


class InnerLoop(NamedTuple):
    """Settings of the inner loop."""

    k_P: float  # [1/s]
    k_Q: float  # [1/s]
    k_R: float  # [1/s]
    geometric: bool  # h is a geometric altitude


@elementwise
def surface_command(
    state: State, command: Rates, previous: Surfaces, settings: InnerLoop
) -> Solution:
    """Surfaces [rad] under which the rate error decays at the gains, section 3.3.

    The search starts at the `previous` command.
    """
    demand = Rates(
        settings.k_P * (command.P - state.P),
        settings.k_Q * (command.Q - state.Q),
        settings.k_R * (command.R - state.R),
    )
    return solve_surfaces(state, demand, previous, settings.geometric)
