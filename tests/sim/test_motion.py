import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.motion import STEP, WHEELS, Motion
from slam.se2 import SE2
from slam.se3 import SE3


def circling(steps, rate=2.0, T_inertial_base=None):
    """A base that circles the origin at 1 m, given by the poses of its inertial frame."""
    T_inertial_base = T_inertial_base or SE3()
    motion = Motion(0, T_inertial_base)
    for k in range(steps):
        a = rate * k * STEP
        T = SE3.from_se2(SE2(math.cos(a), math.sin(a), a + math.pi / 2)) @ T_inertial_base.inverse()
        motion.append([(*T.t, *T.quaternion(), a, 2 * a)])
    return motion


@given(st.floats(0.0, 3.9))
def test_the_track_gives_the_pose_at_any_past_time(t):
    pose = CIRCLING.pose_at(t)
    a = 2.0 * t
    assert (pose.x, pose.y) == pytest.approx((math.cos(a), math.sin(a)), abs=1e-5)
    assert math.remainder(pose.yaw - a - math.pi / 2, math.tau) == pytest.approx(0.0, abs=1e-9)


CIRCLING = circling(2000)


def test_rows_are_interpolated():
    assert CIRCLING.row_at(3.9012)[WHEELS : WHEELS + 2] == pytest.approx([7.8024, 15.6048])


def test_the_window_keeps_half_a_second_at_least():
    poses, first = CIRCLING.poses_between(CIRCLING.end - 0.5, CIRCLING.end)
    assert first == pytest.approx(CIRCLING.end - 0.5, abs=STEP)
    assert len(poses) >= 250


def test_poses_between_hold_both_times():
    poses, first = CIRCLING.poses_between(3.90051, 3.90731)
    assert first <= 3.90051
    assert first + (len(poses) - 1) * STEP >= 3.90731
    assert len(poses) == 5


def test_the_inertial_frame_is_turned_into_base():
    offset = SE3.from_xyz_rpy((-0.1, 0.02, 0.07), (0.1, -0.7, 0.3))
    motion = circling(100, T_inertial_base=offset)
    assert motion.track == pytest.approx(CIRCLING.track[:100], abs=1e-12)
    assert motion.row_at(0.1)[:7] == pytest.approx(CIRCLING_START.row_at(0.1)[:7], abs=1e-12)


CIRCLING_START = circling(100)


def test_a_single_row_is_a_motion_that_stands():
    motion = circling(1)
    poses, _ = motion.poses_between(0.0, 0.1)
    assert np.array_equal(poses[0], poses[1])
    assert motion.yaw_rate_at(0.0) == 0.0
    assert motion.pose_at(5.0).as_array() == pytest.approx([1.0, 0.0, math.pi / 2])
