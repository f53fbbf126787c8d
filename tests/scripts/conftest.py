"""A small run made by hand: a robot circles in a room with one box; the estimate jitters, the odometry drifts."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from scripts.cli import main
from scripts.runs.record import KeyFrame, RunRecord
from slam.evaluation.poses import compose
from slam.evaluation.visibility import View
from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.messages import Status, Trajectory
from slam.se2 import SE2, FloatArray

ROOM = [(0, 0, 5, 0), (5, 0, 5, 5), (5, 5, 0, 5), (0, 5, 0, 0)]
BOX = [(2.2, 2.2, 2.8, 2.2), (2.8, 2.2, 2.8, 2.8), (2.8, 2.8, 2.2, 2.8), (2.2, 2.8, 2.2, 2.2)]
T_WORLD_MAP = SE2(2.5, 1.0, 0.3)


def cast(segments: FloatArray, pose: FloatArray, angles: FloatArray) -> FloatArray:
    """Hits (N, 2) of rays in the world."""
    direction = np.column_stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)])
    start, along = segments[:, :2] - pose[:2], segments[:, 2:] - segments[:, :2]
    denominator = direction[:, :1] * along[:, 1] - direction[:, 1:] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / denominator
        fraction = (start[:, 0] * direction[:, 1:] - start[:, 1] * direction[:, :1]) / denominator
    distance[~((distance > 0) & (fraction >= 0) & (fraction <= 1))] = np.inf
    return pose[:2] + distance.min(axis=1)[:, None] * direction


def insert(grid: OccupancyGrid, origin: FloatArray, hits: FloatArray) -> None:
    """Mark free space along rays and hits at their ends."""
    for fraction in np.linspace(0.0, 0.97, 60):
        cells = grid.geometry.to_cells(origin + fraction * (hits - origin))
        free = cells[grid.log_odds[cells[:, 0], cells[:, 1]] <= 0]
        grid.log_odds[free[:, 0], free[:, 1]] = -LOG_ODDS_LIMIT
    cells = grid.geometry.to_cells(hits)
    local = grid.geometry.T_map_grid.inverse().transform(hits)
    grid.log_odds[cells[:, 0], cells[:, 1]] = LOG_ODDS_LIMIT
    grid.hit_offset[cells[:, 0], cells[:, 1]] = local - (cells[:, ::-1] + 0.5) * grid.geometry.resolution


def make_record(frames: int = 120, scans: int = 24) -> RunRecord:
    """The run with its truth."""
    rng = np.random.default_rng(3)
    segments = np.array(ROOM + BOX, dtype=np.float64)
    stamps = np.linspace(0.0, 60.0, frames)
    turn = stamps / 60.0 * math.tau * 0.96
    true_poses = np.column_stack([2.5 + 1.5 * np.sin(turn), 2.5 - 1.5 * np.cos(turn) + 0.12 * np.sin(5 * turn), turn])
    in_map = compose(np.tile(T_WORLD_MAP.inverse().as_array(), (frames, 1)), true_poses)
    estimate = in_map + rng.normal(0.0, [0.006, 0.006, 0.003], (frames, 3))
    odometry = compose(np.tile(SE2(0.1, 0.1, 0.5).as_array(), (frames, 1)), in_map)
    odometry = odometry * [1.03, 1.02, 1.0] + np.column_stack([0.004 * stamps, 0.002 * stamps, 0.001 * stamps])
    geometry = GridGeometry(0.05, 180, 180, SE2(-3.5, -3.0, 0.1))
    grid, key_frames = OccupancyGrid.empty(geometry), []
    view = View()
    for index in range(0, frames, max(frames // scans, 1)):
        world = cast(segments, true_poses[index], np.linspace(view.angle_min, view.angle_max, 682))
        hits = T_WORLD_MAP.inverse().transform(world + rng.normal(0.0, 0.008, world.shape))
        insert(grid, in_map[index, :2], hits)
        key_frames.append(KeyFrame(float(stamps[index]), SE2.from_array(estimate[index]), geometry, grid.states(), hits))
    return RunRecord(
        title="aruco_room · lidar pipeline · seed 1",
        estimate=Trajectory(stamps, estimate),
        final=Trajectory(stamps, estimate),
        odometry=Trajectory(stamps, odometry),
        map=grid,
        truth=Trajectory(stamps, true_poses),
        walls=segments,
        statuses=(Status.TRACKING,) * (frames - 1) + (Status.DEGRADED,),
        key_frames=tuple(key_frames),
        view=view,
    )


@pytest.fixture(scope="session")
def record() -> RunRecord:
    """A run with its truth."""
    return make_record()


@pytest.fixture(scope="session")
def recorded_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a recorded run of 8 s in the twin; not to be changed."""
    folder = tmp_path_factory.mktemp("recorded") / "run"
    assert main(["run", "--duration", "8", "--seed", "3", "--record", "--out", str(folder)]) == 0
    return folder
