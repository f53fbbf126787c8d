"""Visual odometry on short drives of the twin in a room without markers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from scripts.experiments.drive import Course, Drive
from slam.landmarks.visual_odometry import Prediction, VisualOdometry, VisualStep, VisualTracker
from slam.messages import RgbdImage
from slam.se2 import SE2
from slam.se3 import SE3

NOTHING = np.zeros((6, 6))


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Course("aruco_room:markers=false,texture=brick", 3.0, 2, camera="raster").drive()


@pytest.fixture(scope="module")
def images(drive: Drive) -> list[RgbdImage]:
    """Two a tenth of a second and more apart, where the robot is under way."""
    return [image for frame in drive.frames for image in frame.images][15:40:2]


def prediction(T: SE2 | None = None, information: np.ndarray = NOTHING) -> Prediction:
    return Prediction(SE3.from_se2(T or SE2()), information, np.zeros(3))


def follow(tracker: VisualTracker, drive: Drive, images: list[RgbdImage]) -> list[tuple[VisualStep, SE2]]:
    """Each step with the true one; the last answer is the next prediction."""
    made, key, guess = [], images[0].stamp, SE2()
    for image in images:
        before = drive.pose(image.stamp - 0.02)
        twist = (before.inverse() @ drive.pose(image.stamp)).log() / 0.02
        step = tracker.update(image, image.colour_info.T_base_camera, Prediction(SE3.from_se2(guess), NOTHING, twist))
        if step is not None:
            made.append((step, drive.pose(key).inverse() @ drive.pose(image.stamp)))
            key, guess = (image.stamp, SE2()) if step.renewed else (key, step.T_key_base.to_se2())
    return made


@pytest.mark.parametrize("features", ["orb", "sift"])
def test_the_way_since_the_keyframe_is_known_to_millimetres(features: str, drive: Drive, images: list[RgbdImage]) -> None:
    few = images if features == "orb" else images[:4]
    for step, true in follow(VisualOdometry(features=features).build(), drive, few):
        off = true.inverse() @ step.T_key_base.to_se2()
        assert step.seen
        assert step.inliers > 100
        assert np.hypot(off.x, off.y) < 0.004
        assert abs(off.yaw) < 0.004


def test_a_wrong_guess_is_overcome_by_descriptors(images: list[RgbdImage], drive: Drive) -> None:
    tracker = VisualOdometry().build()
    first, second = images[0], images[4]
    mount = first.colour_info.T_base_camera
    assert tracker.update(first, mount, prediction()) is None
    step = tracker.update(second, mount, prediction(SE2(0.0, 0.3, 0.5)))
    assert step is not None
    assert step.seen
    off = (drive.pose(first.stamp).inverse() @ drive.pose(second.stamp)).inverse() @ step.T_key_base.to_se2()
    assert np.hypot(off.x, off.y) < 0.02


def test_what_wheels_rule_out_is_not_believed(images: list[RgbdImage]) -> None:
    tracker = VisualOdometry().build()
    mount, sure = images[0].colour_info.T_base_camera, np.diag([1e6, 1e6, 1e6, 1e6, 1e6, 1e6])
    tracker.update(images[0], mount, prediction())
    step = tracker.update(images[1], mount, prediction(SE2(0.3, 0.0, 0.1), sure))
    assert step is not None
    assert not step.seen
    np.testing.assert_allclose(step.T_key_base.to_se2().as_array(), [0.3, 0.0, 0.1])


@pytest.mark.parametrize("spoil", ["blank", "no depth"])
def test_an_image_that_shows_nothing_is_not_seen(spoil: str, images: list[RgbdImage]) -> None:
    changes = {"blank": {"colour": np.full_like(images[0].colour, 90)}, "no depth": {"depth": np.full_like(images[0].depth, np.nan)}}
    tracker, mount = VisualOdometry().build(), images[0].colour_info.T_base_camera
    for image in images[:3]:
        step = tracker.update(dataclasses.replace(image, **changes[spoil]), mount, prediction())
    assert step is not None
    assert not step.seen
    assert np.isfinite(step.covariance).all()
