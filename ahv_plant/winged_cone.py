# Copyright 2026 ahv developers, Apache-2.0
"""The winged cone as viewers draw it: triangles of the body, and surfaces that turn on hinges.

Span and wing area are those of Table 2.1 of the report; the rest follows the drawing of the
vehicle closely enough to look at. The model of the flight uses none of it.
"""

from itertools import pairwise
from math import cos, pi, sin
from typing import NamedTuple

from ahv_plant.model.constants import WING_AREA, WING_SPAN

Vector = tuple[float, float, float]

LENGTH = 61.0  # [m] nose to tail
NOSE = 0.6 * LENGTH  # [m] of the tip ahead of the origin
RADIUS = 3.9  # [m] of the cylinder
SIDES = 16  # of the body
STATIONS = ((0.735, RADIUS), (0.80, RADIUS), (1.0, 2.0))  # [-] share of the length, [m] radius
HALF_SPAN = WING_SPAN / 2.0  # [m]
ROOT = 2.0 * WING_AREA / WING_SPAN  # [m] chord on the axis, of a triangle of area S and span b
TRAILING_EDGE = NOSE - 0.84 * LENGTH  # [m] of the wing
ELEVON_CHORD, ELEVON_ROOT = 2.2, 4.6  # [m] chord, and distance of the inner edge from the axis
THICKNESS = 0.35  # [m] half of the wing's, on the axis
FIN_HEIGHT, FIN_ROOT, FIN_TIP = (
    9.9,
    21.4,
    2.0,
)  # [m] above the axis; chords on the axis, at the tip
FIN_END = NOSE - LENGTH  # [m] of the tip's trailing edge
FIN_SLANT = 7.8  # [m] by which the trailing edge lies further back at the tip
RUDDER_FOOT = 0.4  # [-] of the fin's height
RUDDER_SHARE = 0.25  # [-] of the fin's chord


class Part(NamedTuple):
    """A part of the vehicle that can turn: a positive deflection turns it about its axis."""

    name: str  # as in the message of the surfaces
    hinge: Vector  # [m] a point of the hinge in `base_link_frd`
    axis: Vector  # unit vector along the hinge in `base_link_frd`
    corners: list[Vector]  # [m] from the hinge, of triangles, three by three


def body() -> list[Vector]:
    """Corners of triangles [m] in `base_link_frd`, three by three: what does not move."""
    return [*_fuselage(), *_wing(), *_fin()]


def surfaces() -> tuple[Part, Part, Part]:
    """Right elevon, left elevon and rudder, in the order of the message of the surfaces.

    A positive elevon has its trailing edge down, a positive rudder has it left.
    """
    return _elevon("right_elevon", 1.0), _elevon("left_elevon", -1.0), _rudder()


def _fuselage() -> list[Vector]:
    corners: list[Vector] = []

    def ring(share: float, radius: float) -> list[Vector]:
        angles = [2 * pi * k / SIDES for k in range(SIDES)]
        return [(NOSE - share * LENGTH, radius * cos(a), radius * sin(a)) for a in angles]

    rings = [[(NOSE, 0.0, 0.0)] * SIDES, *(ring(*station) for station in STATIONS)]
    rings.append([(NOSE - LENGTH, 0.0, 0.0)] * SIDES)
    for fore, aft in pairwise(rings):
        for k in range(SIDES):
            following = (k + 1) % SIDES
            if fore is not rings[0]:
                corners += [fore[k], fore[following], aft[following]]
            if aft is not rings[-1]:
                corners += [fore[k], aft[following], aft[k]]
    return corners


def _wing() -> list[Vector]:
    """Both halves up to the hinges of the elevons, and what lies inboard of these."""
    apex, hinge = TRAILING_EDGE + ROOT, TRAILING_EDGE + ELEVON_CHORD
    reach = HALF_SPAN * (1.0 - ELEVON_CHORD / ROOT)  # of the leading edge at the hinge
    corners: list[Vector] = []
    for side in (1.0, -1.0):
        for face in (THICKNESS, -THICKNESS):
            ridge = (hinge + 6.0, 0.0, face)
            tip, root = (hinge, side * reach, 0.0), (hinge, 0.0, 0.5 * face)
            corners += [(apex, 0.0, 0.0), tip, ridge, ridge, tip, root]
        inner = side * ELEVON_ROOT
        corners += _quad(
            (hinge, 0.0, 0.0),
            (hinge, inner, 0.0),
            (TRAILING_EDGE, inner, 0.0),
            (TRAILING_EDGE, 0.0, 0.0),
        )
    return corners


def _elevon(name: str, side: float) -> Part:
    hinge = (TRAILING_EDGE + ELEVON_CHORD, side * ELEVON_ROOT, 0.0)
    reach = HALF_SPAN * (1.0 - ELEVON_CHORD / ROOT)
    corners = _quad(
        (0.0, 0.0, 0.0),
        (0.0, side * (reach - ELEVON_ROOT), 0.0),
        (-ELEVON_CHORD, side * (HALF_SPAN - ELEVON_ROOT), 0.0),
        (-ELEVON_CHORD, 0.0, 0.0),
    )
    return Part(name, hinge, (0.0, 1.0, 0.0), corners)


def _chord(share: float) -> tuple[float, float, float]:
    """Trailing edge, hinge of the rudder and leading edge [m] at a share of the fin's height."""
    chord = FIN_ROOT + share * (FIN_TIP - FIN_ROOT)
    end = FIN_END + (1.0 - share) * FIN_SLANT
    return end, end + RUDDER_SHARE * chord, end + chord


def _fin() -> list[Vector]:
    foot, middle, tip = _chord(0.0), _chord(RUDDER_FOOT), _chord(1.0)
    at_middle, at_tip = -RUDDER_FOOT * FIN_HEIGHT, -FIN_HEIGHT
    below = _quad(
        (foot[2], 0.0, 0.0),
        (middle[2], 0.0, at_middle),
        (middle[0], 0.0, at_middle),
        (foot[0], 0.0, 0.0),
    )
    ahead = _quad(
        (middle[2], 0.0, at_middle),
        (tip[2], 0.0, at_tip),
        (tip[1], 0.0, at_tip),
        (middle[1], 0.0, at_middle),
    )
    return below + ahead


def _rudder() -> Part:
    foot, tip = _chord(RUDDER_FOOT), _chord(1.0)
    height = (1.0 - RUDDER_FOOT) * FIN_HEIGHT
    back = tip[1] - foot[1]
    length = (height * height + back * back) ** 0.5
    corners = _quad(
        (0.0, 0.0, 0.0),
        (back, 0.0, -height),
        (tip[0] - foot[1], 0.0, -height),
        (foot[0] - foot[1], 0.0, 0.0),
    )
    hinge = (foot[1], 0.0, -RUDDER_FOOT * FIN_HEIGHT)
    return Part("rudder", hinge, (-back / length, 0.0, height / length), corners)


def _quad(a: Vector, b: Vector, c: Vector, d: Vector) -> list[Vector]:
    return [a, b, c, a, c, d]
