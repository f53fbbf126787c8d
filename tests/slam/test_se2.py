import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from slam.se2 import SE2, FloatArray, interpolate, wrap_angle

lengths = st.floats(-20.0, 20.0)
uniform = st.builds(SE2, lengths, lengths, st.floats(-math.pi, math.pi))
gaussian = st.integers(0, 2**32 - 1).map(lambda seed: SE2(*np.random.default_rng(seed).normal(0.0, [3.0, 3.0, 1.0])))
tiny = st.floats(-1e-7, 1e-7)
near_identity = st.builds(SE2, tiny, tiny, tiny)
near_half_turn = st.builds(lambda x, y, yaw: SE2(x, y, math.pi + yaw), lengths, lengths, tiny)
poses = st.one_of(uniform, gaussian, near_identity, near_half_turn)
headings = st.floats(-3.1, 3.1)
twists = st.builds(lambda vx, vy, omega: np.array([vx, vy, omega]), lengths, lengths, st.one_of(headings, tiny))


def assert_same(a: SE2, b: SE2, tolerance: float = 1e-9) -> None:
    """Equal as motions: headings pi and -pi are one."""
    np.testing.assert_allclose(a.matrix(), b.matrix(), atol=tolerance)


def hat(xi: FloatArray) -> FloatArray:
    return np.array([[0.0, -xi[2], xi[0]], [xi[2], 0.0, xi[1]], [0.0, 0.0, 0.0]])


@given(poses, poses, poses)
def test_composition_is_associative(a: SE2, b: SE2, c: SE2) -> None:
    assert_same((a @ b) @ c, a @ (b @ c))


@given(poses)
def test_the_identity_changes_nothing(a: SE2) -> None:
    assert_same(a @ SE2(), a)
    assert_same(SE2() @ a, a)


@given(poses)
def test_a_pose_and_its_inverse_cancel(a: SE2) -> None:
    assert_same(a @ a.inverse(), SE2())
    assert_same(a.inverse() @ a, SE2())


@given(poses, poses)
def test_composition_multiplies_matrices(a: SE2, b: SE2) -> None:
    np.testing.assert_allclose((a @ b).matrix(), a.matrix() @ b.matrix(), atol=1e-9)


@given(poses, lengths, lengths)
def test_transform_multiplies_homogeneous_points(a: SE2, x: float, y: float) -> None:
    np.testing.assert_allclose(a.transform(np.array([[x, y]]))[0], (a.matrix() @ [x, y, 1.0])[:2], atol=1e-9)


@given(poses)
def test_exp_undoes_log(a: SE2) -> None:
    assert_same(SE2.exp(a.log()), a)


@given(twists)
def test_log_undoes_exp(xi: FloatArray) -> None:
    np.testing.assert_allclose(SE2.exp(xi).log(), xi, atol=1e-8)


@given(twists)
def test_exp_is_the_matrix_exponential(xi: FloatArray) -> None:
    np.testing.assert_allclose(SE2.exp(xi).matrix(), expm(hat(xi)), atol=1e-8)


@given(poses, twists)
def test_the_adjoint_moves_a_twist_to_the_other_frame(a: SE2, xi: FloatArray) -> None:
    np.testing.assert_allclose(hat(a.adjoint() @ xi), a.matrix() @ hat(xi) @ a.inverse().matrix(), atol=1e-7)


@given(poses, poses)
def test_the_adjoint_respects_composition(a: SE2, b: SE2) -> None:
    np.testing.assert_allclose((a @ b).adjoint(), a.adjoint() @ b.adjoint(), atol=1e-7)


@given(st.floats(-1e3, 1e3))
def test_a_wrapped_angle_is_the_same_direction_within_a_half_turn(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-9)


def test_a_half_turn_backwards_is_a_half_turn() -> None:
    assert SE2(yaw=-math.pi).yaw == math.pi


@given(poses, poses)
def test_interpolation_starts_and_ends_at_its_poses(a: SE2, b: SE2) -> None:
    assert_same(interpolate(a, b, 0.0), a)
    assert_same(interpolate(a, b, 1.0), b)


def test_interpolation_follows_the_arc() -> None:
    quarter = SE2(1.0, 1.0, math.pi / 2)  # of a unit circle
    assert_same(interpolate(SE2(), quarter, 0.5), SE2(math.sin(math.pi / 4), 1.0 - math.cos(math.pi / 4), math.pi / 4))


@given(poses)
def test_an_array_holds_the_whole_pose(a: SE2) -> None:
    assert SE2.from_array(a.as_array()) == a
