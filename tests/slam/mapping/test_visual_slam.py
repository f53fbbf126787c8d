"""The `visual_slam` pipeline on a short drive of the twin."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from scripts.experiments.drive import Course, Drive
from slam.errors import ParameterError
from slam.landmarks.marker_map_file import write_marker_map
from slam.mapping.visual_slam import VisualSlam, VisualSlamPipeline
from slam.messages import Estimate, SensorFrame, Status
from slam.se2 import SE2
from slam.se3 import SE3
from worlds.loader import load_world

Frames = tuple[SensorFrame, ...]


@pytest.fixture(scope="module")
def drive() -> Drive:
    return Course("aruco_room", 4.0, 1, camera="raster").drive()


@pytest.fixture(scope="module")
def mapped(drive: Drive) -> tuple[list[Estimate], VisualSlamPipeline]:
    pipeline = VisualSlam().build(drive.start)
    estimates = [pipeline.update(frame) for frame in drive.frames]
    pipeline.finish()
    return estimates, pipeline


@pytest.fixture(scope="module")
def marker_file(mapped: tuple[list[Estimate], VisualSlamPipeline], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "markers.yaml"
    markers = mapped[1].marker_map()
    assert markers is not None
    write_marker_map(path, markers)
    return path


def off(estimate: Estimate, drive: Drive) -> tuple[float, float]:
    error = drive.pose(estimate.stamp).inverse() @ estimate.T_map_base
    return math.hypot(error.x, error.y), abs(error.yaw)


def test_pose_and_markers_are_right_to_millimetres(drive: Drive, mapped: tuple[list[Estimate], VisualSlamPipeline]) -> None:
    estimates, pipeline = mapped
    assert max(off(estimate, drive)[0] for estimate in estimates) < 0.01
    assert max(off(estimate, drive)[1] for estimate in estimates) < math.radians(0.5)
    assert {estimate.status for estimate in estimates} == {Status.TRACKING}
    true = {marker.id: np.array(marker.position) for marker in load_world("aruco_room").markers}
    markers = pipeline.marker_map()
    assert markers is not None
    assert len(markers.markers) >= 8
    errors = [np.linalg.norm(marker.T_map_marker.t - true[marker.id]) for marker in markers.markers.values()]
    assert np.median(errors) < 0.01


def test_in_a_saved_map_one_image_finds_the_robot(drive: Drive, marker_file: Path) -> None:
    pipeline = VisualSlam(marker_map=str(marker_file)).build()
    estimates = [pipeline.update(frame) for frame in drive.frames[: len(drive.frames) // 2]]
    first = next(k for k, frame in enumerate(drive.frames) if frame.images)
    assert {estimate.status for estimate in estimates[:first]} <= {Status.LOST}
    assert {estimate.status for estimate in estimates[first:]} == {Status.TRACKING}
    assert max(off(estimate, drive)[0] for estimate in estimates[first:]) < 0.01


def test_a_map_of_another_dictionary_is_refused(marker_file: Path) -> None:
    other = marker_file.with_name("other.yaml")
    other.write_text(marker_file.read_text().replace("ARUCO_MIP_36h12", "4X4_50"))
    with pytest.raises(Exception, match="of dictionary DICT_4X4_50"):
        VisualSlam(marker_map=str(other)).build()


def spoilt(frames: Frames, **changes: object) -> Frames:
    return tuple(dataclasses.replace(f, images=tuple(dataclasses.replace(i, **changes) for i in f.images)) for f in frames)


def test_bad_images_degrade_and_are_named_and_odometry_carries_on(drive: Drive) -> None:
    image = next(i for f in drive.frames for i in f.images)
    black = np.zeros_like(image.colour)
    small = dataclasses.replace(image.colour_info, width=424, height=240)
    for changes, named in (
        ({"colour": black}, "black"),
        ({"colour": image.colour}, "frozen"),
        ({"colour_info": small}, "its K is for 424 x 240"),
    ):
        pipeline = VisualSlam().build(drive.start)
        estimates = [pipeline.update(frame) for frame in spoilt(drive.frames[:60], **changes)]
        assert estimates[-1].status == Status.DEGRADED
        assert named in estimates[-1].reason
        assert off(estimates[-1], drive)[0] < 0.05


def test_the_same_frames_give_the_same_bits(drive: Drive) -> None:
    frames = drive.frames[:40]
    a, b = VisualSlam().build(SE2()), VisualSlam().build(SE2())
    assert [a.update(f).T_map_base for f in frames] == [b.update(f).T_map_base for f in frames]


@pytest.fixture(scope="module")
def bare() -> Drive:
    return Course("aruco_room:markers=false,texture=brick", 4.0, 1, camera="raster").drive()


def only_camera(frame: SensorFrame) -> SensorFrame:
    return SensorFrame(frame.stamp, images=frame.images, available=frozenset({"images"}))


def test_without_markers_and_wheels_the_camera_alone_tells_the_way(bare: Drive) -> None:
    pipeline = VisualSlam().build(bare.start)
    estimates = [pipeline.update(only_camera(frame)) for frame in bare.frames]
    assert {estimate.sources for estimate in estimates[10:]} == {("visual odometry",)}
    assert {estimate.status for estimate in estimates[10:]} == {Status.TRACKING}
    assert max(off(estimate, bare)[0] for estimate in estimates) < 0.03
    assert off(estimates[-1], bare)[0] < 0.02
    assert len(pipeline.snapshot().trajectory) == sum(len(frame.images) for frame in bare.frames)


def test_the_sources_are_named(drive: Drive, bare: Drive, mapped: tuple[list[Estimate], VisualSlamPipeline]) -> None:
    pipeline = VisualSlam().build(bare.start)
    assert "markers" in mapped[0][-1].sources
    assert [pipeline.update(frame) for frame in bare.frames[:40]][-1].sources == ("visual odometry", "wheels", "gyro")


def test_a_camera_that_sees_nothing_without_wheels_says_so(bare: Drive) -> None:
    blank = spoilt(
        tuple(map(only_camera, bare.frames[:50])), depth=np.full_like(next(i for f in bare.frames for i in f.images).depth, np.nan)
    )
    estimates = [estimate for pipeline in [VisualSlam().build(bare.start)] for estimate in map(pipeline.update, blank)]
    assert estimates[-1].status == Status.DEGRADED
    assert "enough texture" in estimates[-1].reason


def test_in_space_the_camera_s_height_and_tilt_are_found_too(drive: Drive, marker_file: Path) -> None:
    half = drive.frames[: len(drive.frames) // 2]
    pipeline = VisualSlam(marker_map=str(marker_file), planar=False).build()
    estimates = [estimate for frame in half if (estimate := pipeline.update(frame)).status is Status.TRACKING]
    assert len(estimates) > len(half) // 2
    assert max(off(estimate, drive)[0] for estimate in estimates) < 0.02
    info = next(image.colour_info for frame in drive.frames for image in frame.images)
    for estimate in estimates:
        assert estimate.T_map_camera is not None
        off_mount = (SE3.from_se2(drive.pose(estimate.stamp)) @ info.T_base_camera).inverse() @ estimate.T_map_camera
        assert np.linalg.norm(off_mount.t) < 0.02
        assert np.linalg.norm(off_mount.log()[3:]) < math.radians(1.0)


def test_on_the_floor_the_estimate_tells_where_the_camera_is(mapped: tuple[list[Estimate], VisualSlamPipeline]) -> None:
    last = mapped[0][-1]
    assert last.T_map_camera is not None
    assert last.T_map_camera.t[2] == pytest.approx(0.2, abs=0.01)


def test_a_map_cannot_be_made_in_space() -> None:
    with pytest.raises(ParameterError, match="planar = False; must be true while a marker map is made"):
        VisualSlam(planar=False).build()
