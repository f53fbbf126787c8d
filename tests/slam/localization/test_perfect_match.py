import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slam.errors import ParameterError
from slam.grid import FREE, GridGeometry
from slam.hits_file import write_hits
from slam.kernels import table_error
from slam.localization.error_table import TableSettings
from slam.localization.known_map import KnownMap
from slam.localization.matching_optimisation import MatchingOptimisation
from slam.localization.perfect_match import PerfectMatch
from slam.localization.wall_segments import WallSegments
from slam.map_file import read_map, write_map
from slam.messages import LaserScan, SensorFrame, Status, WheelOdometry
from slam.se2 import SE2

ORIGINS = [SE2(-3.0, -3.0), SE2(-2.91, -3.07, 0.0), SE2(-1.0, -4.2, 0.6)]
GEOMETRY = GridGeometry(0.05, 160, 160, SE2(-4.0, -4.0))
TRUTH = SE2(0.2, -0.3, 0.4)
WIDE = np.diag([1.0, 1.0, 1.0])
ANGLES = np.linspace(-2.0, 2.0, 682)


def free_inside(grid, half_width, half_height):
    """Declare what is inside the room free."""
    rows, cols = np.indices(grid.log_odds.shape)
    centres = grid.geometry.to_points(np.column_stack([rows.ravel(), cols.ravel()]))
    inside = (abs(centres[:, 0]) < half_width) & (abs(centres[:, 1]) < half_height)
    empty = inside.reshape(grid.log_odds.shape) & (grid.hit_count == 0)
    grid.log_odds[empty] = -5.0
    return grid


@pytest.fixture(scope="module")
def known(room, make_grid):
    return KnownMap(free_inside(make_grid(room.samples(), GEOMETRY), 1.9, 1.4))


@pytest.fixture(scope="module")
def table(known):
    return TableSettings().of(known.grid)


def error(found, truth=TRUTH):
    off = truth.inverse() @ found.T_map_base
    return math.hypot(off.x, off.y), abs(off.yaw)


def matched(table, points, start, prior=WIDE):
    return MatchingOptimisation().match(table, points, start.as_array()[None], start, (prior, prior))


@pytest.mark.parametrize("T_map_grid", ORIGINS)
def test_segments_lie_on_the_walls_wherever_the_grid_begins(room, make_grid, T_map_grid):
    walls = WallSegments().of(make_grid(room.samples(), GridGeometry(0.05, 200, 200, T_map_grid @ SE2(-1.0, -1.0))))
    along = np.linspace(0.0, 1.0, 20)[:, None]
    points = np.concatenate([segment[:2] + along * (segment[2:] - segment[:2]) for segment in walls.segments])
    a, d = room.segments[:, :2], room.segments[:, 2:] - room.segments[:, :2]
    share = np.clip(((points[:, None] - a) * d).sum(-1) / (d * d).sum(-1), 0.0, 1.0)
    distances = np.linalg.norm(points[:, None] - a - share[..., None] * d, axis=2).min(axis=1)
    assert np.hypot(*(walls.segments[:, 2:] - walls.segments[:, :2]).T).sum() > 13.5  # of 16.1 m, the cupboard's sides are short
    assert np.sort(distances)[-8] < 0.006


def test_the_same_map_gives_the_same_segments(known):
    first = WallSegments().of(known.grid)
    for _ in range(5):
        np.testing.assert_array_equal(WallSegments().of(known.grid).segments, first.segments)


def test_the_free_side_of_a_segment_is_on_its_left(known):
    for x0, y0, x1, y1 in WallSegments().of(known.grid).segments:
        if abs(x0) < 1.9 and abs(x1) < 1.9 and abs(y0) < 1.4 and abs(y1) < 1.4:
            continue  # of the cupboard
        middle, left = np.array([x0 + x1, y0 + y1]) / 2.0, np.array([y0 - y1, x1 - x0])
        cell = known.grid.geometry.to_cells((middle + 0.15 * left / np.hypot(*left))[None])[0]
        assert known.grid.states()[tuple(cell)] == FREE


def test_what_bends_is_left_as_points(make_grid):
    angles = np.linspace(0.0, math.tau, 2000)
    pillar = 0.22 * np.column_stack([np.cos(angles), np.sin(angles)])
    walls = WallSegments().of(make_grid(pillar, GEOMETRY))
    assert len(walls.segments) == 0
    assert len(walls.points) > 15


def test_the_gradient_is_that_of_the_error(table):
    points = np.array([[1.0, 0.4], [0.3, -1.1], [-0.8, 0.9], [1.5, -0.2]])
    prior = (np.array([3.9, 4.1, 0.3]), np.diag([0.5, 0.7, 0.2]))
    patches, gradient, unused = (table.patches, table.cell), np.empty(3), np.empty(3)
    pose = np.array([4.0013, 4.0021, 0.2])
    table_error.error(points, 1, pose, patches, 0.25, prior, gradient)
    for k in range(3):
        h = 1e-6 * np.eye(3)[k]
        ahead = table_error.error(points, 1, pose + h, patches, 0.25, prior, unused)
        behind = table_error.error(points, 1, pose - h, patches, 0.25, prior, unused)
        assert gradient[k] == pytest.approx((ahead - behind) / 2e-6, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("offset", [0.0, 0.0125, 0.019, 0.031, 0.0375])
def test_the_table_is_zero_at_a_wall_wherever_it_lies_in_its_cells(make_walls, make_grid, offset):
    walls = make_walls([(-2, offset, 2, offset)])
    table = TableSettings().of(make_grid(walls.samples(), GEOMETRY))
    x = np.linspace(-1.8, 1.8, 50)
    points = np.column_stack([x, np.full(50, offset)])
    J, r, places = np.empty((50, 3)), np.empty(50), np.empty((50, 2))
    table_error.residuals(points, 1, table.T_map_table.inverse().as_array(), (table.patches, table.cell), (J, r, places))
    assert np.abs(r).max() < 1e-3


def test_starts_within_30_cm_and_17_deg_come_back(room, table):
    rng, points = np.random.default_rng(1), room.points(TRUTH)
    errors = np.array([error(matched(table, points, SE2.from_array(TRUTH.as_array() + rng.uniform(-0.3, 0.3, 3)))) for _ in range(100)])
    assert (errors[:, 0] < 0.01).mean() >= 0.99
    assert np.median(errors[:, 0]) < 0.003


def test_people_in_a_fifth_of_the_view_hardly_move_the_pose(room, table):
    ranges = room.ranges(TRUTH)
    ranges[300:440] = np.minimum(ranges[300:440], 0.8)
    angles = (np.arange(682) - 340) * math.tau / 1024
    points = ranges[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    assert error(matched(table, points, TRUTH @ SE2(0.05, -0.05, 0.05)))[0] < 0.01


def test_the_covariance_covers_the_errors_and_is_no_larger_than_needed(room, table):
    rng, normalised = np.random.default_rng(2), []
    for _ in range(150):
        found = matched(table, room.points(TRUTH, rng.normal(0.0, 0.01, 682)), TRUTH)
        off = found.T_map_base.as_array() - TRUTH.as_array()
        normalised.append(off @ np.linalg.solve(found.covariance, off) / 3.0)
    assert np.mean(normalised) < 1.5
    assert np.sqrt(found.covariance[0, 0]) < 0.02


def test_along_a_corridor_odometry_decides(make_walls, make_grid):
    walls = make_walls([(-3.9, 0.6, 3.9, 0.6), (3.9, -0.6, -3.9, -0.6)])
    table = TableSettings().of(make_grid(walls.samples(), GEOMETRY))
    prior = np.diag([0.01**2, 0.05**2, 0.05**2])
    points = walls.points(SE2(), angles=np.linspace(0.3, 2.8, 300))
    points = np.vstack([points, walls.points(SE2(), angles=-np.linspace(0.3, 2.8, 300))])
    found = matched(table, points, SE2(0.02, 0.04, 0.02), prior)
    assert found.T_map_base.x == pytest.approx(0.02, abs=1e-3)
    assert found.T_map_base.y == pytest.approx(0.0, abs=3e-3)
    assert found.covariance[0, 0] == pytest.approx(0.01**2, rel=0.05)
    assert found.covariance[1, 1] < 0.02**2


def test_the_table_is_kept_beside_the_map_and_made_anew_when_the_map_changes(known, tmp_path: Path):
    write_map(known.grid, tmp_path / "map")
    write_hits(known.grid, tmp_path / "map.hits.npz")
    on_disk = KnownMap(read_map(tmp_path / "map.yaml"), tmp_path / "map.yaml")
    kept = tmp_path / "map.walls.npz"
    first = TableSettings().kept(on_disk)
    written = kept.stat().st_mtime_ns
    again = TableSettings().kept(on_disk)
    np.testing.assert_array_equal(first.distances, again.distances)
    assert again.T_map_table == first.T_map_table
    assert kept.stat().st_mtime_ns == written
    on_disk.grid.hit_offset[:] += 0.01
    assert not np.array_equal(TableSettings().kept(on_disk).distances, first.distances)
    kept.write_bytes(b"not a table")
    assert TableSettings().kept(on_disk).distances.shape == first.distances.shape


def frames(room, poses, angles=ANGLES):
    """One frame with wheels and a scan for each pose (N, 3), a tenth of a second apart."""
    start = SE2.from_array(poses[0])
    for k, pose in enumerate(poses):
        T = SE2.from_array(pose)
        stamp = 0.1 * k
        scan = LaserScan(stamp, room.ranges(T, angles), angles, 0.0, 0.02, 6.0)
        yield SensorFrame(stamp, (WheelOdometry(stamp, start.inverse() @ T),), (), (scan,), frozenset({"odometry", "scans"}))


def way(count=30):
    return np.column_stack([np.linspace(-0.6, 0.6, count), np.full(count, -0.4), np.linspace(0.2, 1.0, count)])


def test_the_track_is_kept_from_a_start_that_is_a_little_wrong(room, known):
    pipeline = PerfectMatch().build(known, SE2(-0.55, -0.44, 0.25))
    for frame in frames(room, way()):
        estimate = pipeline.update(frame)
    assert estimate.status is Status.TRACKING
    assert error(estimate, SE2.from_array(way()[-1]))[0] < 0.005
    assert estimate.health > 0.95


def test_an_unknown_start_is_found(room, known):
    pipeline = PerfectMatch().build(known, None)
    for frame in frames(room, way()):
        estimate = pipeline.update(frame)
    assert estimate.status is Status.TRACKING
    assert error(estimate, SE2.from_array(way()[-1]))[0] < 0.02


def test_who_is_carried_away_without_seeing_is_found_again(room, known):
    pipeline = PerfectMatch().build(known, SE2.from_array(way()[0]))
    there = np.column_stack([np.linspace(-0.9, 0.3, 45), np.full(45, 0.9), np.linspace(-0.1, -1.2, 45)])
    poses = np.vstack([way(10), np.tile(there[0], (12, 1)), there])
    T_odom = [SE2.from_array(way(10)[0]).inverse() @ SE2.from_array(pose) for pose in way(10)]
    T_odom += [T_odom[-1] @ SE2.from_array(there[0]).inverse() @ SE2.from_array(pose) for pose in poses[10:]]
    statuses = []
    for k, (frame, T) in enumerate(zip(frames(room, poses), T_odom, strict=True)):
        scan = frame.scans[0] if not 10 <= k < 22 else replace(frame.scans[0], ranges=np.random.default_rng(k).uniform(0.2, 2.5, 682))
        last = pipeline.update(SensorFrame(frame.stamp, (WheelOdometry(frame.stamp, T),), (), (scan,), frame.available))
        statuses.append(last.status)
    assert {Status.LOST, Status.AMBIGUOUS} & set(statuses)
    assert last.status is Status.TRACKING
    assert error(last, SE2.from_array(there[-1]))[0] < 0.02


def test_a_start_in_a_wall_is_named_and_looked_for(room, known):
    estimate = PerfectMatch().build(known, SE2(-1.97, 0.0)).update(SensorFrame(0.0))
    assert estimate.status is Status.LOST
    assert "the pose lies in a wall" in estimate.reason


def test_without_scans_and_without_wheels_it_goes_on_and_says_so(room, known):
    pipeline = PerfectMatch().build(known, SE2.from_array(way()[0]))
    for frame in frames(room, way()):
        estimate = pipeline.update(SensorFrame(frame.stamp, (), (), frame.scans, frozenset({"scans"})))
    assert estimate.status is Status.DEGRADED
    assert "no wheel odometry" in estimate.reason
    assert error(estimate, SE2.from_array(way()[-1]))[0] < 0.03
    empty = LaserScan(3.1, np.full(682, np.inf), ANGLES, 0.0, 0.02, 6.0)
    assert "the scan shows nothing" in pipeline.update(SensorFrame(3.1, (), (), (empty,), frozenset({"scans"}))).reason


def test_the_same_frames_give_the_same_bits(room, known):
    ends = []
    for _ in range(2):
        pipeline = PerfectMatch().build(known, None)
        for frame in frames(room, way(12)):
            estimate = pipeline.update(frame)
        ends.append((*estimate.T_map_base.as_array(), *estimate.covariance.ravel()))
    assert ends[0] == ends[1]


@pytest.mark.parametrize("wrong", [{"steps": (0.1, 0.0, 0.1)}, {"shrink": 1.0}, {"grow": 0.9}, {"width": -1.0}])
def test_parameters_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        MatchingOptimisation(**wrong)
