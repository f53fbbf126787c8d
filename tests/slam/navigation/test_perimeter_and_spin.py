import math

import numpy as np
import pytest

from slam.errors import ParameterError
from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Estimate, LaserScan, SensorFrame, Trajectory, Twist
from slam.navigation.perimeter import Perimeter
from slam.navigation.spin import Spin, nearest_to_the_middle
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

SNAPSHOT = Snapshot(OccupancyGrid.empty(GridGeometry(0.05, 1, 1)), Trajectory(np.empty(0), np.empty(0)))
PERIOD, HALF = 0.1, 2.0
ANGLES = np.radians(np.arange(-120.0, 121.0, 2.0))
NO_ROUTE = np.empty((0, 2))


def ranges_at(pose: SE2, column: tuple[float, float, float] | None) -> FloatArray:
    """What a lidar in `base` sees of a square room of 4 m about the origin, and of a column (x, y, radius)."""
    u = np.column_stack([np.cos(ANGLES + pose.yaw), np.sin(ANGLES + pose.yaw)])
    with np.errstate(divide="ignore"):
        walls = np.min((HALF - np.sign(u) * (pose.x, pose.y)) / np.abs(u), axis=1)
    if column is None:
        return walls
    off = np.array(column[:2]) - (pose.x, pose.y)
    along = u @ off
    inside = column[2] ** 2 - (off @ off - along**2)
    return np.where((inside > 0.0) & (along > 0.0), np.minimum(walls, along - np.sqrt(np.maximum(inside, 0.0))), walls)


def drive(policy, pose: SE2, seconds: float, column: tuple[float, float, float] | None = None) -> FloatArray:
    """Poses (N, 3) of a robot that does exactly what it is told."""
    poses = []
    for k in range(round(seconds / PERIOD)):
        scan = LaserScan(k * PERIOD, ranges_at(pose, column), ANGLES, 0.0, 0.02, 5.6)
        twist = policy(SensorFrame(k * PERIOD, scans=(scan,)), Estimate(k * PERIOD, pose, SE2(), np.eye(3)), SNAPSHOT)
        pose = pose @ SE2.exp(np.array([twist.v, 0.0, twist.omega]) * PERIOD)
        poses.append(pose.as_array())
    return np.array(poses)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_perimeter_keeps_its_distance_and_goes_all_round(side: str) -> None:
    path = drive(Perimeter(side=side).build(NO_ROUTE), SE2(0.0, 0.0, 0.4), 80.0)
    room = HALF - np.abs(path[:, :2]).max(axis=1)
    assert room.min() > 0.5
    late = path[200:]
    assert np.median(room[200:]) == pytest.approx(0.6, abs=0.06)
    turned = np.unwrap(late[:, 2])
    assert (turned[-1] - turned[0]) * (1.0 if side == "right" else -1.0) > math.tau
    assert set(np.floor(np.arctan2(late[:, 1], late[:, 0]) / (math.pi / 4)).astype(int)) == set(range(-4, 4))


def test_an_island_is_left_for_the_wall() -> None:
    path = drive(Perimeter().build(NO_ROUTE), SE2(-1.2, 0.0, 0.0), 120.0, column=(0.0, 0.0, 0.15))
    assert np.hypot(path[:, 0], path[:, 1]).min() > 0.15 + 0.22
    room = HALF - np.abs(path[-300:, :2]).max(axis=1)
    assert np.median(room) == pytest.approx(0.6, abs=0.06)


def test_the_perimeter_stands_still_without_scans_and_when_nothing_is_seen() -> None:
    policy = Perimeter().build(NO_ROUTE)
    estimate = Estimate(0.0, SE2(), SE2(), np.eye(3))
    assert policy(SensorFrame(0.0), estimate, SNAPSHOT) == Twist()
    blind = LaserScan(1.0, np.full(len(ANGLES), np.nan), ANGLES, 0.0, 0.02, 5.6)
    assert policy(SensorFrame(1.0, scans=(blind,)), estimate, SNAPSHOT) == Twist()


@pytest.mark.parametrize(("changed", "problem"), [({"side": "up"}, "right or left"), ({"distance": 0.1}, "at least half_width")])
def test_a_perimeter_that_cannot_be_is_refused(changed: dict, problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        Perimeter(**changed)


def test_a_spin_turns_once_round_in_steps_and_stops() -> None:
    settings = Spin()
    policy = settings.build(NO_ROUTE)
    path = drive(policy, SE2(0.3, 0.2, 1.0), 60.0)
    assert policy.done
    assert np.ptp(path[:, :2], axis=0).max() < 1e-9
    assert np.unwrap(path[:, 2])[-1] - 1.0 == pytest.approx(math.tau, abs=0.05)
    still = np.abs(np.diff(path[:, 2])) < 1e-12
    stands = np.diff(np.concatenate([[0], (~still).astype(int)])) == 1
    assert stands.sum() == 36
    assert still.sum() * PERIOD > 36 * settings.dwell * 0.8


def test_a_spin_drives_to_the_middle_of_its_route_first() -> None:
    route = np.array([[-1.0, 0.0], [1.0, 0.0], [1.0, 0.6], [-1.0, 0.6]])
    x, y = nearest_to_the_middle(route)
    path = drive(Spin(step=0.5, dwell=0.1).build(route), SE2(-1.0, 0.0, 0.0), 60.0)
    assert math.hypot(path[-1, 0] - x, path[-1, 1] - y) < 0.2
    assert Spin(middle=False).build(route)(SensorFrame(0.0), Estimate(0.0, SE2(-1.0), SE2(), np.eye(3)), SNAPSHOT).v == 0.0


@pytest.mark.parametrize("changed", [{"step": 0.0}, {"step": 4.0}, {"dwell": -1.0}, {"turns": 0.0}])
def test_a_spin_that_cannot_be_is_refused(changed: dict) -> None:
    with pytest.raises(ParameterError):
        Spin(**changed)
