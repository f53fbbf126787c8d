"""A depth image as a scan: checked against rooms whose depth is known in closed form."""

import math

import numpy as np
import pytest

from slam.depth_scans import DepthScan, scans_of
from slam.errors import ParameterError
from slam.messages import CameraInfo, LaserScan, RgbdImage, SensorFrame
from slam.se3 import SE3

K = np.array([[212.0, 0.0, 212.0], [0.0, 212.0, 120.0], [0.0, 0.0, 1.0]])
SIZE = 240, 424
OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def picture(pitch=0.0, yaw=0.0, wall=2.0, height=0.2):
    """A wall across x = `wall` in base from the floor to 1 m, and the floor; the camera sits 0.1 m before the axle."""
    T = SE3.from_xyz_rpy((0.1, 0.0, height), (0.0, pitch, yaw)) @ SE3(OPTICAL)
    v, u = np.mgrid[0 : SIZE[0], 0 : SIZE[1]]
    rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(SIZE)], axis=-1) @ T.R.T
    with np.errstate(divide="ignore"):
        to_wall, to_floor = (wall - T.t[0]) / rays[..., 0], -T.t[2] / rays[..., 2]
    top = T.t[2] + to_wall * rays[..., 2]
    depth = np.where((to_wall > 0.0) & (top >= 0.0) & (top <= 1.0), to_wall, np.where(to_floor > 0.0, to_floor, np.nan))
    info = CameraInfo(SIZE[1], SIZE[0], K, np.zeros(5), 0.0, T)
    return RgbdImage(1.5, np.zeros((*SIZE, 3), np.uint8), depth.astype(np.float32), info, info)


def points(scan):
    good = np.isfinite(scan.ranges)
    flat = np.column_stack([np.cos(scan.angles), np.sin(scan.angles), np.zeros(len(scan.angles))])[good] * scan.ranges[good, None]
    return flat @ scan.T_base_laser.R.T + scan.T_base_laser.t


@pytest.mark.parametrize(("pitch", "yaw"), [(0.0, 0.0), (0.15, 0.0), (-0.2, 0.0), (0.1, 0.4), (0.0, -0.3)])
def test_a_wall_is_where_it_is_however_the_camera_is_tilted(pitch, yaw):
    scan = DepthScan().scan(picture(pitch, yaw))
    found = points(scan)
    assert len(found) > 150
    np.testing.assert_allclose(found[:, 0], 2.0, atol=0.01)
    assert scan.stamp == 1.5


def test_the_floor_is_no_obstacle_and_what_is_above_the_band_is_none():
    assert not np.isfinite(DepthScan().scan(picture(wall=50.0)).ranges).any()
    assert not np.isfinite(DepthScan(low=1.1, high=1.5).scan(picture()).ranges).any()


def test_what_is_too_far_is_left_unknown():
    scan = DepthScan(range_max=1.5).scan(picture())
    assert np.isnan(scan.ranges).all()


def test_the_angles_grow_and_cover_the_view():
    scan = DepthScan().scan(picture())
    assert (np.diff(scan.angles) > 0.0).all()
    assert scan.angles[-1] == pytest.approx(math.atan(1.0), abs=0.01)


def test_the_lidar_goes_before_the_camera_unless_told_otherwise():
    lidar = LaserScan(1.0, [1.0], [0.0], 0.0, 0.0, 5.0)
    frame = SensorFrame(2.0, scans=(lidar,), images=(picture(),), available=frozenset({"scans", "images"}))
    assert scans_of(frame, "auto", DepthScan()) == (lidar,)
    assert len(scans_of(frame, "depth", DepthScan())[0].ranges) > 100
    alone = SensorFrame(2.0, images=(picture(),), available=frozenset({"images"}))
    assert len(scans_of(alone, "auto", DepthScan())) == 1
    assert scans_of(alone, "lidar", DepthScan()) == ()


def test_a_band_upside_down_is_refused():
    with pytest.raises(ParameterError, match="low"):
        DepthScan(low=0.5, high=0.1)
