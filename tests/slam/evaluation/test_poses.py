import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slam.evaluation.poses import compose, relative, sample, wrap_angles
from slam.messages import Trajectory
from slam.se2 import SE2, interpolate, wrap_angle

coordinate = st.floats(-100, 100)
poses = st.builds(SE2, coordinate, coordinate, st.floats(-3.1, 3.1))


def row(pose):
    return pose.as_array()[None]


def close(array, pose):
    difference = array[0] - pose.as_array()
    return np.allclose([*difference[:2], wrap_angle(difference[2])], 0.0, atol=1e-9)


@given(poses, poses)
def test_rows_compose_as_single_poses_do(a, b):
    assert close(compose(row(a), row(b)), a @ b)
    assert close(relative(row(a), row(b)), a.inverse() @ b)


@given(poses, poses, st.floats(0.0, 1.0))
def test_rows_are_sampled_as_single_poses_are_interpolated(a, b, fraction):
    sampled = sample(Trajectory([0.0, 1.0], [a.as_array(), b.as_array()]), np.array([fraction]))
    assert np.allclose(sampled[0, :2], interpolate(a, b, fraction).as_array()[:2], atol=1e-6)


def test_samples_are_held_beyond_the_ends_and_at_doubled_stamps():
    trajectory = Trajectory([1.0, 2.0, 2.0, 3.0], [(1, 0, 0), (2, 0, 0), (5, 0, 0), (6, 0, 0)])
    assert sample(trajectory, np.array([0.0, 2.0, 9.0]))[:, 0].tolist() == [1.0, 5.0, 6.0]


def test_a_single_pose_is_held_everywhere():
    assert sample(Trajectory([1.0], [(4, 5, 1)]), np.array([0.0, 1.0, 2.0])).tolist() == [[4.0, 5.0, 1.0]] * 3


def test_pi_wraps_to_plus_pi():
    assert wrap_angles(np.array([-np.pi, np.pi, 3 * np.pi])).tolist() == [np.pi] * 3
