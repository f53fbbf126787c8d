import math

import numpy as np
import pytest

from slam.messages import Twist
from slam.navigation.follower import Follower, foreseen_room, resample
from slam.se2 import SE2

NOTHING = np.empty((0, 2))
CORNER = np.array([[0.0, 0.0], [1.5, 0.0], [1.5, 1.5]])
PERIOD = 0.04
ORIGIN = SE2()


def drive(corners, start=ORIGIN, hits=NOTHING, seconds=30.0):
    """Poses (N, 3), twists (N, 2) and whether it arrived, of a robot that does exactly what it is told."""
    follower, pose, poses, twists = Follower().build(), start, [], []
    follower.take(corners)
    for step in range(round(seconds / PERIOD)):
        twist = follower.follow(pose, 1.0, hits, step * PERIOD)
        if twist is None:
            return np.array(poses), np.array(twists), True
        pose = pose @ SE2.exp(np.array([twist.v, 0.0, twist.omega]) * PERIOD)
        poses.append(pose.as_array())
        twists.append((twist.v, twist.omega))
    return np.array(poses), np.array(twists), False


def test_it_follows_a_path_round_a_corner_to_its_end() -> None:
    poses, _, arrived = drive(CORNER)
    assert arrived
    path = resample(CORNER)
    off = np.hypot(*(poses[:, None, :2] - path).transpose(2, 0, 1)).min(axis=1)
    assert off.max() < 0.12


def test_it_turns_on_the_spot_towards_a_path_that_begins_behind() -> None:
    poses, twists, arrived = drive(np.array([[0.0, 0.0], [-1.0, 0.0]]))
    assert arrived
    assert (twists[:10, 0] == 0.0).all()
    assert np.abs(poses[:, 1]).max() < 0.1


def test_it_keeps_to_its_limits() -> None:
    s = Follower()
    _, twists, _ = drive(CORNER, SE2(0.0, 0.0, 2.0))
    assert np.abs(twists[:, 0]).max() <= s.speed + 1e-9
    assert np.abs(twists[:, 1]).max() <= s.yaw_rate + 1e-9
    assert np.diff(twists[:, 0]).max() <= s.acceleration * PERIOD + 1e-9
    assert np.abs(np.diff(twists[:, 1])).max() <= s.yaw_acceleration * PERIOD + 1e-9


def test_it_stops_before_what_stands_in_its_way() -> None:
    wall = np.column_stack([np.full(41, 1.0), np.linspace(-1.0, 1.0, 41)])
    poses, twists, arrived = drive(np.array([[0.0, 0.0], [2.0, 0.0]]), hits=wall, seconds=15.0)
    assert not arrived
    assert twists[-1, 0] == 0.0
    assert 0.7 < poses[-1, 0] <= 1.0 - 0.13


def test_it_drives_along_a_wall_that_is_a_little_too_near() -> None:
    wall = np.column_stack([np.linspace(-1.0, 3.0, 200), np.full(200, 0.145)])
    _, _, arrived = drive(np.array([[0.0, 0.0], [2.0, 0.0]]), hits=wall)
    assert arrived


@pytest.mark.parametrize("omega", [0.0, 1e-9, 0.8, -0.8])
def test_the_room_foreseen_is_that_of_the_arc(omega) -> None:
    hit = np.array([[0.6, 0.1]])
    steps = [SE2.exp(np.array([0.3, 0.0, omega]) * t) for t in np.arange(1, 21) * 0.05]
    expected = min(math.hypot(0.6 - pose.x, 0.1 - pose.y) for pose in steps)
    assert foreseen_room(Twist(0.3, omega), 1.0, hit) == pytest.approx(expected)


def test_without_hits_there_is_room() -> None:
    assert math.isinf(foreseen_room(Twist(0.3, 0.0), 1.0, NOTHING))
