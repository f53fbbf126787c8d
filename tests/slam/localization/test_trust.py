import numpy as np
import pytest

from slam.errors import ParameterError
from slam.localization.trust import Trust, TrustRules
from slam.se2 import SE2

STEP = SE2(0.1)


def seen(pose, room=(4.0, 3.0)):
    """Walls of a room (x, y) [m] about the origin, in base."""
    x, y = np.array(room) / 2.0
    along = np.linspace(-1.0, 1.0, 200)
    walls = [(along * x, along * 0.0 + y), (along * x, along * 0.0 - y), (along * 0.0 + x, along * y), (along * 0.0 - x, along * y)]
    return pose.inverse().transform(np.column_stack([np.concatenate(one) for one in zip(*walls, strict=True)]))


def drive(trust, pose, odometry, steps, supported=True, room=(4.0, 3.0), fits=False):
    for _ in range(steps):
        pose, odometry = pose @ STEP, odometry @ STEP
        trust.follow(seen(pose, room), odometry)
        trust.support(STEP, supported, fits)
    return pose, odometry


def test_trust_is_earned_by_a_way_that_the_map_supports():
    trust = Trust(TrustRules())
    drive(trust, SE2(-1.0), SE2(), 9)
    assert not trust.earned
    trust = Trust(TrustRules())
    drive(trust, SE2(-1.0), SE2(), 11)
    assert trust.earned
    trust = Trust(TrustRules())
    drive(trust, SE2(-1.0), SE2(), 11, supported=False)
    assert not trust.earned


def test_a_robot_that_was_carried_away_is_not_trusted_any_more():
    trust = Trust(TrustRules())
    _, odometry = drive(trust, SE2(-1.0), SE2(), 11)
    drive(trust, SE2(-0.3, 1.0, 2.0), odometry, 1)
    assert not trust.earned
    drive(trust, SE2(-0.3, 1.0, 2.0), odometry, 12, supported=False)
    assert not trust.earned


def test_somebody_who_hides_all_for_a_moment_breaks_no_track():
    trust = Trust(TrustRules())
    pose, odometry = drive(trust, SE2(-1.0), SE2(), 11)
    pose, odometry = drive(trust, pose, odometry, 2, supported=False, room=(1.2, 1.2))
    drive(trust, pose, odometry, 1)
    assert trust.earned


def test_somebody_who_comes_close_and_goes_elsewhere_breaks_no_track_that_the_map_supports():
    trust = Trust(TrustRules())
    pose, odometry = drive(trust, SE2(-1.0), SE2(), 11)
    pose, odometry = drive(trust, pose, odometry, 1, supported=False, room=(2.6, 3.0))
    trust.follow(seen(pose, (0.9, 0.8)), odometry)  # what the next scans are compared with is mostly somebody
    assert not trust.earned
    drive(trust, pose, odometry, 3, fits=True)
    assert trust.earned


def test_moved_furniture_breaks_no_track():
    trust = Trust(TrustRules())
    pose, odometry = drive(trust, SE2(-1.0), SE2(), 11)
    drive(trust, pose, odometry, 5, supported=False)
    assert trust.earned


def test_found_elsewhere_the_robot_earns_trust_anew():
    trust = Trust(TrustRules())
    drive(trust, SE2(-1.0), SE2(), 11)
    trust.forget()
    assert not trust.earned


def test_rules_that_mean_nothing_are_refused():
    with pytest.raises(ParameterError):
        TrustRules(agreement=-0.1)
