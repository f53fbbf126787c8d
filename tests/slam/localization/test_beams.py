import numpy as np

from slam.localization.beams import apart, evenly, one_opinion_each
from slam.scans import PointScan


def test_chosen_beams_are_spread_evenly_over_all():
    points = np.column_stack([np.arange(600.0), np.zeros(600)])
    chosen = evenly(PointScan(0.0, points, points), 60).points[:, 0]
    assert len(chosen) == 60
    assert set(np.diff(chosen)) == {10.0}
    assert chosen[0] == 599.0 - chosen[-1] + 1.0 or abs(chosen[0] - (599.0 - chosen[-1])) <= 1.0


def test_fewer_beams_than_asked_for_are_all_taken():
    cloud = PointScan(0.0, np.zeros((7, 2)), np.zeros((7, 2)))
    assert evenly(cloud, 60) is cloud
    assert evenly(cloud, 0) is cloud


def test_what_touches_the_robot_is_left_out():
    points, origins = np.array([[0.12, 0.0], [0.3, 0.0], [0.0, 0.2]]), np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]])
    assert apart(PointScan(0.0, points, origins)).points.tolist() == [[0.3, 0.0]]
    cloud = PointScan(0.0, points[1:2], origins[1:2])
    assert apart(cloud) is cloud


def test_beams_on_one_piece_of_wall_have_one_opinion_together():
    points = np.array([[1.01, 0.01], [1.02, 0.05], [1.15, 0.19], [3.0, 0.1], [-3.0, 0.1]])
    np.testing.assert_allclose(one_opinion_each(points, 0.2), [1 / 3, 1 / 3, 1 / 3, 1.0, 1.0])


def test_without_patches_every_beam_counts_as_one():
    assert one_opinion_each(np.zeros((3, 2)), 0.0).tolist() == [1.0, 1.0, 1.0]
