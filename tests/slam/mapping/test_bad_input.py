"""What a mapper says of a drive whose readings are spoilt: never a crash, never a wrong pose that it calls right."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pytest

from scripts.experiments.drive import Course, Drive
from slam.messages import Estimate, LaserScan, SensorFrame, Status, Trajectory, WheelOdometry
from slam.pipelines import PIPELINES, Finishing
from slam.se2 import SE2
from slam.se3 import SE3

MAPPERS = ["lidar_slam", "rbpf", "icp_odometry"]
DURATION, BEGIN, END = 10.0, 4.0, 6.0
"""Of the drive, and of what is wrong only for a while [s]."""
DISAGREED = 7.0
"""By then the robot has turned and gone far enough to tell a wrong mount [s]."""
JUMP = SE2(0.8, -0.6, 1.0)
"""A metre and a radian."""
UPSIDE_DOWN = SE3.from_xyz_rpy((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0))
BACKWARDS = SE3.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.pi))
ASKEW = SE3.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, math.radians(20.0)))
CLOSE = 0.3
"""A pose so far from the truth is right enough for a drive with a gap in its scans [m, rad]."""

Frames = tuple[SensorFrame, ...]


@dataclass(frozen=True, eq=False)
class Told:
    """What a mapper said of all frames, and knew at the end."""

    estimates: list[Estimate]
    trajectory: Trajectory
    walls: int

    def between(self, begin: float, end: float) -> list[Estimate]:
        return [estimate for estimate in self.estimates if begin <= estimate.stamp < end]

    @cached_property
    def is_sane(self) -> bool:
        for estimate in self.estimates:
            numbers = (estimate.T_map_base.as_array(), estimate.T_map_odom.as_array(), estimate.covariance)
            if not all(np.isfinite(some).all() for some in numbers) or (estimate.status == Status.TRACKING) != (estimate.reason == ""):
                return False
        return bool(np.isfinite(self.trajectory.poses).all() and np.all(np.diff(self.trajectory.stamps) >= 0.0))


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Course("aruco_room", DURATION, 1).drive()


def scans(change: Callable[[LaserScan], LaserScan], begin: float = -1.0, end: float = math.inf) -> Callable[[Frames], Frames]:
    def spoilt(frame: SensorFrame) -> SensorFrame:
        return replace(frame, scans=tuple(change(scan) if begin <= scan.stamp < end else scan for scan in frame.scans))

    return lambda frames: tuple(map(spoilt, frames))


def odometry(change: Callable[[WheelOdometry], WheelOdometry], begin: float = -1.0, end: float = math.inf) -> Callable[[Frames], Frames]:
    def spoilt(frame: SensorFrame) -> SensorFrame:
        return replace(frame, odometry=tuple(change(one) if begin <= one.stamp < end else one for one in frame.odometry))

    return lambda frames: tuple(map(spoilt, frames))


def all_beams(value: float) -> Callable[[LaserScan], LaserScan]:
    return lambda scan: replace(scan, ranges=np.full(len(scan.ranges), value))


def surrounded(scan: LaserScan) -> LaserScan:
    """Somebody stands at the robot: one beam in six passes."""
    return replace(scan, ranges=np.where(np.arange(len(scan.ranges)) % 6, np.minimum(scan.ranges, 0.15), scan.ranges))


def believed_at(T: SE3) -> Callable[[LaserScan], LaserScan]:
    """The lidar is turned against what the robot believes of its mount."""
    return lambda scan: replace(scan, T_base_laser=scan.T_base_laser @ T)


def jumped(reading: WheelOdometry) -> WheelOdometry:
    return replace(reading, T_odom_base=JUMP @ reading.T_odom_base)


def not_finite(reading: WheelOdometry) -> WheelOdometry:
    return replace(reading, T_odom_base=SE2(math.nan, math.nan, math.nan))


def twice(frames: Frames) -> Frames:
    """Every scan and every odometry reading comes again under the same stamp, the scan a millimetre longer."""

    def spoilt(frame: SensorFrame) -> SensorFrame:
        again = tuple(one for scan in frame.scans for one in (scan, replace(scan, ranges=scan.ranges + 0.001)))
        return replace(frame, scans=again, odometry=tuple(one for reading in frame.odometry for one in (reading, reading)))

    return tuple(map(spoilt, frames))


SPOILT: dict[str, Callable[[Frames], Frames]] = {
    "whole": lambda frames: frames,
    "nothing in range": scans(all_beams(math.inf)),
    "no valid beam for a while": scans(all_beams(math.nan), BEGIN, END),
    "nothing in range for a while": scans(all_beams(math.inf), BEGIN, END),
    "surrounded for a while": scans(surrounded, BEGIN, BEGIN + 0.8),
    "odometry jumps": odometry(jumped, BEGIN),
    "all comes twice": twice,
    "odometry not finite": odometry(not_finite),
    "odometry not finite for a while": odometry(not_finite, BEGIN, END),
    "odometry not finite from a time on": odometry(not_finite, BEGIN),
    "upside down": scans(believed_at(UPSIDE_DOWN)),
    "backwards": scans(believed_at(BACKWARDS)),
    "askew": scans(believed_at(ASKEW)),
}


@pytest.fixture(scope="module")
def told(drive: Drive) -> Callable[[str, str], Told]:
    """What a mapper says of a spoilt drive; each is run once."""
    known: dict[tuple[str, str], Told] = {}

    def run(mapper: str, spoilt: str) -> Told:
        if (mapper, spoilt) not in known:
            pipeline = PIPELINES[mapper]().build()
            estimates = [pipeline.update(frame) for frame in SPOILT[spoilt](drive.frames)]
            if isinstance(pipeline, Finishing):
                pipeline.finish()
            snapshot = pipeline.snapshot()
            known[mapper, spoilt] = Told(estimates, snapshot.trajectory, len(snapshot.map.wall_points()))
        return known[mapper, spoilt]

    return run


def worst(told: Told, drive: Drive, since: float = 0.0) -> float:
    """Greatest error of the poses known at the time, the heading's in radians as metres."""
    offs = [(drive.start.inverse() @ drive.pose(e.stamp)).inverse() @ e.T_map_base for e in told.between(since, math.inf)]
    return max(max(math.hypot(off.x, off.y), abs(off.yaw)) for off in offs)


@pytest.mark.parametrize("mapper", MAPPERS)
@pytest.mark.parametrize("spoilt", SPOILT)
def test_whatever_comes_the_answers_are_sane(told: Callable[[str, str], Told], mapper: str, spoilt: str) -> None:
    assert told(mapper, spoilt).is_sane


@pytest.mark.parametrize("mapper", MAPPERS)
def test_a_whole_drive_is_tracked(told: Callable[[str, str], Told], drive: Drive, mapper: str) -> None:
    assert {estimate.status for estimate in told(mapper, "whole").estimates} == {Status.TRACKING}
    assert worst(told(mapper, "whole"), drive) < CLOSE


@pytest.mark.parametrize("mapper", MAPPERS)
@pytest.mark.parametrize("spoilt", ["nothing in range", "no valid beam for a while", "nothing in range for a while"])
def test_scans_that_show_nothing_are_named(told: Callable[[str, str], Told], mapper: str, spoilt: str) -> None:
    for estimate in told(mapper, spoilt).between(BEGIN + 0.5, END):
        assert estimate.status in (Status.DEGRADED, Status.LOST)
        assert "the scan " in estimate.reason


@pytest.mark.parametrize("mapper", MAPPERS)
@pytest.mark.parametrize("spoilt", ["no valid beam for a while", "nothing in range for a while"])
def test_after_scans_that_showed_nothing_the_robot_is_where_it_is(
    told: Callable[[str, str], Told], drive: Drive, mapper: str, spoilt: str
) -> None:
    after = told(mapper, spoilt)
    assert after.estimates[-1].status == Status.TRACKING
    assert worst(after, drive, END + 0.5) < CLOSE


@pytest.mark.parametrize("mapper", MAPPERS)
def test_scans_that_show_nothing_draw_no_wall(told: Callable[[str, str], Told], mapper: str) -> None:
    assert told(mapper, "nothing in range").walls == 0


@pytest.mark.parametrize("mapper", MAPPERS)
@pytest.mark.parametrize("spoilt", ["odometry jumps", "all comes twice"])
def test_a_jump_or_a_repetition_moves_nothing(told: Callable[[str, str], Told], drive: Drive, mapper: str, spoilt: str) -> None:
    assert worst(told(mapper, spoilt), drive) < CLOSE


def test_somebody_who_stands_at_the_robot_does_not_push_the_pose(told: Callable[[str, str], Told], drive: Drive) -> None:
    after = told("lidar_slam", "surrounded for a while")
    assert worst(after, drive) < 0.05
    assert after.estimates[-1].status == Status.TRACKING


@pytest.mark.parametrize("spoilt", ["odometry not finite", "odometry not finite for a while", "odometry not finite from a time on"])
def test_lidar_slam_goes_on_without_the_odometry_that_is_not_finite(told: Callable[[str, str], Told], drive: Drive, spoilt: str) -> None:
    assert worst(told("lidar_slam", spoilt), drive) < CLOSE


@pytest.mark.parametrize("mapper", MAPPERS)
@pytest.mark.parametrize("spoilt", ["odometry not finite", "odometry not finite from a time on"])
def test_odometry_that_is_not_finite_is_named_as_silent(told: Callable[[str, str], Told], mapper: str, spoilt: str) -> None:
    for estimate in told(mapper, spoilt).between(BEGIN + 0.6, math.inf):
        assert estimate.status in (Status.DEGRADED, Status.LOST)
    assert any("wheel odometry" in estimate.reason for estimate in told(mapper, spoilt).estimates)


@pytest.mark.parametrize("spoilt", ["upside down", "backwards", "askew"])
def test_lidar_slam_says_that_the_lidar_is_mounted_otherwise(told: Callable[[str, str], Told], spoilt: str) -> None:
    for estimate in told("lidar_slam", spoilt).between(DISAGREED, math.inf):
        assert estimate.status == Status.DEGRADED
        assert "scan and odometry disagree" in estimate.reason


@pytest.mark.parametrize("spoilt", ["upside down", "backwards", "askew"])
def test_icp_odometry_says_it_too_though_its_steps_are_rough(told: Callable[[str, str], Told], spoilt: str) -> None:
    assert any("scan and odometry disagree" in estimate.reason for estimate in told("icp_odometry", spoilt).estimates)
