import cv2
import numpy as np
import pytest

from hardware.camera_spec import d435
from hardware.spec import RobotSpec
from scripts.bench.corners import fitted_corners
from sim.errors import SimError, TruthError
from sim.ground_truth import ground_truth
from sim.robot import Sim
from slam.messages import Twist

SMALL = RobotSpec(camera=d435((424, 240), (424, 240), 15))


STOP = Twist()


def frames_of(robot, duration, twist=STOP):
    frames = []
    for tick in range(round(duration / 0.05) + 1):
        robot.clock.sleep_until(0.05 * tick)
        frames.append(robot.read())
        robot.drive(twist)
    return frames


def images_of(frames):
    return [image for frame in frames for image in frame.images]


@pytest.fixture(scope="module")
def turning():
    """A faultless robot that turns, and what it has seen."""
    robot = Sim(camera="raster", realism="ideal").build()
    with robot:
        frames = frames_of(robot, 1.0, Twist(0.1, 1.0))
        yield robot, frames


def test_images_come_at_the_rate_of_the_spec(turning):
    robot, frames = turning
    stamps = [image.stamp for image in images_of(frames)]
    assert len(stamps) >= 13
    np.testing.assert_allclose(np.diff(stamps), robot.spec.camera.period, atol=1e-8)


def test_images_are_what_the_spec_says(turning):
    robot, frames = turning
    for image in images_of(frames):
        assert image.colour.shape == (480, 848, 3)
        assert image.depth.shape == (480, 848)
        assert image.colour_info.row_time == robot.spec.camera.colour.row_time
        assert image.depth_info.row_time == 0.0
        np.testing.assert_array_equal(image.colour_info.K, robot.spec.camera.colour.K)
        np.testing.assert_allclose(
            (image.colour_info.T_base_camera.inverse() @ image.depth_info.T_base_camera).t, [0.015, 0.0, 0.0], atol=1e-12
        )


def test_pixels_cannot_be_written(turning):
    image = images_of(turning[1])[0]
    for pixels in (image.colour, image.depth):
        with pytest.raises(ValueError, match="read-only"):
            pixels[0, 0] = 0


def test_an_image_comes_when_odometry_covers_its_last_row(turning):
    covered = -np.inf
    for frame in turning[1]:
        covered = max([covered, *(reading.stamp for reading in frame.odometry)])
        assert all(image.end <= covered for image in frame.images)


def test_every_row_sees_the_world_at_its_own_time(turning):
    robot, frames = turning
    truth, errors = ground_truth(robot).camera(), []
    for image in images_of(frames)[-4:]:
        grey = image.colour.astype(np.float64).mean(axis=2)
        found = truth.markers(image.stamp).values()
        errors += [fitted_corners(grey, corners, robot.spec.camera.colour) - corners for corners in found]
    assert len(errors) > 5
    assert np.sqrt(np.mean(np.square(errors))) < 0.1


def test_opencv_reads_the_markers_that_are_there(turning):
    robot, frames = turning
    image = images_of(frames)[-1]
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, robot.simulation.world.dictionary))
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image.colour)
    assert ids is not None
    assert set(ground_truth(robot).camera().markers(image.stamp)) <= set(ids.ravel().tolist())


def test_faultless_depth_is_the_true_one_in_whole_millimetres(turning):
    robot, frames = turning
    image = images_of(frames)[-1]
    true = ground_truth(robot).camera().depth(image.stamp)
    measured = np.isfinite(image.depth)
    assert np.mean(measured) > 0.4
    assert np.max(np.abs(image.depth - true)[measured]) <= 0.00051


def test_the_truth_forgets(turning):
    camera = ground_truth(turning[0]).camera()
    with pytest.raises(TruthError, match="not known"):
        camera.markers(5.0)


def test_the_same_seed_gives_the_same_pixels_after_a_reset():
    def pixels(robot):
        return [(image.stamp, image.colour.tobytes(), image.depth.tobytes()) for image in images_of(frames_of(robot, 0.5, Twist(0.1, 0.5)))]

    with Sim(camera="raster", spec=SMALL, seed=4).build() as robot:
        first = pixels(robot)
        robot.reset(5)
        other = pixels(robot)
        robot.reset(4)
        again = pixels(robot)
    assert first == again
    assert len(first) >= 5
    assert other != first


def test_the_camera_leaves_the_other_readings_as_they_were():
    def readings(camera):
        with Sim(camera=camera, spec=SMALL, seed=2).build() as robot:
            return [(f.odometry, f.imu, [scan.ranges.tobytes() for scan in f.scans]) for f in frames_of(robot, 0.6, Twist(0.1, 0.5))]

    assert readings("raster") == readings("none")


def test_without_a_camera_there_are_no_images():
    with Sim(spec=SMALL).build() as robot:
        assert robot.spec.camera is None
        assert not images_of(frames_of(robot, 0.3))
        with pytest.raises(TruthError, match="camera is off"):
            ground_truth(robot).camera()


def test_an_unknown_renderer_is_refused():
    with pytest.raises(SimError, match="no camera 'gpu'; available: raster, embree, tiny, egl, none"):
        Sim(camera="gpu")


def test_people_are_masked_where_they_stand():
    slow = RobotSpec(camera=d435((424, 240), (424, 240), 6))
    with Sim(world="aruco_room:people=4,seed=2", camera="raster", spec=slow, realism="ideal").build() as robot:
        masks = []
        for tick in range(9):
            robot.clock.sleep_until(0.3 * tick)
            robot.drive(Twist(0.0, 2.5))
            stamps = [image.stamp for image in robot.read().images]
            masks += [ground_truth(robot).camera().people(stamp) for stamp in stamps[-1:]]
    seen = set(np.unique(np.stack(masks)).tolist())
    assert seen <= {-1, 0, 1, 2, 3}
    assert len(seen) > 1
