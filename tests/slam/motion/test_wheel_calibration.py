import numpy as np
import pytest

from slam.messages import Trajectory
from slam.motion.wheel_calibration import CalibrationError, calibrate_wheels
from slam.se2 import SE2

TRUE = (0.0290, 0.0275, 0.130)
MOUNT = SE2(0.05, -0.02, 0.1)
BELIEVED = ((0.028, 0.028), 0.120, SE2(0.03, 0.0, 0.0))
DT = 0.02


def driven(rates, noise=0.0, seed=0):
    """Stamps and wheel angles of (left, right) wheel rates, and the lidar's path at every fifth reading."""
    rng, pose, angles, path = np.random.default_rng(seed), SE2(1.0, 2.0, 3.0), np.zeros(2), []
    stamps = DT * np.arange(len(rates) + 1)
    turned = [angles]
    for k, rate in enumerate(rates):
        if k % 5 == 0:
            path.append((stamps[k], *(pose @ MOUNT @ SE2(*rng.normal(0.0, noise, 3))).as_array()))
        angles = angles + DT * np.array(rate)
        left, right = DT * np.array(rate) * TRUE[:2]
        pose = pose @ SE2.exp(np.array([0.5 * (left + right), 0.0, (right - left) / TRUE[2]]))
        turned.append(angles)
    rows = np.array(path)
    return stamps, np.array(turned), Trajectory(rows[:, 0], rows[:, 1:])


def eights(seconds):
    return [(7.0, 7.0) if k % 600 < 200 else ((3.0, 6.0) if k % 600 < 400 else (6.0, 3.0)) for k in range(round(seconds / DT))]


def test_without_noise_everything_is_found_exactly():
    found = calibrate_wheels(*driven(eights(80)), BELIEVED)
    assert (*found.wheel_radii, found.track) == pytest.approx(TRUE, rel=1e-5)
    assert found.T_base_laser.as_array() == pytest.approx(MOUNT.as_array(), abs=1e-5)


def test_noise_does_little_and_the_deviations_cover_it():
    errors = []
    for seed in range(4):
        found = calibrate_wheels(*driven(eights(60), 0.004, seed), BELIEVED)
        values = np.array([*found.wheel_radii, found.track, *found.T_base_laser.as_array()])
        errors.append((values - [*TRUE, *MOUNT.as_array()]) / found.deviations)
        assert np.all(found.deviations[:3] < 0.005 * values[:3])
    assert np.sqrt(np.mean(np.square(errors))) < 1.0


def test_a_stretch_on_which_the_wheels_slip_is_outvoted():
    stamps, angles, path = driven(eights(120))
    angles = angles + np.where((stamps > 50.0) & (stamps < 52.0), 5.0 * (stamps - 50.0), np.where(stamps >= 52.0, 10.0, 0.0))[:, None]
    found = calibrate_wheels(stamps, angles, path, BELIEVED)
    assert (*found.wheel_radii, found.track) == pytest.approx(TRUE, rel=0.005)


def test_a_drive_that_is_too_short_is_an_error():
    with pytest.raises(CalibrationError, match="drive on"):
        calibrate_wheels(*driven(eights(10)), BELIEVED)
    with pytest.raises(CalibrationError, match="drive on"):
        calibrate_wheels(np.empty(0), np.empty((0, 2)), Trajectory(np.empty(0), np.empty((0, 3))), BELIEVED)


@pytest.mark.parametrize("seed", range(3))
def test_a_drive_that_never_turns_is_an_error(seed):
    straight = [(7.0 / TRUE[0] * 0.028, 7.0 / TRUE[1] * 0.028)] * 6000
    with pytest.raises(CalibrationError, match="turn"):
        calibrate_wheels(*driven(straight, 0.004, seed), BELIEVED)


def test_a_robot_that_is_held_is_an_error():
    stamps, angles, path = driven(eights(80))
    held = Trajectory(path.stamps, np.tile(path.poses[100], (len(path), 1)))
    with pytest.raises(CalibrationError, match="held"):
        calibrate_wheels(stamps, angles, held, BELIEVED)
