"""What every pipeline keeps to, run over the registry."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from slam.errors import UnknownNameError
from slam.grid import LOG_ODDS_LIMIT, GridGeometry
from slam.localization.known_map import KnownMap
from slam.messages import Estimate, Imu, LaserScan, SensorFrame, Status, WheelOdometry
from slam.pipelines import LOCALIZERS, PIPELINES, Pipeline, pipeline_settings, warm_up
from slam.se2 import SE2
from slam.se3 import SE3
from slam.snapshot import Snapshot

START = SE2(-0.8, -0.7, 0.4)
"""Where the robot really starts in the room; its odometry calls that ODOM_START."""
ODOM_START = SE2(3.0, 1.0, -2.0)
TWIST = np.array([0.25, 0.0, 0.35])
ALL = frozenset({"odometry", "imu", "scans"})
ANGLES = np.linspace(-2.0, 2.0, 341)
MOUNT = SE3.from_xyz_rpy((0.03, 0.0, 0.18))

Frames = tuple[SensorFrame, ...]


def truth(t: float) -> SE2:
    return START @ SE2.exp(TWIST * t)


def odometry(t: float) -> WheelOdometry:
    """Wheels that are 3 % too proud of the way and 5 % of the turn."""
    return WheelOdometry(t, ODOM_START @ SE2.exp(TWIST * [1.03, 1.0, 1.05] * t))


def scan(room: Any, t: float, rng: np.random.Generator) -> LaserScan:
    ranges = room.ranges(truth(t) @ MOUNT.to_se2(), ANGLES) + rng.normal(0.0, 0.005, len(ANGLES))
    return LaserScan(t, ranges, ANGLES, 0.0, 0.02, 5.6, MOUNT)


@pytest.fixture(scope="module")
def frames(room: Any) -> Frames:
    """Four seconds of a drive through the room, a frame every 100 ms; the gyro is off by 0.01 rad/s."""
    rng = np.random.default_rng(4)
    made: list[SensorFrame] = []
    for k in range(41):
        times = [0.1 * k + 0.02 * (i - 4) for i in range(5)] if k else [0.0]
        imu = tuple(Imu(t, TWIST[2] + 0.01) for t in times)
        made.append(SensorFrame(0.1 * k, tuple(map(odometry, times)), imu, (scan(room, 0.1 * k, rng),), ALL))
    return tuple(made)


def without(sensor: str, frames: Frames) -> Frames:
    """The body lacks the sensor."""
    return tuple(dataclasses.replace(frame, **{sensor: ()}, available=ALL - {sensor}) for frame in frames)


def silent(sensor: str, frames: Frames, since: float = -1.0) -> Frames:
    """The sensor is there and says nothing from a time on."""
    return tuple(frame if frame.stamp < since else dataclasses.replace(frame, **{sensor: ()}) for frame in frames)


def with_ranges(value: float, frames: Frames) -> Frames:
    spoilt = [tuple(dataclasses.replace(scan, ranges=np.full(len(ANGLES), value)) for scan in frame.scans) for frame in frames]
    return tuple(dataclasses.replace(frame, scans=scans) for frame, scans in zip(frames, spoilt, strict=True))


def without_beams(frames: Frames) -> Frames:
    nothing = [tuple(dataclasses.replace(scan, ranges=[], angles=[]) for scan in frame.scans) for frame in frames]
    return tuple(dataclasses.replace(frame, scans=scans) for frame, scans in zip(frames, nothing, strict=True))


def repeated(frames: Frames) -> Frames:
    """Every reading twice, as a stuttering link delivers them."""
    return tuple(dataclasses.replace(f, odometry=2 * f.odometry, imu=2 * f.imu, scans=2 * f.scans) for f in frames)


def hollow(frames: Frames) -> Frames:
    """Two of three frames are empty; their readings come with the third."""
    made: list[SensorFrame] = []
    for k, frame in enumerate(frames):
        held = frames[max(k - 2, 0) : k + 1] if k % 3 == 0 else ()
        fields = {name: tuple(reading for f in held for reading in getattr(f, name)) for name in ("odometry", "imu", "scans")}
        made.append(dataclasses.replace(frame, **fields))
    return tuple(made)


DAMAGE: dict[str, Callable[[Frames], Frames]] = {
    "none": lambda frames: frames,
    "no odometry": lambda frames: without("odometry", frames),
    "no gyro": lambda frames: without("imu", frames),
    "no lidar": lambda frames: without("scans", frames),
    "only lidar": lambda frames: without("odometry", without("imu", frames)),
    "odometry falls silent": lambda frames: silent("odometry", frames, 1.0),
    "gyro falls silent": lambda frames: silent("imu", frames, 1.0),
    "lidar falls silent": lambda frames: silent("scans", frames, 1.0),
    "odometry is silent": lambda frames: silent("odometry", frames),
    "gyro is silent": lambda frames: silent("imu", frames),
    "lidar is silent": lambda frames: silent("scans", frames),
    "odometry comes late": lambda frames: (*silent("odometry", frames[:15]), *frames[15:]),
    "lidar comes late": lambda frames: (*silent("scans", frames[:15]), *frames[15:]),
    "all silent": lambda frames: silent("odometry", silent("imu", silent("scans", frames))),
    "nothing in range": lambda frames: with_ranges(math.inf, frames),
    "too near": lambda frames: with_ranges(-math.inf, frames),
    "invalid beams": lambda frames: with_ranges(math.nan, frames),
    "blind for a while": lambda frames: (*frames[:10], *with_ranges(math.inf, frames[10:25]), *frames[25:]),
    "scans without beams": without_beams,
    "repeated readings": repeated,
    "empty frames": hollow,
    "old frames again": lambda frames: (*frames[:20], *frames[10:]),
}


KNOWN: list[KnownMap] = []
"""The map of the room, for those that need one."""


@pytest.fixture(scope="module", autouse=True)
def known_map(room: Any, make_grid: Any) -> KnownMap:
    geometry = GridGeometry(0.05, 100, 80, SE2(-2.5, -2.0))
    grid = make_grid(room.samples(), geometry)
    rows, cols = np.mgrid[0:80, 0:100]
    x, y = geometry.to_points(np.column_stack([rows.ravel(), cols.ravel()])).T.reshape(2, 80, 100)
    inside = (x > -1.97) & (x < 2.03) & (y > -1.46) & (y < 1.54) & ~((x > 0.81) & (x < 1.37) & (y > 0.62) & (y < 1.12))
    grid.log_odds[inside & (grid.log_odds == 0.0)] = -LOG_ODDS_LIMIT
    KNOWN[:] = [KnownMap(grid.frozen_copy())]
    return KNOWN[0]


def build(name: str, T_map_base: SE2 | None = START) -> Pipeline:
    return LOCALIZERS[name]().build(KNOWN[0], T_map_base) if name in LOCALIZERS else pipeline_settings(name)().build(T_map_base)


def run(name: str, frames: Frames, T_map_base: SE2 | None = START) -> tuple[list[Estimate], Pipeline]:
    pipeline = build(name, T_map_base)
    return [pipeline.update(frame) for frame in frames], pipeline


class Drive:
    """The drive through the room with all its damages: what each pipeline says of each, asked once."""

    def __init__(self, frames: Frames) -> None:
        self.frames = {damage: spoil(frames) for damage, spoil in DAMAGE.items()}
        self._told: dict[tuple[str, str], tuple[tuple[Estimate, ...], Snapshot]] = {}

    def told(self, name: str, damage: str = "none") -> tuple[tuple[Estimate, ...], Snapshot]:
        if (name, damage) not in self._told:
            estimates, pipeline = run(name, self.frames[damage])
            self._told[name, damage] = tuple(estimates), pipeline.snapshot()
        return self._told[name, damage]

    def estimates(self, name: str, damage: str = "none") -> tuple[Estimate, ...]:
        return self.told(name, damage)[0]


@pytest.fixture(scope="module")
def drive(frames: Frames) -> Drive:
    return Drive(frames)


def assert_sane(estimate: Estimate, frame: SensorFrame) -> None:
    assert estimate.stamp == frame.stamp
    assert np.isfinite(estimate.T_map_base.as_array()).all()
    assert np.isfinite(estimate.T_map_odom.as_array()).all()
    np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(estimate.covariance).min() > -1e-12
    assert 0.0 <= estimate.health <= 1.0
    assert (estimate.status == Status.TRACKING) == (estimate.reason == "")


@pytest.fixture(params=sorted([*PIPELINES, *LOCALIZERS]))
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(params=sorted(PIPELINES))
def mapper(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.mark.parametrize("damage", DAMAGE)
def test_whatever_the_sensors_say_the_answer_is_sane(name: str, drive: Drive, damage: str) -> None:
    for frame, estimate in zip(drive.frames[damage], drive.estimates(name, damage), strict=True):
        assert_sane(estimate, frame)


def test_with_all_sensors_the_pose_is_tracked(name: str, frames: Frames, drive: Drive) -> None:
    estimates = drive.estimates(name)
    off = truth(frames[-1].stamp).inverse() @ estimates[-1].T_map_base
    assert math.hypot(off.x, off.y) < 0.08
    assert abs(off.yaw) < 0.08
    assert {estimate.status for estimate in estimates} == {Status.TRACKING}


def test_the_covariance_of_a_matched_pose_covers_its_error(frames: Frames) -> None:
    estimate = run("lidar", frames)[0][-1]
    T = truth(frames[-1].stamp)
    error = np.array([estimate.T_map_base.x - T.x, estimate.T_map_base.y - T.y, (T.inverse() @ estimate.T_map_base).yaw])
    assert error @ np.linalg.solve(estimate.covariance, error) < 16.0


def test_the_start_is_where_it_is_said_to_be(mapper: str, frames: Frames) -> None:
    first = run(mapper, frames[:1], SE2(7.0, -2.0, 1.0))[0][0]
    off = SE2(7.0, -2.0, 1.0).inverse() @ first.T_map_base
    np.testing.assert_allclose(off.as_array(), 0.0, atol=1e-9)


def test_unless_told_otherwise_the_robot_starts_at_the_origin(mapper: str, frames: Frames) -> None:
    np.testing.assert_allclose(run(mapper, frames[:1], None)[0][0].T_map_base.as_array(), 0.0, atol=1e-9)


@pytest.mark.parametrize("damage", ["none", "no gyro", "gyro falls silent", "lidar falls silent", "empty frames"])
def test_odometry_is_carried_into_the_map_by_one_transform(name: str, drive: Drive, damage: str) -> None:
    T_odom_base = SE2()
    for frame, estimate in zip(drive.frames[damage], drive.estimates(name, damage), strict=True):
        T_odom_base = frame.odometry[-1].T_odom_base if frame.odometry else T_odom_base
        off = estimate.T_map_base.inverse() @ estimate.T_map_odom @ T_odom_base
        np.testing.assert_allclose(off.as_array(), 0.0, atol=1e-9)


@pytest.mark.parametrize("named", ["odometry", "gyro", "lidar"])
@pytest.mark.parametrize("falls", ["falls", "is"])
def test_a_silent_sensor_degrades_the_estimate_and_is_named(name: str, drive: Drive, named: str, falls: str) -> None:
    last = drive.estimates(name, f"{named} {falls} silent")[-1]
    assert last.status == Status.DEGRADED
    assert named in last.reason


@pytest.mark.parametrize("sensor", ["odometry", "imu"])
def test_a_silent_sensor_is_stood_in_for(frames: Frames, sensor: str) -> None:
    last = run("lidar", silent(sensor, frames, 1.0))[0][-1]
    off = truth(frames[-1].stamp).inverse() @ last.T_map_base
    assert math.hypot(off.x, off.y) < 0.05


def test_odometry_that_comes_late_does_not_make_the_pose_jump(name: str, drive: Drive) -> None:
    poses = [estimate.T_map_base for estimate in drive.estimates(name, "odometry comes late")]
    steps = [before.inverse() @ after for before, after in pairwise(poses)]
    assert max(math.hypot(step.x, step.y) for step in steps) < 0.15


def test_scans_that_cannot_be_matched_degrade_the_lidar_pipeline(frames: Frames) -> None:
    estimates, _ = run("lidar", DAMAGE["blind for a while"](frames))
    assert {estimate.status for estimate in estimates[11:25]} <= {Status.DEGRADED, Status.LOST}
    assert estimates[-1].status == Status.TRACKING


@pytest.mark.parametrize("since", [0.0, 1.0])
def test_odometry_that_stands_still_on_a_robot_that_does_not_is_overruled(frames: Frames, since: float) -> None:
    """Without a gyro: nothing but the scans says that the robot moves."""
    stuck = [tuple(WheelOdometry(o.stamp, odometry(min(o.stamp, since)).T_odom_base) for o in frame.odometry) for frame in frames]
    damaged = without("imu", tuple(dataclasses.replace(frame, odometry=o) for frame, o in zip(frames, stuck, strict=True)))
    off = truth(frames[-1].stamp).inverse() @ run("lidar", damaged)[0][-1].T_map_base
    assert math.hypot(off.x, off.y) < 0.05
    assert abs(off.yaw) < 0.05


@pytest.mark.parametrize("name", ["lidar", "odometry"])
def test_a_map_that_would_be_too_large_stays_as_it_was(name: str, frames: Frames) -> None:
    far = tuple(
        dataclasses.replace(scan, ranges=np.where(np.arange(341) < 9, 9e4, scan.ranges), range_max=1e5) for scan in frames[10].scans
    )
    estimates, pipeline = run(name, (*frames[:10], dataclasses.replace(frames[10], scans=far)))
    assert estimates[-1].status == Status.DEGRADED
    assert estimates[-1].reason == "the map would be too large"
    assert pipeline.snapshot().map.geometry == run(name, frames[:10])[1].snapshot().map.geometry
    assert pipeline.update(frames[11]).status == Status.TRACKING


def test_without_odometry_the_gyro_turns_the_guess_and_straightens_the_sweep(room: Any) -> None:
    """A robot that turns at once and quickly: constant velocity has nothing to go by."""
    rng, made = np.random.default_rng(5), list[SensorFrame]()
    turned = [START @ SE2(0.0, 0.0, 1.5 * max(t - 1.0, 0.0)) for t in 0.1 * np.arange(25)]
    for k, pose in enumerate(turned):
        beams = [(pose @ SE2(0.0, 0.0, (1.5 if k >= 10 else 0.0) * 2e-4 * i) @ MOUNT.to_se2(), ANGLES[i]) for i in range(341)]
        ranges = np.array([room.ranges(T, np.array([angle]))[0] for T, angle in beams]) + rng.normal(0.0, 0.005, 341)
        swept = LaserScan(0.1 * k, ranges, ANGLES, 2e-4, 0.02, 5.6, MOUNT)
        imu = tuple(Imu(0.1 * k + 0.02 * i, 1.5 if k >= 10 else 0.0) for i in range(5))
        made.append(SensorFrame(0.1 * k + 0.08, (), imu, (swept,), ALL - {"odometry"}))
    trajectory = run("lidar", tuple(made))[1].snapshot().trajectory
    offs = [pose.inverse() @ SE2.from_array(found) for pose, found in zip(turned, trajectory.poses, strict=True)]
    assert max(abs(off.yaw) for off in offs) < 0.01
    assert max(math.hypot(off.x, off.y) for off in offs) < 0.02


def test_without_odometry_the_lidar_carries_on_alone(frames: Frames) -> None:
    last = run("lidar", DAMAGE["only lidar"](frames))[0][-1]
    off = truth(frames[-1].stamp).inverse() @ last.T_map_base
    assert math.hypot(off.x, off.y) < 0.05


def test_the_lidar_pipeline_is_better_than_dead_reckoning(frames: Frames) -> None:
    offs = {name: truth(frames[-1].stamp).inverse() @ run(name, frames)[0][-1].T_map_base for name in ("lidar", "odometry")}
    assert math.hypot(offs["lidar"].x, offs["lidar"].y) < 0.5 * math.hypot(offs["odometry"].x, offs["odometry"].y)


def test_the_same_frames_give_the_same_bits(name: str, frames: Frames, drive: Drive) -> None:
    (first, a), (second, b) = drive.told(name), run(name, frames)
    assert [e.T_map_base for e in first] == [e.T_map_base for e in second]
    np.testing.assert_array_equal([e.covariance for e in first], [e.covariance for e in second])
    np.testing.assert_array_equal(a.map.log_odds, b.snapshot().map.log_odds)


def test_a_snapshot_is_frozen_and_stays_as_it_was(name: str, frames: Frames) -> None:
    pipeline = build(name)
    for frame in frames[:10]:
        pipeline.update(frame)
    snapshot = pipeline.snapshot()
    before, scans = snapshot.map.log_odds.copy(), len(snapshot.trajectory)
    for frame in frames[10:]:
        pipeline.update(frame)
    np.testing.assert_array_equal(snapshot.map.log_odds, before)
    assert len(snapshot.trajectory) == scans
    for array in (snapshot.map.log_odds, snapshot.map.hit_count, snapshot.map.hit_offset, snapshot.trajectory.poses):
        assert not array.flags.writeable


def test_the_final_trajectory_has_a_pose_for_every_scan(name: str, frames: Frames, drive: Drive) -> None:
    trajectory = drive.told(name)[1].trajectory
    np.testing.assert_array_equal(trajectory.stamps, [scan.stamp for frame in frames for scan in frame.scans])


def test_a_pipeline_draws_the_walls_that_it_sees(mapper: str, drive: Drive) -> None:
    walls = drive.told(mapper)[1].map.wall_points()
    assert len(walls) > 100
    near = (np.abs(np.abs(walls[:, 0] - 0.03) - 2.0) < 0.1) | (np.abs(np.abs(walls[:, 1] - 0.04) - 1.5) < 0.1)
    cupboard = (walls > [0.71, 0.52]).all(axis=1) & (walls < [1.47, 1.22]).all(axis=1)
    assert np.mean(near | cupboard) > 0.95


def test_an_unknown_pipeline_lists_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="no pipeline 'ladar'; available: amcl, fusion, icp_odometry, lidar"):
        pipeline_settings("ladar")


def test_a_warm_up_leaves_no_trace() -> None:
    settings = pipeline_settings("lidar")()
    warm_up(settings.build())
    assert len(settings.build().snapshot().trajectory) == 0
