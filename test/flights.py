# Copyright 2026 ahv developers, Apache-2.0
"""States that tests start from."""

from hypothesis import strategies as st

from ahv_plant.model.constants import RADIANS
from ahv_plant.model.vectors import State, Surfaces

CRUISE = State(
    1786.4, 0.0, 91.8, 0.0, 0.0, 0.0, 0.0, 2.94 * RADIANS, 0.0, 0.0, 0.0, 24000.0, 136077.6
)


def as_python(function):
    """The plain Python behind a compiled function, which takes numbers of any kind."""
    return getattr(function, "py_func", function)


def between(low, high):
    """Floats of a closed interval."""
    return st.floats(low, high, allow_nan=False)


def degrees(limit):
    """Angles of up to plus or minus `limit` [deg], in radians."""
    return between(-limit * RADIANS, limit * RADIANS)


STATES = st.builds(
    State,
    u=between(1300.0, 4000.0),
    v=between(-80.0, 80.0),
    w=between(-100.0, 250.0),
    P=degrees(10.0),
    Q=degrees(10.0),
    R=degrees(10.0),
    phi=degrees(60.0),
    theta=degrees(30.0),
    psi=degrees(180.0),
    x=between(-1e5, 1e5),
    y=between(-1e5, 1e5),
    h=between(20000.0, 34000.0),
    mass=between(80000.0, 140000.0),
)
SURFACES = st.builds(
    Surfaces, right_elevon=degrees(20.0), left_elevon=degrees(20.0), rudder=degrees(20.0)
)
