import math

import numpy as np
import pytest

from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Estimate, LaserScan, SensorFrame, Status, Trajectory, Twist
from slam.navigation.tour import Tour, TourPolicy
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

SNAPSHOT = Snapshot(OccupancyGrid.empty(GridGeometry(0.05, 1, 1)), Trajectory(np.empty(0), np.empty(0)))
SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
PERIOD = 0.04


def command(policy: TourPolicy, pose: SE2, status: Status = Status.TRACKING) -> Twist:
    return policy(SensorFrame(0.0), Estimate(0.0, pose, SE2(), np.eye(3), status), SNAPSHOT)


def drive(policy: TourPolicy, pose: SE2, seconds: float) -> FloatArray:
    """Positions (N, 2) [m] of a robot that does exactly what it is told."""
    path = []
    for _ in range(round(seconds / PERIOD)):
        twist = command(policy, pose)
        pose = pose @ SE2.exp(np.array([twist.v, 0.0, twist.omega]) * PERIOD)
        path.append((pose.x, pose.y))
    return np.array(path)


def off_the_square(path: FloatArray) -> FloatArray:
    """Distance (N,) of points from the outline of the square of 2 m [m]."""
    outside = np.maximum(np.abs(path - 1.0) - 1.0, 0.0)
    inside = 1.0 - np.abs(path - 1.0).max(axis=1)
    return np.where(inside > 0.0, inside, np.hypot(outside[:, 0], outside[:, 1]))


def test_a_square_is_followed_within_five_centimetres() -> None:
    path = drive(Tour().build(SQUARE), SE2(0.0, 0.0, 0.0), 80.0)
    away_from_corners = np.abs(np.abs(path - 1.0).min(axis=1)) < 0.6
    assert off_the_square(path)[away_from_corners].max() < 0.05
    assert off_the_square(path).max() < 0.10  # a corner is cut by a third of the look-ahead at most


def test_the_round_is_driven_again_and_again() -> None:
    path = drive(Tour().build(SQUARE), SE2(), 80.0)
    half = len(path) // 2
    for part in (path[:half], path[half:]):
        assert all(np.hypot(*(part - corner).T).min() < 0.2 for corner in SQUARE)


def test_from_anywhere_the_first_waypoint_is_approached_in_a_straight_line() -> None:
    path = drive(Tour().build(SQUARE), SE2(-2.0, -2.0, math.pi / 4), 10.5)
    assert np.abs(path[:, 0] - path[:, 1]).max() < 0.05
    assert np.hypot(*path.T).min() < 0.4


def test_a_robot_that_looks_away_turns_on_the_spot_to_the_nearer_side() -> None:
    assert command(Tour().build(SQUARE), SE2(0.0, 0.0, 2.5)) == Twist(0.0, -Tour().yaw_rate)
    assert command(Tour().build(SQUARE), SE2(0.0, 0.0, -2.5)) == Twist(0.0, Tour().yaw_rate)


def test_straight_ahead_is_driven_at_full_speed() -> None:
    twist = command(Tour().build(SQUARE), SE2())
    assert twist.v == pytest.approx(Tour().speed)
    assert twist.omega == pytest.approx(0.0, abs=1e-9)


def test_no_command_turns_faster_than_allowed() -> None:
    policy = Tour(speed=2.0, yaw_rate=0.5).build(SQUARE)
    assert all(abs(command(policy, SE2(0.0, 0.0, yaw)).omega) <= 0.5 for yaw in np.linspace(-3.0, 3.0, 50))


@pytest.mark.parametrize("status", [Status.LOST, Status.AMBIGUOUS])
def test_a_robot_that_does_not_know_where_it_is_looks_around(status: Status) -> None:
    assert command(Tour().build(SQUARE), SE2(), status) == Twist(0.0, Tour().look_around)


def test_a_doubtful_pose_does_not_stop_the_robot() -> None:
    assert command(Tour().build(SQUARE), SE2(), Status.DEGRADED).v > 0.0


@pytest.mark.parametrize("route", [[(0.1, 0.0), (0.0, 0.1)], [(0.5, 0.5), (0.5, 0.5)]])
def test_a_route_shorter_than_the_look_ahead_ends_in_a_command(route: list[tuple[float, float]]) -> None:
    path = drive(Tour().build(np.array(route)), SE2(), 10.0)
    assert np.isfinite(path).all()
    assert np.abs(path).max() < 1.5


def astray(policy: TourPolicy, turns: float) -> Twist:
    """The last command to a robot that has turned so often without learning where it is."""
    for yaw in np.arange(0.0, turns * math.tau, 0.1):
        twist = command(policy, SE2(0.0, 0.0, math.remainder(float(yaw), math.tau)), Status.AMBIGUOUS)
    return twist


def test_a_place_that_looks_like_another_one_is_left_after_one_turn() -> None:
    assert astray(Tour().build(SQUARE), 0.9) == Twist(0.0, Tour().look_around)
    scan = LaserScan(0.0, np.full(90, 4.0), np.linspace(-2.0, 2.0, 90), 0.0, 0.0, 5.6)
    policy = Tour().build(SQUARE)
    astray(policy, 1.1)
    twist = policy(SensorFrame(0.0, scans=(scan,)), Estimate(0.0, SE2(), SE2(), np.eye(3), Status.AMBIGUOUS), SNAPSHOT)
    assert twist.v > 0.0


def test_a_robot_that_was_astray_goes_on_from_the_nearest_leg() -> None:
    policy = Tour().build(SQUARE)
    astray(policy, 1.1)
    assert abs(command(policy, SE2(1.5, 2.0, math.pi)).omega) < 0.1
    assert command(policy, SE2(1.5, 2.0, math.pi)).v > 0.2
