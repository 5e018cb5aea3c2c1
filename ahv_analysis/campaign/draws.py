# Copyright 2026 ahv developers, Apache-2.0
"""What a campaign draws besides the report's nine multipliers: a file of distributions."""

from pathlib import Path
from typing import Any

import yaml

from ahv_msgs_py.parameters import ParameterError
from ahv_plant.draws import Distributions, distributions_of
from ahv_plant.parameters import PLANT_PARAMETERS

IN_STEPS = ("duration", "latency.delay")
# what is one and the same for every run of a campaign
SHARED = {parameter.name for parameter in PLANT_PARAMETERS if type(parameter.default) is int}
SHARED |= {*IN_STEPS}


def load_draws(path: Path) -> dict[str, Any]:
    """Content of a file of distributions, checked; ParameterError names what is wrong."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise ParameterError(f"draws {str(path)!r} cannot be read: {reason}") from error
    checked_draws(content)
    return dict(content)


def checked_draws(content: object) -> Distributions:
    """Distributions of what such a file holds: `quantities` and, perhaps, `correlation`.

    Both are as `distributions_of` has them. Raises ParameterError.
    """
    parts = content if isinstance(content, dict) else {}
    quantities, correlation = parts.get("quantities"), parts.get("correlation", [])
    if (
        not parts.keys() <= {"quantities", "correlation"}
        or not isinstance(quantities, dict)
        or not quantities
        or not all(isinstance(name, str) for name in quantities)
        or not isinstance(correlation, list)
    ):
        raise ParameterError(
            "draws: must be quantities, by names of the plant's parameters, and may have a "
            "correlation, a list; and nothing else"
        )
    for name in quantities:
        if name in SHARED:
            raise ParameterError(
                f"draws: {name} is counted, and must be the same for every run of a campaign; "
                "valid is such as dispersion.mass"
            )
    return distributions_of(quantities, correlation, PLANT_PARAMETERS)
