import math

import numpy as np
import pytest

from slam.kernels import branch_and_bound as kernels
from slam.kernels import score_tables
from slam.kernels.lattice import Lattice
from slam.kernels.merging import merge
from slam.matching.score_pyramid import ScorePyramid
from slam.se2 import FloatArray

NO_OTHER = 1.0


def scene(seed: int) -> tuple[ScorePyramid, FloatArray]:
    """A scan of random walls seen from the origin, its tables, and the points of another one [cells]."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-2.0, 2.0, (5, 2, 2))
    points = np.concatenate([a + np.linspace(0.0, 1.0, 60)[:, None] * (b - a) for a, b in corners])
    pyramid = ScorePyramid.of_scan(points, np.zeros_like(points))
    return pyramid, (points[rng.random(len(points)) < 0.7] + rng.normal(0.0, 0.03, 2)) / pyramid.resolution


def exhaustive(pyramid: ScorePyramid, points: FloatArray, lattice: Lattice) -> FloatArray:
    """Ratings of every pose of the lattice: headings, rows, columns."""
    centre, step, reach, turns, cost, cost_turn = lattice
    scores = pyramid.tables[0]
    shifts = np.arange(-reach, reach + 1)
    rated = np.empty((2 * turns + 1, len(shifts), len(shifts)))
    for i, yaw in enumerate(centre[2] + (np.arange(2 * turns + 1) - turns) * step):
        c, s = math.cos(yaw), math.sin(yaw)
        cols = np.floor(centre[0] + c * points[:, 0] - s * points[:, 1]).astype(int)[:, None, None] + shifts
        rows = np.floor(centre[1] + s * points[:, 0] + c * points[:, 1]).astype(int)[:, None, None] + shifts[:, None]
        inside = (rows >= 0) & (rows < scores.shape[0]) & (cols >= 0) & (cols < scores.shape[1])
        values = scores[rows.clip(0, scores.shape[0] - 1), cols.clip(0, scores.shape[1] - 1)]
        total = np.where(inside, values, pyramid.outside).sum(axis=0)
        rated[i] = total - cost * (shifts**2 + shifts[:, None] ** 2) - cost_turn * (i - turns) ** 2
    return rated


def lattice_of(pyramid: ScorePyramid, reach: int, turns: int, cost: float = 0.0) -> Lattice:
    middle = pyramid.T_map_grid.inverse()
    centre = np.array([middle.x / pyramid.resolution + 3.4, middle.y / pyramid.resolution - 5.3, middle.yaw + 0.2])
    return centre, math.radians(1.0), reach, turns, cost, cost


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(("levels", "reach", "turns", "cost"), [(0, 3, 2, 0.0), (2, 9, 6, 0.5), (4, 20, 15, 0.0), (5, 37, 10, 0.2)])
def test_the_best_rating_is_that_of_exhaustive_search(seed: int, levels: int, reach: int, turns: int, cost: float) -> None:
    pyramid, points = scene(seed)
    lattice = lattice_of(pyramid, reach, turns, cost)
    best, _, _ = kernels.find((pyramid.tables[: levels + 1], pyramid.outside), points, lattice, 0.0, (0.0, 0.0, NO_OTHER, 0, 0))
    rated = exhaustive(pyramid, points, lattice)
    assert best[0] == pytest.approx(rated.max(), abs=1e-6)
    assert rated[best[1], best[2] + reach, best[3] + reach] == pytest.approx(best[0], abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_the_rival_is_the_best_pose_of_another_mode(seed: int) -> None:
    pyramid, points = scene(seed)
    reach, turns, headings, cells = 20, 15, 6, 8
    lattice = lattice_of(pyramid, reach, turns)
    best, rival, _ = kernels.find((pyramid.tables, pyramid.outside), points, lattice, 0.0, (0.0, 0.0, 0.01, headings, cells))
    turn, row, col = np.meshgrid(np.arange(2 * turns + 1), *[np.arange(-reach, reach + 1)] * 2, indexing="ij")
    near = (abs(turn - best[1]) < headings) & ((row - best[2]) ** 2 + (col - best[3]) ** 2 < cells**2)
    assert rival[0] == pytest.approx(np.where(near, -1.0, exhaustive(pyramid, points, lattice)).max(), abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_the_moments_are_those_of_all_likely_poses(seed: int) -> None:
    pyramid, points = scene(seed)
    lattice, scale = lattice_of(pyramid, 12, 10), 500.0
    _, _, moments = kernels.find((pyramid.tables[:4], pyramid.outside), points, lattice, 0.0, (0.0, scale, NO_OTHER, 0, 0))
    rated = exhaustive(pyramid, points, lattice)
    weights = np.exp((rated - rated.max()) / scale)
    x = np.average(np.broadcast_to(np.arange(-12, 13), rated.shape), weights=weights)
    assert moments[1] / moments[0] == pytest.approx(x, abs=0.15)


def test_nothing_is_found_below_the_least_rating() -> None:
    pyramid, points = scene(0)
    limits = (255.0 * len(points) + 1.0, 0.0, NO_OTHER, 0, 0)
    best, rival, _ = kernels.find((pyramid.tables, pyramid.outside), points, lattice_of(pyramid, 20, 10), 0.0, limits)
    assert best[1] == rival[1] == -1


def test_merged_points_lie_within_the_radius_of_what_stands_for_them() -> None:
    rng = np.random.default_rng(1)
    points = np.cumsum(rng.normal(0.0, 0.5, (300, 2)), axis=0)
    merged, counts = merge(points, np.ones(300, np.int64), 2.0)
    owner = np.repeat(merged, counts, axis=0)
    assert np.hypot(*(points - owner).T).max() <= 2.0 + 1e-9
    assert len(merged) < 150


def test_pooling_is_the_maximum_over_a_block() -> None:
    rng = np.random.default_rng(2)
    scores = rng.integers(0, 255, (20, 30)).astype(np.uint8)
    pooled = np.empty_like(scores)
    score_tables.pool(scores, pooled, 3, 100)
    padded = np.pad(scores, ((0, 3), (0, 3)), constant_values=100)
    expected = np.max([padded[:20, :30], padded[3:, :30], padded[:20, 3:], padded[3:, 3:]], axis=0)
    np.testing.assert_array_equal(pooled, expected)


def test_rays_clear_what_they_cross_and_nothing_beyond_their_end() -> None:
    free = np.zeros((5, 12), np.bool_)
    score_tables.clear_rays(free, np.array([[0.5, 2.5]]), np.array([[9.5, 2.5]]))
    assert np.flatnonzero(free[2]).tolist() == list(range(10))
    assert free.sum() == 10
