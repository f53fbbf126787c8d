import numpy as np
import pytest

from slam.kernels.sandwich import UNBOUNDED, Residuals, blocks_of, narrow, settle, usable
from slam.se2 import FloatArray

LOOSE = (np.zeros(3), np.diag([1e3, 1e3, 1e3]))


def scene(rng: np.random.Generator, shared: float, own: float, beams: int = 5) -> Residuals:
    """Two hundred stretches of wall of any direction, each of some beams and 10 m from the next; noise of stretches and of beams."""
    n = 200 * beams
    angle = np.repeat(rng.uniform(-np.pi, np.pi, 200), beams)
    places = np.repeat(np.arange(200.0), beams)[:, None] * [10.0, 0.0] + rng.uniform(0.0, 0.04, (n, 2))
    J = np.column_stack([np.cos(angle), np.sin(angle), np.repeat(rng.normal(size=200), beams)])
    return J, np.repeat(rng.normal(0.0, shared, 200), beams) + rng.normal(0.0, own, n), np.ones(n), places, n


def solved(residuals: Residuals) -> tuple[FloatArray, FloatArray, Residuals]:
    """The least-squares answer about zero, H, and the residuals there."""
    J, r, w, places, n = residuals
    H = J.T @ J
    x = -np.linalg.solve(H, J.T @ r)
    return x, H, (J, r + J @ x, w, places, n)


@pytest.mark.parametrize(("shared", "own"), [(0.0, 0.01), (0.01, 0.0), (0.01, 0.01)])
def test_the_covariance_is_that_of_many_answers_whatever_neighbours_share(shared: float, own: float) -> None:
    rng, squares = np.random.default_rng(4), []
    for _ in range(300):
        x, H, there = solved(scene(rng, shared, own))
        _, covariance = settle(blocks_of(there), H, (x, LOOSE[1]), UNBOUNDED, 0.0)
        squares.append(x @ np.linalg.solve(covariance, x))
    assert np.mean(squares) == pytest.approx(3.0, rel=0.15)


def test_an_answer_at_rest_stays_without_a_prior() -> None:
    x, H, there = solved(scene(np.random.default_rng(1), 0.01, 0.01))
    step, _ = settle(blocks_of(there), H, (x, LOOSE[1]), UNBOUNDED, 0.0)
    assert np.abs(step).max() < 1e-6


def test_where_the_slope_is_nothing_the_prior_decides() -> None:
    x, H, there = solved(scene(np.random.default_rng(1), 0.01, 0.01))
    slope, away, prior = H.copy(), x + np.array([0.3, 0.0, 0.0]), np.diag([0.01, 0.01, 0.01])
    slope[0, :] = slope[:, 0] = 0.0
    step, covariance = settle(blocks_of(there), slope, (away, prior), UNBOUNDED, 0.0)
    assert (away + step)[0] == pytest.approx(0.0, abs=1e-6)
    assert covariance[0, 0] == pytest.approx(prior[0, 0], rel=1e-6)
    assert covariance[1, 1] < 1e-4


def test_a_slope_that_may_be_chance_claims_no_more_than_the_geometry_can_tell() -> None:
    x, _H, there = solved(scene(np.random.default_rng(1), 0.01, 0.01))
    chance = np.diag([30.0, 800.0, 800.0])
    _, free = settle(blocks_of(there), chance, (x, LOOSE[1]), UNBOUNDED, 0.0)
    _, bound = settle(blocks_of(there), chance, (x, LOOSE[1]), np.diag([100.0, 1e9, 1e9]), 0.0)
    assert free[0, 0] < 0.001
    assert bound[0, 0] == pytest.approx(0.01, rel=0.05)
    assert bound[1, 1] == pytest.approx(free[1, 1], rel=0.05)


def test_a_corridor_is_narrow_and_a_room_is_not() -> None:
    n = 40
    walls = (np.tile([0.02, 1.0, 0.0], (n, 1)), np.zeros(n), np.ones(n), np.column_stack([np.arange(n), np.zeros(n)]), n)
    assert narrow(blocks_of(walls))
    walls[0][::2] = [1.0, 0.0, 0.0]
    assert not narrow(blocks_of(walls))


def test_no_residuals_leave_the_prior() -> None:
    nothing = (np.empty((0, 3)), np.empty(0), np.empty(0), np.empty((0, 2)), 0)
    prior = np.diag([0.1, 0.2, 0.3])
    step, covariance = settle(blocks_of(nothing), np.zeros((3, 3)), (np.zeros(3), prior), np.zeros((3, 3)), 0.01)
    np.testing.assert_allclose(step, 0.0)
    np.testing.assert_allclose(covariance, prior)


def test_a_slope_keeps_what_is_positive() -> None:
    kept = usable(np.array([[2.0, 0.2, 0.0], [-0.2, 3.0, 0.0], [0.0, 0.0, -5.0]]), 2.0)
    np.testing.assert_allclose(kept, np.diag([2.0, 3.0, 0.0]), atol=1e-12)
