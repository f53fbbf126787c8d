import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.kernels import gauss_newton
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, ONE_SIDED, X, Y
from slam.se2 import SE2, FloatArray

CELL = 0.1
WIDE = 1e6
"""A kernel so wide that every residual counts fully [m]."""


def corner(lone: bool = False) -> tuple[np.ndarray, np.ndarray, float]:
    """Field of the walls x = 2 (for the lower half) and y = 2 (for the upper), as lines or as lone points."""
    nearest = np.zeros((40, 40), np.int32)
    nearest[20:] = 1
    surfaces = np.zeros((40, 40, 5), np.float32)
    surfaces[0, 0], surfaces[0, 1] = (2.0, 0.5, 1.0, 0.0, 1.0), (0.5, 2.0, 0.0, 1.0, 1.0)
    if lone:
        surfaces[:, :, 2:] = 0.0
    return nearest, surfaces, CELL


def residuals(points: FloatArray, pose: FloatArray, field: tuple[np.ndarray, np.ndarray, float]) -> FloatArray:
    """Signed distances to the line, or both components to the lone point, of the cell that holds each point."""
    at = SE2.from_array(pose).transform(points)
    surfaces = field[1].reshape(-1, 5)[field[0][(at[:, 1] // CELL).astype(int), (at[:, 0] // CELL).astype(int)]]
    d = at - surfaces[:, [X, Y]]
    lone = (surfaces[:, NORMAL_X] == 0.0) & (surfaces[:, NORMAL_Y] == 0.0)
    along = np.einsum("ij,ij->i", d, surfaces[:, [NORMAL_X, NORMAL_Y]])
    return np.concatenate([along[~lone], d[lone].ravel()])


def jacobian(points: FloatArray, pose: FloatArray, field: tuple[np.ndarray, np.ndarray, float]) -> FloatArray:
    """Central differences (K, 3)."""
    step = 1e-6
    columns = [(residuals(points, pose + step * e, field) - residuals(points, pose - step * e, field)) / (2 * step) for e in np.eye(3)]
    return np.column_stack(columns)


def equations(points: FloatArray, pose: FloatArray, lone: bool) -> tuple[FloatArray, FloatArray]:
    """H and g of the points at the pose."""
    H, g = np.empty((3, 3)), np.empty(3)
    gauss_newton.normal_equations((points, 1), pose, corner(lone), (WIDE, 1.0), H, g)
    return H, g


# cell centres of both halves, so that no difference crosses a cell border
TARGETS = np.array([(0.55, 0.55), (1.05, 1.85), (2.55, 1.15), (1.75, 2.75), (0.95, 3.05), (3.05, 2.15)])
poses = st.builds(lambda x, y, yaw: np.array([x, y, yaw]), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-3.1, 3.1))


@pytest.mark.parametrize("lone", [False, True])
@settings(max_examples=40)
@given(pose=poses)
def test_the_normal_equations_are_those_of_the_residuals(pose: FloatArray, lone: bool) -> None:
    points = SE2.from_array(pose).inverse().transform(TARGETS)
    J, d = jacobian(points, pose, corner(lone)), residuals(points, pose, corner(lone))
    H, g = equations(points, pose, lone)
    np.testing.assert_allclose(H, J.T @ J, atol=1e-5)
    np.testing.assert_allclose(g, J.T @ d, atol=1e-5)


def test_every_second_point_counts_twice() -> None:
    pose, H, g = np.array([0.1, 0.0, 0.2]), np.empty((3, 3)), np.empty(3)
    gauss_newton.normal_equations((TARGETS, 2), pose, corner(), (WIDE, 1.0), H, g)
    half_H, half_g = equations(TARGETS[::2].copy(), pose, lone=False)
    np.testing.assert_allclose(H, 2.0 * half_H)
    np.testing.assert_allclose(g, 2.0 * half_g)


@pytest.mark.parametrize(("side", "information"), [(-1.0, 1.0), (1.0, 0.0)])
def test_a_wall_says_nothing_to_who_sees_its_other_face(side: float, information: float) -> None:
    nearest, surfaces, cell = corner()
    surfaces[0, 0, [NORMAL_X, FLATNESS]] = side, ONE_SIDED
    settings, noise, field = (1, WIDE, WIDE, 1e-9, 1.0, 1.0), (0.01, 10.0, 0.0), (nearest, surfaces, cell)
    mean = np.array([0.5, 0.5, 0.0])
    pose, *_ = gauss_newton.match(np.array([[1.55, 0.05]]), mean, (mean, np.eye(3)), field, settings, noise)
    assert (abs(pose[0] - mean[0]) > 1e-6) == (information > 0.0)


def test_a_start_pose_is_not_written() -> None:
    pose = np.array([0.1, 0.2, 0.3])
    gauss_newton.match(TARGETS, pose, (pose, np.eye(3)), corner(), (5, 0.5, 0.1, 1e-4, 0.7, 0.2), (0.01, 10.0, 0.2))
    np.testing.assert_array_equal(pose, [0.1, 0.2, 0.3])


def test_without_points_the_prior_is_the_answer() -> None:
    mean, prior = np.array([0.1, 0.2, 0.3]), np.diag([1.0, 2.0, 3.0])
    settings = (10, 0.5, 0.1, 1e-4, 0.7, 0.2)
    pose, covariance, rms, share, *_ = gauss_newton.match(
        np.empty((0, 2)), np.zeros(3), (mean, prior), corner(), settings, (0.01, 10.0, 0.2)
    )
    np.testing.assert_allclose(pose, mean)
    np.testing.assert_allclose(covariance, prior)
    assert (rms, share) == (0.0, 0.0)


spd = st.integers(0, 2**32 - 1).map(lambda seed: np.random.default_rng(seed).normal(size=(3, 5))).map(lambda B: B @ B.T + 0.1 * np.eye(3))


@given(spd)
def test_the_inverse_is_numpys(A: FloatArray) -> None:
    np.testing.assert_allclose(gauss_newton.inverse(A), np.linalg.inv(A), rtol=1e-8, atol=1e-10)


def test_a_singular_matrix_has_no_inverse() -> None:
    assert np.isnan(gauss_newton.inverse(np.zeros((3, 3)))).all()
