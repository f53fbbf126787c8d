import itertools

import numpy as np
import pytest

from sim.envs.tour_kernel import tour


def length(order, ways, lengths):
    return ways[order[0]] + lengths[order[:-1], order[1:]].sum()


@pytest.mark.parametrize("seed", range(5))
def test_a_tour_goes_everywhere_and_is_nearly_the_shortest(seed):
    points = np.random.default_rng(seed).uniform(0.0, 10.0, (7, 2))
    lengths, ways = np.linalg.norm(points[:, None] - points, axis=2), np.linalg.norm(points, axis=1)
    order = tour(ways, lengths)
    assert sorted(order) == list(range(7))
    shortest = min(length(np.array(other), ways, lengths) for other in itertools.permutations(range(7)))
    assert length(order, ways, lengths) < 1.15 * shortest


def test_a_tour_through_one_place_goes_there():
    assert tour(np.array([3.0]), np.zeros((1, 1))).tolist() == [0]
