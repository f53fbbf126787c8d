import math

import numpy as np

from slam.kernels.bins import connect, count_of, fill

SIZES = (0.5, math.tau / 36)


def test_poses_share_a_bin_when_they_share_its_square_and_its_angle():
    rng = np.random.default_rng(1)
    poses = np.column_stack([rng.uniform(-40.0, 40.0, (3000, 2)), rng.uniform(-math.pi, math.pi, 3000)])
    bins, places = fill(poses, SIZES)
    expected = np.floor(poses / [0.5, 0.5, SIZES[1]]).astype(int) % [10**6, 10**6, 36]
    _, numbers = np.unique(expected, axis=0, return_inverse=True)
    assert len(places) == len(np.unique(numbers))
    assert len(np.unique(np.column_stack([bins, numbers.ravel()]), axis=0)) == len(places)
    np.testing.assert_array_equal(places[bins] % [10**6, 10**6, 36], expected)


def test_headings_a_turn_apart_share_a_bin():
    poses = np.array([[1.0, 1.0, 0.1], [1.0, 1.0, 0.1 + math.tau], [1.0, 1.0, 0.1 - math.tau], [1.0, 1.0, 0.1 - 3 * math.tau]])
    assert len(fill(poses, SIZES)[1]) == 1


def test_bins_that_are_filled_are_counted_once():
    poses = np.array([[0.1, 0.1, 0.0], [0.2, 0.1, 0.0], [5.1, 0.1, 0.0], [9.1, 0.1, 0.0]])
    bins, places = fill(poses, SIZES)
    assert len(places) == 3
    assert count_of(bins, len(places), np.array([0, 1, 1, 2])) == 2


def test_bins_that_touch_have_one_label_also_across_half_a_turn_and_the_origin():
    places = fill(np.array([[-0.1, 0.1, 3.1], [0.1, -0.1, -3.1], [1.2, 0.1, 3.1]]), SIZES)[1]
    labels = connect(places, 36)
    assert labels[0] == labels[1]
    assert labels[2] != labels[0]
