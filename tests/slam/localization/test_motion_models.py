import math

import numpy as np
import pytest

from slam.localization.motion_models import ConstantVelocity, OdometryMotion, VelocityMotion, turn_way_turn
from slam.se2 import SE2

START = SE2(1.0, -2.0, 2.9)
STEPS = [SE2(0.3, 0.0, 0.2), SE2(-0.2, 0.02, -0.1), SE2(0.0, 0.0, 0.4), SE2(0.0, 0.005, 0.1), SE2()]
QUIET = OdometryMotion(0.0, 0.0, 0.0, 0.0)


def moved(model, step, count=1, duration=0.5, seed=0):
    poses = np.tile(START.as_array(), (count, 1))
    return model.sample(poses, step, duration, np.random.default_rng(seed))


def off_start(poses):
    """Steps (N, 3) seen from the start."""
    return np.array([(START.inverse() @ SE2.from_array(pose)).as_array() for pose in poses])


@pytest.mark.parametrize("step", STEPS)
def test_without_noise_the_odometry_model_makes_the_step(step):
    off = (START @ step).inverse() @ SE2.from_array(moved(QUIET, step)[0])
    limit = 1e-9 if math.hypot(step.x, step.y) >= 0.01 or step.y == 0.0 else 0.01  # a way that short has no direction
    assert math.hypot(off.x, off.y) < limit
    assert abs(off.yaw) < 1e-9


@pytest.mark.parametrize("twist", [(0.3, 0.4), (-0.2, 1.1), (0.0, 0.7), (0.5, 0.0), (0.5, 1e-9)])
def test_without_noise_the_velocity_model_drives_the_arc(twist):
    step = SE2.exp(np.array([twist[0], 0.0, twist[1]]) * 0.5)
    off = (START @ step).inverse() @ SE2.from_array(moved(VelocityMotion(0, 0, 0, 0, 0, 0), step)[0])
    np.testing.assert_allclose(off.as_array(), 0.0, atol=1e-9)


def test_the_odometry_model_spreads_by_the_variances_of_table_5_6():
    model, step = OdometryMotion(0.01, 0.02, 0.003, 0.004), SE2(0.4, 0.3, 0.9)
    turn, way, last = turn_way_turn(step)
    seen = off_start(moved(model, step, 40_000))
    first = np.arctan2(seen[:, 1], seen[:, 0])
    assert np.var(first) == pytest.approx(0.01 * turn**2 + 0.02 * way**2, rel=0.04)
    assert np.var(np.hypot(seen[:, 0], seen[:, 1])) == pytest.approx(0.003 * way**2 + 0.004 * (turn**2 + last**2), rel=0.04)
    assert np.var(seen[:, 2] - first) == pytest.approx(0.01 * last**2 + 0.02 * way**2, rel=0.04)


def test_the_odometry_models_covariance_is_that_of_its_samples():
    model, step = OdometryMotion(0.01, 0.01, 0.01, 0.01), SE2(0.2, 0.05, 0.1)
    np.testing.assert_allclose(np.cov(off_start(moved(model, step, 400_000)).T), model.covariance(step), rtol=0.1, atol=1e-5)


def test_the_velocity_model_spreads_by_the_variances_of_table_5_3():
    v, w, duration = 0.8, 0.6, 0.5  # so fast that none is drawn backwards, whose direction would be the opposite one
    model = VelocityMotion(0.01, 0.02, 0.03, 0.04, 0.05, 0.06)
    seen = off_start(moved(model, SE2.exp(np.array([v, 0.0, w]) * duration), 40_000, duration))
    chord = 2.0 * np.arctan2(seen[:, 1], seen[:, 0])  # an arc ends in the direction of half its turn
    assert np.var(chord) == pytest.approx((0.03 * v * v + 0.04 * w * w) * duration**2, rel=0.04)
    assert np.var(seen[:, 2] - chord) == pytest.approx((0.05 * v * v + 0.06 * w * w) * duration**2, rel=0.04)
    speed = np.hypot(seen[:, 0], seen[:, 1]) / duration / np.sinc(chord / 2.0 / np.pi)
    assert np.var(speed) == pytest.approx(0.01 * v * v + 0.02 * w * w, rel=0.04)


@pytest.mark.parametrize("jitter", [SE2(0.0, 0.0, 0.1), SE2(-0.001, 0.003, 0.1)])
def test_a_turn_on_the_spot_spreads_little(jitter):
    """Without the guard the direction of a millimetre is taken for a turn of half a circle and back: 27 deg."""
    seen = off_start(moved(OdometryMotion(0.05, 0.05, 0.02, 0.02), jitter, 5000))
    assert math.degrees(np.std(seen[:, 2])) < 1.5
    assert np.std(seen[:, :2]) < 0.015


def test_backing_up_is_a_negative_way_not_two_turns():
    turn, way, last = turn_way_turn(SE2(-0.2, 0.01, 0.05))
    assert way < 0.0
    assert abs(turn) < 0.1
    assert abs(last) < 0.2


def test_without_wheels_the_spread_grows_with_the_time():
    for duration in (0.1, 0.4):
        seen = off_start(moved(ConstantVelocity(0.3, 1.0), SE2(0.05, 0.0, 0.0), 5000, duration))
        assert np.std(seen[:, 0]) == pytest.approx(0.3 * duration, rel=0.05)
        assert np.std(seen[:, 2]) == pytest.approx(duration, rel=0.05)


def test_headings_stay_within_half_a_turn():
    for model in (OdometryMotion(), VelocityMotion()):
        headings = moved(model, SE2(0.1, 0.0, 1.0), 2000)[:, 2]
        assert (np.abs(headings) <= math.pi).all()
