# Copyright 2026 ahv developers, Apache-2.0
"""Poses of the vehicle as viewers know them: by quaternion, in both conventions.

Aerospace: `map_ned` (north, east, down) and `base_link_frd` (forward, right, down). Robotics,
REP-103: `map` (east, north, up) and `base_link` (forward, left, up). Good enough to look at; the
control loop uses none of it.
"""

from typing import NamedTuple

from scipy.spatial.transform import Rotation

from ahv_plant.model.vectors import State
from ahv_plant.winged_cone import Vector

Quaternion = tuple[float, float, float, float]  # x, y, z, w

# Both exchange the first two axes, or turn by half about the first, and are their own inverse.
NED_IN_ENU: Quaternion = (0.5**0.5, 0.5**0.5, 0.0, 0.0)
FLU_IN_FRD: Quaternion = (1.0, 0.0, 0.0, 0.0)


class Pose(NamedTuple):
    """Where the vehicle is and how it moves, in one convention."""

    position: Vector  # [m] in the frame of the Earth
    attitude: Quaternion  # of the body in the frame of the Earth
    velocity: Vector  # [m/s] in the frame of the body
    rates: Vector  # [rad/s] in the frame of the body


def ned_pose(state: State) -> Pose:
    """Pose [m, m/s, rad/s] of `base_link_frd` in `map_ned`."""
    rotation = Rotation.from_euler("ZYX", (state.psi, state.theta, state.phi))
    return Pose(
        (state.x, state.y, -state.h),
        _quaternion(rotation),
        (state.u, state.v, state.w),
        (state.P, state.Q, state.R),
    )


def enu_pose(state: State) -> Pose:
    """Pose [m, m/s, rad/s] of `base_link` in `map`."""
    ned = ned_pose(state)
    rotation = Rotation.from_quat(NED_IN_ENU) * Rotation.from_quat(ned.attitude)
    return Pose(
        (state.y, state.x, state.h),
        _quaternion(rotation * Rotation.from_quat(FLU_IN_FRD)),
        (state.u, -state.v, -state.w),
        (state.P, -state.Q, -state.R),
    )


def _quaternion(rotation: Rotation) -> Quaternion:
    x, y, z, w = (float(part) for part in rotation.as_quat())
    return x, y, z, w
