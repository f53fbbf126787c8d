import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.messages import LaserScan, Trajectory
from slam.scans import Unveil, deskew
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

ANGLES = (np.arange(682) - 340) * math.tau / 1024
INCREMENT = 0.1 / 1024
NO_ODOMETRY = Trajectory(np.empty(0), np.empty((0, 3)))
WALL = 2.0
"""Distance of a wall across the x axis [m]."""


def moving(v: float, omega: float, start: float = 0.0, end: float = 0.1) -> Trajectory:
    """A constant twist, sampled every 20 ms."""
    stamps = np.arange(start, end + 0.01, 0.02)
    return Trajectory(stamps, np.array([SE2.exp(np.array([v, 0.0, omega]) * t).as_array() for t in stamps]))


def pose(t: float, v: float, omega: float) -> SE2:
    return SE2.exp(np.array([v, 0.0, omega]) * t)


def wall_scan(v: float, omega: float, T_base_laser: SE3) -> LaserScan:
    """What a moving robot measures of the wall x = WALL of odom."""
    ranges = []
    for i, angle in enumerate(ANGLES):
        T = SE3.from_se2(pose(i * INCREMENT, v, omega)) @ T_base_laser
        direction = T.R @ [math.cos(angle), math.sin(angle), 0.0]
        ranges.append((WALL - T.t[0]) / direction[0] if direction[0] > 0.2 else math.inf)
    return LaserScan(0.0, np.array(ranges), ANGLES, INCREMENT, 0.02, 5.6, T_base_laser)


def wall_heading(points: FloatArray) -> float:
    """Angle between the wall as fitted to the points and the y axis [rad]."""
    centred = points - points.mean(axis=0)
    direction = np.linalg.svd(centred)[2][0]
    return math.atan(direction[0] / direction[1])


MOUNTS = {
    "at the axle": SE3(),
    "ahead and above": SE3.from_xyz_rpy((0.1, 0.03, 0.2)),
    "turned": SE3.from_xyz_rpy((0.1, 0.0, 0.2), (0.0, 0.0, 0.5)),
    "upside down": SE3.from_xyz_rpy((0.1, 0.0, 0.2), (math.pi, 0.0, 0.0)),
}


def test_turning_at_one_radian_a_second_smears_a_sweep_by_four_degrees() -> None:
    scan = LaserScan(0.0, np.ones(682), ANGLES, INCREMENT, 0.02, 5.6)
    raw, straight = deskew(scan, NO_ODOMETRY).points, deskew(scan, moving(0.0, 1.0)).points
    bearing = np.unwrap(np.arctan2(straight[:, 1], straight[:, 0])) - np.unwrap(np.arctan2(raw[:, 1], raw[:, 0]))
    assert math.degrees(bearing[0]) == pytest.approx(0.0, abs=1e-9)
    assert math.degrees(bearing[-1]) == pytest.approx(3.81, abs=0.01)


def test_a_wall_seen_while_turning_is_bent_before_deskew() -> None:
    raw = deskew(wall_scan(0.0, 1.0, SE3()), NO_ODOMETRY).points
    assert abs(math.degrees(wall_heading(raw[:50]) - wall_heading(raw[-50:]))) > 1.5


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS)
@pytest.mark.parametrize(("v", "omega"), [(0.0, 1.0), (0.0, -1.0), (0.3, 0.0), (0.3, 1.5)])
def test_a_wall_is_straight_after_deskew(mount: SE3, v: float, omega: float) -> None:
    points = deskew(wall_scan(v, omega, mount), moving(v, omega)).points
    np.testing.assert_allclose(points[:, 0], WALL, atol=1e-3)
    assert abs(math.degrees(wall_heading(points))) < 0.2


def test_points_are_in_base_where_it_was_at_the_first_beam() -> None:
    scan = wall_scan(0.3, 0.5, SE3())
    later = Trajectory(moving(0.3, 0.5).stamps, [(SE2(7.0, -3.0, 2.0) @ SE2.from_array(p)).as_array() for p in moving(0.3, 0.5).poses])
    np.testing.assert_allclose(deskew(scan, later).points, deskew(scan, moving(0.3, 0.5)).points, atol=1e-3)


def test_without_odometry_a_scan_is_taken_as_it_is() -> None:
    scan = LaserScan(0.0, np.array([1.0, 2.0]), np.array([0.0, math.pi / 2]), 0.01, 0.02, 5.6)
    np.testing.assert_allclose(deskew(scan, NO_ODOMETRY).points, [[1.0, 0.0], [0.0, 2.0]], atol=1e-12)


def test_one_odometry_sample_is_held() -> None:
    scan = LaserScan(0.0, np.array([1.0]), np.array([0.0]), 0.01, 0.02, 5.6)
    np.testing.assert_allclose(deskew(scan, Trajectory([0.0], [[3.0, 4.0, 1.0]])).points, [[1.0, 0.0]], atol=1e-12)


def test_odometry_is_not_extrapolated_beyond_its_last_sample() -> None:
    scan = LaserScan(0.0, np.ones(3), np.zeros(3), 0.1, 0.02, 5.6)
    points = deskew(scan, Trajectory([0.0, 0.1], [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])).points
    np.testing.assert_allclose(points[:, 0], [1.0, 1.5, 1.5], atol=1e-12)


def test_a_heading_that_passes_the_half_turn_does_not_spin_back() -> None:
    scan = LaserScan(0.0, np.ones(3), np.zeros(3), 0.05, 0.02, 5.6)
    points = deskew(scan, Trajectory([0.0, 0.1], [[0.0, 0.0, math.pi - 0.1], [0.0, 0.0, -math.pi + 0.1]])).points
    np.testing.assert_allclose(np.arctan2(points[:, 1], points[:, 0]), [0.0, 0.1, 0.2], atol=1e-9)


def test_an_upside_down_lidar_sees_left_and_right_exchanged() -> None:
    mount = SE3.from_xyz_rpy((0.0, 0.0, 0.2), (math.pi, 0.0, 0.0))
    scan = LaserScan(0.0, np.array([1.0]), np.array([math.pi / 2]), 0.0, 0.02, 5.6, mount)
    np.testing.assert_allclose(deskew(scan, NO_ODOMETRY).points, [[0.0, -1.0]], atol=1e-12)


def test_rays_start_where_the_laser_was() -> None:
    mount = SE3.from_xyz_rpy((0.1, 0.0, 0.2))
    scan = LaserScan(0.0, np.ones(2), np.zeros(2), 0.1, 0.02, 5.6, mount)
    origins = deskew(scan, Trajectory([0.0, 0.1], [[0.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2]])).origins
    np.testing.assert_allclose(origins, [[0.1, 0.0], [0.0, 0.1]], atol=1e-12)


@pytest.mark.parametrize("bad", [math.inf, -math.inf, math.nan, 0.01, 5.7, -1.0, 0.0])
def test_an_invalid_beam_is_left_out(bad: float) -> None:
    scan = LaserScan(0.0, np.array([1.0, bad, 2.0]), np.zeros(3), 0.0, 0.02, 5.6)
    np.testing.assert_allclose(deskew(scan, NO_ODOMETRY).points, [[1.0, 0.0], [2.0, 0.0]])


def test_a_scan_without_beams_has_no_points() -> None:
    assert deskew(LaserScan(0.0, np.empty(0), np.empty(0), 0.0, 0.02, 5.6), NO_ODOMETRY).points.shape == (0, 2)


@settings(max_examples=30)
@given(st.floats(-0.3, 0.3), st.floats(-2.0, 2.0), st.integers(0, 681))
def test_every_beam_uses_the_pose_at_its_own_time(v: float, omega: float, beam: int) -> None:
    ranges = np.full(682, math.inf)
    ranges[beam] = 1.0
    point = deskew(LaserScan(0.0, ranges, ANGLES, INCREMENT, 0.02, 5.6), moving(v, omega)).points
    direction = np.array([[math.cos(ANGLES[beam]), math.sin(ANGLES[beam])]])
    np.testing.assert_allclose(point, pose(beam * INCREMENT, v, omega).transform(direction), atol=1e-4)


URG, SICK = (ANGLES, 5.6), (np.radians(np.arange(180) - 90.0), 50.0)


def sweep(walls: list[float], angles: FloatArray = ANGLES, range_max: float = 5.6) -> LaserScan:
    return LaserScan(0.0, np.array(walls), angles[: len(walls)], 0.0, 0.02, range_max)


def taken_out(scan: LaserScan) -> list[int]:
    return np.flatnonzero(np.isfinite(scan.ranges) & np.isnan(Unveil().clean(scan).ranges)).tolist()


@pytest.mark.parametrize("between", [[1.4], [2.2], [1.4, 2.2], [math.nan, 1.5], [1.5, math.nan]])
def test_points_between_two_surfaces_are_taken_out(between: list[float]) -> None:
    ranges = [1.0] * 5 + between + [3.0] * 5
    hanging = [5 + i for i, r in enumerate(between) if math.isfinite(r)]
    assert taken_out(sweep(ranges)) == hanging
    assert taken_out(sweep(ranges[::-1])) == [len(ranges) - 1 - i for i in hanging[::-1]]


def test_a_point_behind_an_edge_with_nothing_beyond_is_taken_out() -> None:
    assert taken_out(sweep([1.0] * 5 + [1.5] + [math.inf] * 5)) == [5]


@pytest.mark.parametrize("ranges", [[3.0] * 5 + [1.0] + [3.0] * 5, [1.0] * 5 + [3.0, 3.0] + [1.0] * 5, [1.0] * 5 + [3.0] * 5])
def test_posts_gaps_and_edges_stay(ranges: list[float]) -> None:
    assert taken_out(sweep(ranges)) == []


@pytest.mark.parametrize(("angles", "range_max"), [URG, SICK], ids=["urg", "sick"])
@pytest.mark.parametrize("distance", [0.3, 1.0, 3.0])
def test_of_a_wall_met_at_any_angle_at_most_one_point_goes(angles: FloatArray, range_max: float, distance: float) -> None:
    beside = (angles > 0.01) & (angles < 1.6)
    ranges = np.where(beside, distance / np.sin(np.where(beside, angles, 1.0)), math.inf)
    assert len(taken_out(sweep(ranges.tolist(), angles, range_max))) <= 1


def test_noise_takes_next_to_nothing_out() -> None:
    rng, taken = np.random.default_rng(0), 0
    for distance in (0.3, 1.0, 4.0):
        taken += sum(len(taken_out(sweep((distance + max(0.01, 0.01 * distance) * rng.normal(size=682)).tolist()))) for _ in range(20))
    assert taken < 0.001 * 60 * 682


def test_the_filter_can_be_switched_off() -> None:
    scan = sweep([1.0] * 5 + [1.4] + [3.0] * 5)
    assert Unveil(sigmas=0.0).clean(scan) is scan
