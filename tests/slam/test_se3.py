import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from slam.se2 import SE2, FloatArray
from slam.se3 import SE3, skew


def vectors(low: float, high: float) -> st.SearchStrategy[FloatArray]:
    return st.lists(st.floats(low, high), min_size=3, max_size=3).map(np.array)


def turned(axis: FloatArray, angle: float, t: FloatArray) -> SE3:
    direction = axis / np.linalg.norm(axis)
    return SE3(Rotation.from_rotvec(direction * angle).as_matrix(), t)


axes = st.integers(0, 2**32 - 1).map(lambda seed: np.random.default_rng(seed).normal(size=3))
lengths = vectors(-20.0, 20.0)
uniform = st.builds(turned, axes, st.floats(0.0, 3.1), lengths)
gaussian = st.integers(0, 2**32 - 1).map(lambda seed: SE3.exp(np.random.default_rng(seed).normal(0.0, 0.6, 6)))
near_identity = st.builds(turned, axes, st.floats(0.0, 1e-7), vectors(-1e-7, 1e-7))
near_half_turn = st.builds(turned, axes, st.floats(math.pi - 1e-3, math.pi - 1e-6), lengths)
poses = st.one_of(uniform, gaussian, near_identity, near_half_turn)
rotations = st.one_of(st.builds(lambda a, angle: a / np.linalg.norm(a) * angle, axes, st.one_of(st.floats(0.0, 3.1), st.floats(0.0, 1e-3))))
twists = st.builds(lambda rho, theta: np.concatenate([rho, theta]), lengths, rotations)


def assert_same(a: SE3, b: SE3, tolerance: float = 1e-9) -> None:
    np.testing.assert_allclose(a.matrix(), b.matrix(), atol=tolerance)


def hat(xi: FloatArray) -> FloatArray:
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3] = skew(xi[3:]), xi[:3]
    return matrix


@given(poses, poses, poses)
def test_composition_is_associative(a: SE3, b: SE3, c: SE3) -> None:
    assert_same((a @ b) @ c, a @ (b @ c))


@given(poses)
def test_a_pose_and_its_inverse_cancel(a: SE3) -> None:
    assert_same(a @ a.inverse(), SE3())
    assert_same(a.inverse() @ a, SE3())


@given(poses, poses)
def test_composition_multiplies_matrices(a: SE3, b: SE3) -> None:
    np.testing.assert_allclose((a @ b).matrix(), a.matrix() @ b.matrix(), atol=1e-9)


@given(poses, lengths)
def test_transform_multiplies_homogeneous_points(a: SE3, point: FloatArray) -> None:
    np.testing.assert_allclose(a.transform(point[None])[0], (a.matrix() @ [*point, 1.0])[:3], atol=1e-9)


@given(poses)
def test_exp_undoes_log(a: SE3) -> None:
    assert_same(SE3.exp(a.log()), a, 1e-7)


@given(twists)
def test_log_undoes_exp(xi: FloatArray) -> None:
    np.testing.assert_allclose(SE3.exp(xi).log(), xi, atol=1e-6)


@given(twists)
def test_exp_is_the_matrix_exponential(xi: FloatArray) -> None:
    np.testing.assert_allclose(SE3.exp(xi).matrix(), expm(hat(xi)), atol=1e-8)


@given(poses, twists)
def test_the_adjoint_moves_a_twist_to_the_other_frame(a: SE3, xi: FloatArray) -> None:
    np.testing.assert_allclose(hat(a.adjoint() @ xi), a.matrix() @ hat(xi) @ a.inverse().matrix(), atol=1e-7)


@given(poses)
def test_a_quaternion_keeps_the_rotation(a: SE3) -> None:
    assert_same(SE3.from_quaternion(a.quaternion(), a.t), a, 1e-7)


@given(poses)
def test_the_quaternion_is_of_unit_length_with_a_positive_real_part(a: SE3) -> None:
    q = a.quaternion()
    assert math.isclose(float(np.linalg.norm(q)), 1.0, abs_tol=1e-12)
    assert q[3] >= 0.0


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_roll_pitch_yaw_turn_about_fixed_axes(roll: float, pitch: float, yaw: float) -> None:
    T = SE3.from_xyz_rpy((1.0, 2.0, 3.0), (roll, pitch, yaw))
    np.testing.assert_allclose(T.R, Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(T.rpy(), (roll, pitch, yaw), atol=1e-9)


@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1), st.floats(-2.0, 2.0))
def test_a_planar_pose_survives_the_lift_to_space(x: float, y: float, yaw: float, z: float) -> None:
    lifted = SE3.from_se2(SE2(x, y, yaw), z)
    np.testing.assert_allclose(lifted.to_se2().as_array(), [x, y, yaw], atol=1e-12)
    assert lifted.t[2] == z


def test_equal_transforms_are_equal_and_hash_alike() -> None:
    a, b = SE3.from_xyz_rpy((1.0, 0.0, 0.0)), SE3.from_xyz_rpy((1.0, 0.0, 0.0))
    assert a == b
    assert hash(a) == hash(b)
    assert a != SE3()


def test_a_transform_cannot_be_written() -> None:
    R = np.eye(3)
    T = SE3(R)
    R[0, 0] = 7.0
    assert T.R[0, 0] == 1.0
    assert not T.R.flags.writeable
    assert not T.t.flags.writeable
