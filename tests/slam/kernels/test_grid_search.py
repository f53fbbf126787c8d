from itertools import pairwise

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import csgraph

from slam.kernels import grid_search


def field(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    costs = rng.uniform(1.0, 4.0, (23, 31)).astype(np.float32)
    costs[rng.random(costs.shape) < 0.25] = np.inf
    costs[5, 7] = costs[20, 28] = 1.0
    return costs


def reference(costs: np.ndarray, start: int) -> np.ndarray:
    """What the ways cost, by SciPy's Dijkstra."""
    height, width = costs.shape
    rows, cols, lengths = [], [], []
    for row, col in np.argwhere(np.isfinite(costs)):
        for down, right in grid_search.STEPS:
            r, c = row + down, col + right
            if 0 <= r < height and 0 <= c < width and np.isfinite(costs[r, c]):
                rows.append(row * width + col)
                cols.append(r * width + c)
                lengths.append(0.5 * (costs[row, col] + costs[r, c]) * np.hypot(down, right))
    graph = sparse.csr_array((lengths, (rows, cols)), shape=(costs.size, costs.size))
    return csgraph.dijkstra(graph, indices=start).reshape(costs.shape)


@pytest.mark.parametrize("seed", range(3))
def test_all_ways_are_as_cheap_as_they_can_be(seed) -> None:
    costs, start = field(seed), 5 * 31 + 7
    np.testing.assert_allclose(grid_search.search(costs, start, -1)[0], reference(costs, start), rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_way_to_one_goal_is_as_cheap_as_among_all(seed) -> None:
    costs, start, goal = field(seed), 5 * 31 + 7, 20 * 31 + 28
    one, before = grid_search.search(costs, start, goal)
    np.testing.assert_allclose(one.flat[goal], grid_search.search(costs, start, -1)[0].flat[goal], rtol=1e-9)
    if np.isfinite(one.flat[goal]):
        way = grid_search.way_to(before, goal)
        assert way[0] == start
        assert way[-1] == goal
        assert np.abs(np.diff(np.column_stack(np.divmod(way, 31)), axis=0)).max() == 1


@pytest.mark.parametrize("seed", range(3))
def test_a_straightened_way_costs_no_more(seed) -> None:
    costs = np.where(np.isfinite(field(seed)), field(seed), 4.0).astype(np.float32)
    lengths, before = grid_search.search(costs, 5 * 31 + 7, -1)
    corners = grid_search.straighten(costs, lengths, grid_search.way_to(before, 20 * 31 + 28), 50)
    cost = sum(grid_search.straight_cost(costs, a, b) for a, b in pairwise(corners))
    assert cost <= lengths[20, 28] * 1.25  # a single step is measured at its two cells, a stretch at every half
    assert corners[0] == 5 * 31 + 7
    assert corners[-1] == 20 * 31 + 28
