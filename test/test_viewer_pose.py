# Copyright 2026 ahv developers, Apache-2.0
"""What viewers see is the vehicle, in either convention."""

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from ahv_control.flight_control import NEUTRAL
from ahv_plant.dispersion import Truth
from ahv_plant.model.vectors import State
from ahv_plant.vehicle import state_rate
from ahv_plant.viewer_pose import FLU_IN_FRD, NED_IN_ENU, enu_pose, ned_pose
from ahv_plant.winged_cone import body, surfaces
from test.flights import STATES

pytestmark = pytest.mark.unit


@given(STATES)
def test_the_quaternion_turns_velocity_as_the_equations_of_motion_do(state):
    pose = ned_pose(state)
    north, east, down = Rotation.from_quat(pose.attitude).apply(pose.velocity)
    moving = State(*state_rate(state, NEUTRAL, 0.2, 0.0, Truth(False)))
    assert np.allclose((north, east, -down), (moving.x, moving.y, moving.h), rtol=0, atol=1e-8)


@given(STATES)
def test_both_conventions_show_one_motion(state):
    ned, enu = ned_pose(state), enu_pose(state)
    swap = Rotation.from_quat(NED_IN_ENU)
    assert np.allclose(swap.apply(ned.position), enu.position, rtol=0, atol=1e-6)
    for name in ("velocity", "rates"):
        seen = Rotation.from_quat(ned.attitude).apply(getattr(ned, name))
        other = Rotation.from_quat(enu.attitude).apply(getattr(enu, name))
        assert np.allclose(swap.apply(seen), other, rtol=0, atol=1e-8)


def test_the_robotics_frames_are_those_of_rep_103():
    swap, turn = Rotation.from_quat(NED_IN_ENU), Rotation.from_quat(FLU_IN_FRD)
    assert np.allclose(swap.apply((1, 0, 0)), (0, 1, 0))  # north is the second axis
    assert np.allclose(swap.apply((0, 0, 1)), (0, 0, -1))
    assert np.allclose(turn.apply((0, 1, 0)), (0, -1, 0))  # left is minus right


def test_the_vehicle_is_as_wide_as_its_span_and_points_forward():
    moving = [np.add(part.hinge, part.corners) for part in surfaces()]
    corners = np.concatenate((body(), *moving))
    assert all(len(part) % 3 == 0 for part in (body(), *moving))
    assert np.ptp(corners[:, 1]) == pytest.approx(18.288)  # b of Table 2.1
    nose = corners[np.argmax(corners[:, 0])]
    assert nose[0] > 0 and nose[1] == nose[2] == 0
    assert corners[:, 2].min() < -5  # the fin is up


def test_positive_elevons_go_down_and_a_positive_rudder_goes_left():
    for part in surfaces():
        turned = Rotation.from_rotvec(0.3 * np.array(part.axis)).apply(part.corners)
        moved = turned - np.array(part.corners)
        if part.name == "rudder":
            assert moved[:, 1].min() < -0.5 and moved[:, 1].max() < 1e-9
        else:
            assert moved[:, 2].max() == pytest.approx(2.2 * np.sin(0.3))  # its chord is 2.2 m
            assert moved[:, 2].min() > -1e-9
        on_hinge = np.linalg.norm(np.cross(part.axis, part.corners), axis=1) < 1e-9
        assert np.count_nonzero(on_hinge) >= 3  # both ends, of one triangle twice
        assert np.allclose(moved[on_hinge], 0.0)
