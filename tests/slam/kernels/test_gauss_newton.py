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


def one_step(points: FloatArray, start: FloatArray, prior: FloatArray, lone: bool) -> tuple[FloatArray, FloatArray]:
    """The pose after one step and the information of the points alone, at unit variance."""
    settings, noise = (1, WIDE, WIDE, 1e-9, 1.0, 1.0), (100.0, 1e-4)
    moved, covariance, *_ = gauss_newton.match(points, start, (start, np.linalg.inv(prior)), corner(lone), settings, noise)
    return moved, np.linalg.inv(covariance) - prior


# cell centres of both halves, so that no difference crosses a cell border
TARGETS = np.array([(0.55, 0.55), (1.05, 1.85), (2.55, 1.15), (1.75, 2.75), (0.95, 3.05), (3.05, 2.15)])
poses = st.builds(lambda x, y, yaw: np.array([x, y, yaw]), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-3.1, 3.1))


@pytest.mark.parametrize("lone", [False, True])
@settings(max_examples=40)
@given(pose=poses)
def test_information_is_the_square_of_the_jacobian(pose: FloatArray, lone: bool) -> None:
    points = SE2.from_array(pose).inverse().transform(TARGETS)
    J = jacobian(points, pose, corner(lone))
    _, A = one_step(points, pose, np.eye(3), lone)
    np.testing.assert_allclose(A, J.T @ J, atol=1e-5)


@pytest.mark.parametrize("lone", [False, True])
@settings(max_examples=40)
@given(pose=poses)
def test_a_step_solves_the_normal_equations(pose: FloatArray, lone: bool) -> None:
    points = SE2.from_array(pose).inverse().transform(TARGETS)
    J, d, prior = jacobian(points, pose, corner(lone)), residuals(points, pose, corner(lone)), np.diag([1.0, 2.0, 3.0])
    moved, A = one_step(points, pose, prior, lone)
    np.testing.assert_allclose(moved - pose, -np.linalg.solve(A + prior, J.T @ d), atol=1e-6)


@pytest.mark.parametrize(("side", "information"), [(-1.0, 1.0), (1.0, 0.0)])
def test_a_wall_says_nothing_to_who_sees_its_other_face(side: float, information: float) -> None:
    nearest, surfaces, cell = corner()
    surfaces[0, 0, [NORMAL_X, FLATNESS]] = side, ONE_SIDED
    settings, noise = (1, WIDE, WIDE, 1e-9, 1.0, 1.0), (100.0, 1e-4)
    field, mean = (nearest, surfaces, cell), np.array([0.5, 0.5, 0.0])
    _, covariance, *_ = gauss_newton.match(np.array([[1.55, 0.05]]), mean, (mean, np.eye(3)), field, settings, noise)
    assert np.linalg.inv(covariance)[0, 0] - 1.0 == pytest.approx(information)


def test_a_start_pose_is_not_written() -> None:
    pose = np.array([0.1, 0.2, 0.3])
    one_step(TARGETS, pose, np.eye(3), lone=False)
    np.testing.assert_array_equal(pose, [0.1, 0.2, 0.3])


def test_without_points_the_prior_is_the_answer() -> None:
    mean, prior = np.array([0.1, 0.2, 0.3]), np.diag([1.0, 2.0, 3.0])
    settings = (10, 0.5, 0.1, 1e-4, 0.7, 0.2)
    pose, covariance, rms, share, *_ = gauss_newton.match(np.empty((0, 2)), np.zeros(3), (mean, prior), corner(), settings, (0.01, 10.0))
    np.testing.assert_allclose(pose, mean)
    np.testing.assert_allclose(covariance, prior)
    assert (rms, share) == (0.0, 0.0)


spd = st.integers(0, 2**32 - 1).map(lambda seed: np.random.default_rng(seed).normal(size=(3, 5))).map(lambda B: B @ B.T + 0.1 * np.eye(3))


@given(spd)
def test_the_inverse_is_numpys(A: FloatArray) -> None:
    np.testing.assert_allclose(gauss_newton.inverse(A), np.linalg.inv(A), rtol=1e-8, atol=1e-10)


def test_a_singular_matrix_has_no_inverse() -> None:
    assert np.isnan(gauss_newton.inverse(np.zeros((3, 3)))).all()
