"""Markers in `amcl`, in a room whose four walls look alike to a lidar."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from scripts.bench.marker_scenes import true_map
from scripts.experiments.drive import Course, Drive
from sim.ground_truth import ground_truth
from slam.landmarks.marker_map import MarkerMapError
from slam.landmarks.marker_map_file import write_marker_map
from slam.localization.amcl import Amcl
from slam.localization.known_map import KnownMap
from slam.localization.landmarks import LandmarkEye, Landmarks, SeenLandmarks
from slam.messages import Estimate, Status
from slam.se2 import SE2

WORLD = "aruco_room:furniture=false,spacing=1.0"


@pytest.fixture(scope="module")
def driven() -> tuple[Drive, KnownMap]:
    course = Course(WORLD, 4.0, 3, camera="raster")
    with course.body() as robot:
        truth = ground_truth(robot)
        frames = tuple(course.follow(robot, truth))
        path = truth.trajectory(np.array([frame.stamp for frame in frames]))
        return Drive(WORLD, frames, path, truth.segments()), KnownMap(truth.grid())


@pytest.fixture(scope="module")
def marker_file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("markers") / "markers.yaml"
    write_marker_map(path, true_map(WORLD))
    return str(path)


def run(driven: tuple[Drive, KnownMap], start: SE2 | None, marker_file: str = "") -> list[Estimate]:
    drive, known = driven
    pipeline = Amcl(landmarks=Landmarks(marker_map=marker_file)).build(known, start)
    return [pipeline.update(frame) for frame in drive.frames]


def off(drive: Drive, estimate: Estimate) -> float:
    error = drive.pose(estimate.stamp).inverse() @ estimate.T_map_base
    return math.hypot(error.x, error.y) + abs(error.yaw)


def test_a_start_that_lidar_alone_cannot_tell_is_told_by_markers(driven: tuple[Drive, KnownMap], marker_file: str) -> None:
    assert run(driven, None)[-1].status is Status.AMBIGUOUS
    found = run(driven, None, marker_file)[-1]
    assert found.status is Status.TRACKING
    assert off(driven[0], found) < 0.05


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_robot_kidnapped_to_a_place_that_looks_alike_is_found(driven: tuple[Drive, KnownMap], marker_file: str, quarters: int) -> None:
    wrong = SE2(yaw=quarters * math.pi / 2) @ driven[0].start
    assert off(driven[0], run(driven, wrong)[-1]) > 1.0
    assert off(driven[0], run(driven, wrong, marker_file)[-1]) < 0.05


def test_a_camera_that_is_missing_is_named(driven: tuple[Drive, KnownMap], marker_file: str) -> None:
    drive, known = driven
    blind = [dataclasses.replace(f, images=(), available=f.available - {"images"}) for f in drive.frames[:40]]
    pipeline = Amcl(landmarks=Landmarks(marker_map=marker_file)).build(known, drive.start)
    last = [pipeline.update(frame) for frame in blind][-1]
    assert last.status is Status.DEGRADED
    assert last.reason == "the robot has no camera to see the markers with"
    assert off(drive, last) < 0.05


def test_the_same_frames_give_the_same_bits(driven: tuple[Drive, KnownMap], marker_file: str) -> None:
    short = dataclasses.replace(driven[0], frames=driven[0].frames[:30]), driven[1]
    a, b = run(short, None, marker_file), run(short, None, marker_file)
    assert [e.T_map_base for e in a] == [e.T_map_base for e in b]


@pytest.fixture
def eye(marker_file: str) -> LandmarkEye:
    found = Landmarks(marker_map=marker_file).build()
    assert found is not None
    return found.eye


POSE = SE2(0.4, -0.2, 0.3)
PLACES = np.array([[2.5, 0.5], [1.0, 2.5], [2.5, -1.5]])
SEEN = SeenLandmarks(0.0, PLACES, POSE.inverse().transform(PLACES))


def test_the_likelihood_is_highest_where_the_markers_were_seen_from(eye: LandmarkEye) -> None:
    around = POSE.as_array() + np.array([[0, 0, 0], [0.1, 0, 0], [0, -0.1, 0], [0, 0, 0.05], [0, 0, math.tau]])
    logs = eye.log_likelihoods(around, SEEN)
    assert logs[0] == pytest.approx(0.0, abs=1e-9)
    assert logs[4] == pytest.approx(0.0, abs=1e-9)
    assert (logs[1:4] < -1.0).all()
    assert not eye.contradicts(POSE, SEEN)
    assert eye.contradicts(SE2(yaw=1.5) @ POSE, SEEN)


def test_one_marker_that_was_moved_does_not_outweigh_all_others(eye: LandmarkEye) -> None:
    moved = SeenLandmarks(0.0, PLACES + np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]]), SEEN.seen)
    assert eye.log_likelihoods(POSE.as_array()[None], moved)[0] == pytest.approx(-32.0)
    assert not eye.contradicts(POSE, moved)


def test_poses_are_drawn_all_round_a_marker_at_its_range_and_bearing(eye: LandmarkEye, driven: tuple[Drive, KnownMap]) -> None:
    lone = SeenLandmarks(0.0, np.zeros((1, 2)), np.array([[1.0, 0.2]]))
    poses, weights = eye.seeds(driven[1], lone, np.random.default_rng(0))
    assert len(poses) > 1900
    assert np.ptp(weights) == 0.0
    assert np.hypot(*poses[:, :2].T) == pytest.approx(math.hypot(1.0, 0.2), abs=0.2)
    seen = [SE2.from_array(pose).inverse().transform(np.zeros((1, 2)))[0] for pose in poses[:200]]
    bearings = np.arctan2(*np.array(seen).T[::-1])
    assert bearings.mean() == pytest.approx(math.atan2(0.2, 1.0), abs=0.01)
    assert bearings.std() == pytest.approx(0.02, rel=0.2)


def test_the_best_of_the_poses_drawn_is_near_where_the_markers_were_seen_from(eye: LandmarkEye, driven: tuple[Drive, KnownMap]) -> None:
    poses, weights = eye.seeds(driven[1], SEEN, np.random.default_rng(0))
    best = SE2.from_array(poses[int(np.argmax(weights))])
    assert math.hypot(best.x - POSE.x, best.y - POSE.y) < 0.1


def test_a_map_of_other_markers_is_refused(marker_file: str, tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(Path(marker_file).read_text().replace("ARUCO_MIP_36h12", "4X4_50"))
    with pytest.raises(MarkerMapError, match="of dictionary DICT_4X4_50"):
        Landmarks(marker_map=str(other)).build()
