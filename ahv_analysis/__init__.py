# Copyright 2026 ahv developers, Apache-2.0
"""What happens around a flight: engines, bags, figures, campaigns, the `ahv` command.

For a notebook:

    import ahv_analysis as ahv

    flight = ahv.fly("neuro_adaptive_di", dispersion=0.3, seed=1, run=7)
    flight.dataset()
    ahv.fly_campaign("neuro_adaptive_di", level=0.3, runs=100, hardware="typical")
"""

from importlib import import_module
from typing import Any

__all__ = ["Flight", "case_names", "envelope", "fly", "fly_campaign", "fly_map", "read_bag"]


def __getattr__(name: str) -> Any:
    """Load what a notebook needs when it is asked for: the commands start without it."""
    if name in __all__:
        return getattr(import_module("ahv_analysis.public"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
