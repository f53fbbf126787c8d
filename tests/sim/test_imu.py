import math

import numpy as np
import pytest

from hardware.spec import ImuSpec
from sim.gyro_errors import GyroErrors
from sim.imu import Gyro
from sim.motion import STEP, Motion
from sim.realism import REALISMS, Realism
from slam.se3 import SE3

SPEC = ImuSpec()


def turning(rate, duration=1.0):
    motion = Motion(0, SE3())
    yaws = [rate * k * STEP for k in range(round(duration / STEP) + 1)]
    for yaw in yaws:
        motion.append([(0.0, 0.0, 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2), 0.0, 0.0)])
    return motion


def readings(gyro, motion):
    result = []
    while gyro.due <= motion.end:
        result.append(gyro.read(motion))
    return result


@pytest.mark.parametrize("rate", [-4.0, 0.0, 0.7, 5.0])
def test_a_perfect_gyro_reads_the_true_rate_across_the_turn_of_pi(rate):
    result = readings(Gyro(SPEC, REALISMS["ideal"], np.random.default_rng(0)), turning(rate, 2.0))
    assert [reading.yaw_rate for reading in result[1:]] == pytest.approx([rate] * 200, abs=1e-9)
    assert [reading.stamp for reading in result] == [round(k * SPEC.period, 9) for k in range(201)]


def test_the_gyro_does_not_exceed_its_range():
    result = readings(Gyro(SPEC, REALISMS["ideal"], np.random.default_rng(0)), turning(20.0))
    assert result[-1].yaw_rate == SPEC.max_rate


def test_noise_and_bias_have_their_documented_sizes():
    realism, motion = Realism(gyro=GyroErrors(bias_sigma=0.02, noise_sigma=0.01)), turning(0.0, 1.0)
    runs = np.array([[r.yaw_rate for r in readings(Gyro(SPEC, realism, np.random.default_rng(seed)), motion)] for seed in range(100)])
    assert runs.std(axis=1).mean() == pytest.approx(0.01, rel=0.1)
    assert runs.mean(axis=1).std() == pytest.approx(0.02, rel=0.3)


def test_the_default_gyro_gives_whole_degrees_a_second():
    result = readings(Gyro(SPEC, REALISMS["datasheet"], np.random.default_rng(1)), turning(0.3))
    rates = np.degrees([reading.yaw_rate for reading in result])
    assert rates == pytest.approx(np.round(rates), abs=1e-9)
    assert rates[1:].mean() == pytest.approx(math.degrees(0.3), rel=0.03, abs=0.4)


def test_the_bias_walks_with_the_root_of_time():
    realism, motion = Realism(gyro=GyroErrors(drift_sigma=0.01)), turning(0.0, 1.0)
    runs = np.array([[r.yaw_rate for r in readings(Gyro(SPEC, realism, np.random.default_rng(seed)), motion)] for seed in range(200)])
    assert runs[:, -1].std() == pytest.approx(0.01, rel=0.2)
    assert runs[:, 25].std() == pytest.approx(0.005, rel=0.2)


def test_the_scale_is_wrong_by_the_same_share_at_every_rate():
    realism = Realism(gyro=GyroErrors(scale_sigma=0.05))
    slow, fast = (readings(Gyro(SPEC, realism, np.random.default_rng(3)), turning(rate))[-1].yaw_rate / rate for rate in (0.5, 2.0))
    assert slow == pytest.approx(fast)
    assert slow != pytest.approx(1.0, abs=1e-3)
