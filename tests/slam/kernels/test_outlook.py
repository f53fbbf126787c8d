import numpy as np
import pytest

from slam.kernels import outlook


def test_a_wall_hides_what_lies_behind_it() -> None:
    opaque = np.zeros((21, 21), np.bool_)
    opaque[5:16, 10] = True
    seen = outlook.visible(opaque, np.array([[10, 5]]), 20.0)
    assert seen[10, 10]
    assert not seen[10, 11:].any()
    assert seen[0, 12]


def test_nothing_is_seen_beyond_the_reach() -> None:
    seen = outlook.visible(np.zeros((41, 41), np.bool_), np.array([[20, 20]]), 8.0)
    rows, cols = np.nonzero(seen)
    assert np.hypot(rows - 20, cols - 20).max() <= 8.8


def test_a_border_is_looked_at_from_where_what_lies_behind_it_is_seen() -> None:
    states = np.zeros((30, 40), np.int8)
    states[12, :20] = 100  # a wall, and behind its end the unknown
    states[13:25, :20] = -1
    lengths = np.hypot(*np.meshgrid(np.arange(30) - 5.0, np.arange(40) - 5.0, indexing="ij"))
    lengths[13:25, :20] = np.inf
    row, col = outlook.viewpoint(lengths, states, (18, 20), 15.0)
    assert np.isfinite(lengths[row, col])
    assert outlook.sees(states, row, col, (18, 17))


def test_there_is_no_viewpoint_where_nobody_can_go() -> None:
    states = np.zeros((20, 20), np.int8)
    states[:, 12:] = -1
    assert outlook.viewpoint(np.full((20, 20), np.inf), states, (10, 11), 8.0) == (-1, -1)


def test_the_gain_is_the_unknown_in_view() -> None:
    states = np.zeros((40, 40), np.int8)
    states[:, 30:] = -1
    gains = outlook.unknown_in_view(states, np.array([[20, 28], [20, 2]]), 10.0, 4.0, 360)
    assert gains[0] > 30
    assert gains[1] == 0


def test_nearest_is_the_least_distance() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(5, 2)), rng.normal(size=(9, 2))
    assert outlook.nearest(a, b) == pytest.approx(np.hypot(*(a[:, None] - b).transpose(2, 0, 1)).min())
    assert np.isinf(outlook.nearest(a, np.empty((0, 2))))
