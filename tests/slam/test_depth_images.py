import numpy as np
import pytest

from slam.depth_images import DepthLensError, aligned_depth
from slam.messages import CameraInfo, RgbdImage
from slam.se3 import SE3

WIDE = CameraInfo(
    120, 90, np.array([[80.0, 0.0, 59.5], [0.0, 80.0, 44.5], [0.0, 0.0, 1.0]]), np.zeros(5), 0.0, SE3(t=np.array([0.015, 0.0, 0.0]))
)
FINE = CameraInfo(160, 120, np.array([[150.0, 0.0, 79.5], [0.0, 150.0, 59.5], [0.0, 0.0, 1.0]]), np.zeros(5))


def image(depth, colour_info=FINE, depth_info=WIDE):
    return RgbdImage(0.0, np.zeros((120, 160, 3), np.uint8), depth, colour_info, depth_info)


def test_a_wall_across_stays_where_it_is():
    aligned = aligned_depth(image(np.full((90, 120), 2.0, np.float32)))
    assert aligned.shape == (120, 160)
    np.testing.assert_array_equal(aligned[5:-5, 5:-5], 2.0)


def test_a_point_moves_by_its_parallax():
    depth = np.full((90, 120), np.nan, np.float32)
    depth[44, 59] = 1.0
    aligned = aligned_depth(image(depth))
    columns = np.flatnonzero(np.isfinite(aligned).any(axis=0))
    x = (59 - 59.5) / 80.0 + 0.015
    assert columns.mean() == pytest.approx(x * 150.0 + 79.5, abs=0.6)


def test_the_nearer_one_hides_the_farther_one():
    depth = np.full((90, 120), 3.0, np.float32)
    depth[:, :60] = 0.5
    aligned = aligned_depth(image(depth))
    assert set(np.unique(aligned[60]).tolist()) == {0.5, 3.0}
    assert np.flatnonzero(aligned[60] == 0.5)[-1] == int(0.015 / 0.5 * 150.0 + 79.5)


def test_a_strip_that_only_the_colour_camera_sees_is_not_known():
    depth = np.full((90, 120), 3.0, np.float32)
    depth[:, 60:] = 0.5
    row = aligned_depth(image(depth))[60]
    farther, unknown, nearer = (np.flatnonzero(found) for found in (row == 3.0, np.isnan(row), row == 0.5))
    assert farther[-1] + 1 == unknown[0]
    assert unknown[-1] + 1 == nearer[0]
    assert len(unknown) == pytest.approx(0.015 * (1 / 0.5 - 1 / 3.0) * 150.0, abs=1.0)


def test_what_is_not_measured_is_not_known():
    assert np.isnan(aligned_depth(image(np.full((90, 120), np.nan, np.float32)))).all()


def test_a_depth_camera_with_distortion_is_refused():
    bent = CameraInfo(120, 90, WIDE.K, np.array([0.1, 0.0, 0.0, 0.0, 0.0]))
    with pytest.raises(DepthLensError, match="must be all 0"):
        aligned_depth(image(np.ones((90, 120), np.float32), depth_info=bent))
