"""Sessions on disk."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slam.errors import SessionError
from slam.mapping.grid_mapper import MapSettings
from slam.mapping.lidar_slam import LidarSlam
from slam.mapping.region import Region
from slam.mapping.session import NAME, load_session
from slam.messages import SensorFrame, Status
from slam.se2 import SE2

MAP_FROM_WORLD = SE2(-3.0, -3.0).inverse()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, two_rounds: list[SensorFrame]) -> Path:
    """The session of one round."""
    folder, pipeline = tmp_path_factory.mktemp("session"), LidarSlam().build()
    for frame in two_rounds[: len(two_rounds) // 2]:
        pipeline.update(frame)
    pipeline.save(folder)
    return folder


def test_a_session_comes_back_as_it_was(folder: Path, tmp_path: Path) -> None:
    before = LidarSlam().build()
    assert before.resume(folder)
    before.save(tmp_path)
    with np.load(folder / NAME) as old, np.load(tmp_path / NAME) as new:
        assert set(old.files) == set(new.files)
        for name in old.files:
            np.testing.assert_allclose(new[name], old[name], atol=1e-9)


def test_what_a_full_submap_still_saw_is_kept_and_does_not_widen_it(tmp_path: Path, two_rounds: list[SensorFrame]) -> None:
    pipeline = LidarSlam(region=Region(length=1.0, near=2.0)).build()
    for frame in two_rounds[: len(two_rounds) // 2]:
        pipeline.update(frame)
    pipeline.save(tmp_path)
    first, restored = pipeline.submaps[0], load_session(tmp_path, MapSettings())
    assert restored is not None
    assert not all(keyframe.widens for keyframe in first.keyframes)
    assert [keyframe.widens for keyframe in restored[0].keyframes] == [keyframe.widens for keyframe in first.keyframes]
    assert restored[0].travelled == pytest.approx(first.travelled)
    assert restored[0].travelled < 1.5


def test_the_robot_finds_itself_where_it_began(folder: Path, round_poses: list[SE2], drive_from: Any) -> None:
    pipeline = LidarSlam(mapping=False).build()
    assert pipeline.resume(folder)
    for pose, frame in zip(round_poses, drive_from(round_poses), strict=True):
        estimate, true = pipeline.update(frame), MAP_FROM_WORLD @ pose
        assert estimate.status == Status.TRACKING
        assert math.hypot(estimate.T_map_base.x - true.x, estimate.T_map_base.y - true.y) < 0.10


def test_the_robot_finds_itself_elsewhere(folder: Path, round_poses: list[SE2], drive_from: Any) -> None:
    pipeline, poses = LidarSlam(mapping=False).build(), round_poses[100:160]
    pipeline.resume(folder)
    estimates = [pipeline.update(frame) for frame in drive_from(poses)]
    for pose, estimate in zip(poses, estimates, strict=True):
        true = MAP_FROM_WORLD @ pose
        near = math.hypot(estimate.T_map_base.x - true.x, estimate.T_map_base.y - true.y) < 0.10
        assert near or estimate.status == Status.LOST
    assert estimates[-1].status == Status.TRACKING


def test_only_localising_adds_nothing(folder: Path, round_poses: list[SE2], drive_from: Any) -> None:
    pipeline = LidarSlam(mapping=False).build()
    pipeline.resume(folder)
    before = pipeline.snapshot().map
    kept = [len(submap.keyframes) for submap in pipeline.submaps.all]
    for frame in drive_from(round_poses):
        pipeline.update(frame)
    np.testing.assert_array_equal(pipeline.snapshot().map.log_odds, before.log_odds)
    assert [len(submap.keyframes) for submap in pipeline.submaps.all] == kept


def test_an_empty_folder_is_a_new_session(tmp_path: Path) -> None:
    assert not LidarSlam().build().resume(tmp_path)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda arrays: arrays | {"version": np.array(99)}, "is of version 99; this is version 3"),
        (lambda arrays: {name: array for name, array in arrays.items() if name != "version"}, "is of version None"),
        (lambda arrays: {name: array for name, array in arrays.items() if name != "0/steps"}, "is damaged"),
    ],
)
def test_a_session_that_cannot_be_used_says_so_in_a_line(
    folder: Path, tmp_path: Path, spoil: Callable[[dict[str, Any]], dict[str, Any]], message: str
) -> None:
    with np.load(folder / NAME) as file:
        np.savez(tmp_path / NAME, **spoil({name: file[name] for name in file.files}))
    with pytest.raises(SessionError, match=message) as error:
        load_session(tmp_path, MapSettings())
    assert "\n" not in str(error.value)


def test_a_file_that_is_no_session_says_so_in_a_line(tmp_path: Path) -> None:
    (tmp_path / NAME).write_bytes(b"PK nothing of the kind")
    with pytest.raises(SessionError, match="cannot be read"):
        load_session(tmp_path, MapSettings())


def test_cells_of_another_size_are_refused(folder: Path) -> None:
    with pytest.raises(SessionError, match=r"0\.05 m wide, those asked for 0\.1 m"):
        load_session(folder, MapSettings(resolution=0.1))
