"""`twin bench fusion`: visual odometry without markers, and the fused estimate against its single inputs."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from scripts.bench.row import Row
from scripts.bench.slam import WORLDS
from scripts.experiments.drive import Course
from scripts.processes import spread
from scripts.runs.metrics import aligned_errors
from sim.ground_truth import ground_truth
from slam.fusion.pipeline import Fusion
from slam.mapping.odometry import Odometry
from slam.mapping.visual_slam import VisualSlam
from slam.messages import SensorFrame, Trajectory
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world

GROUP = "fusion"
TEXTURED = "aruco_room:markers=false,texture=brick"
INPUTS = ("lidar_slam", "visual_slam", "odometry")
CAMERA = frozenset({"images"})

Follower = Callable[[SensorFrame], dict[str, SE2]]
"""What each method answers to a frame."""


def run(smoke: bool) -> Iterator[Row]:
    """All rows, a world's when it is done; without `smoke` some hours: every world is drawn ten times."""
    cv2.setNumThreads(1)
    seconds, seeds = (3.0, range(1, 2)) if smoke else (60.0, range(1, 11))
    yield from _drift_rows(seconds, "wheels and gyro too", _as_it_is)
    yield from _drift_rows(seconds, "the camera alone", _only_camera)
    worlds = WORLDS[:1] if smoke else WORLDS
    errors = spread(position_errors, [Fused(world, seconds, seed) for world in worlds for seed in seeds], 1 if smoke else 0)
    for world in worlds:
        yield from _fusion_rows(world, [next(errors) for _ in seeds])


@dataclass(frozen=True)
class Fused:
    """A drive that `fusion` follows with its single inputs."""

    world: str
    seconds: float
    seed: int


@dataclass(frozen=True, eq=False)
class _Followed:
    """A drive with what every method said."""

    truth: Trajectory
    said: dict[str, Trajectory]
    image_ms: FloatArray
    """Processor time of the updates with an image [ms]."""

    def rms(self, name: str) -> float:
        """Position RMSE after alignment [mm]."""
        return 1e3 * float(np.sqrt(np.mean(aligned_errors(self.truth, self.said[name]).errors.translation ** 2)))

    @property
    def way(self) -> float:
        """Length of the true way [m]."""
        return float(np.hypot(*np.diff(self.truth.poses[:, :2], axis=0).T).sum())

    def end_error(self, name: str) -> float:
        """Distance from the truth at the end, from the common start [m]."""
        true, found = (SE2.from_array(path.poses[0]).inverse() @ SE2.from_array(path.poses[-1]) for path in (self.truth, self.said[name]))
        return float(np.hypot(true.x - found.x, true.y - found.y))


def _follow(world: str, seconds: float, seed: int, follower: Follower) -> _Followed:
    stamps: list[float] = []
    true: list[FloatArray] = []
    took: list[float] = []
    said: dict[str, list[FloatArray]] = {}
    course = Course(world, seconds, seed, camera="raster")
    with course.body() as robot:
        truth = ground_truth(robot)
        for frame in course.follow(robot, truth):
            began = time.thread_time()
            for name, pose in follower(frame).items():
                said.setdefault(name, []).append(pose.as_array())
            if frame.images:
                took.append(1e3 * (time.thread_time() - began))
            stamps.append(frame.stamp)
            true.append(truth.pose(frame.stamp).as_array())
    paths = {name: Trajectory(np.array(stamps), np.array(poses)) for name, poses in said.items()}
    return _Followed(Trajectory(np.array(stamps), np.array(true)), paths, np.array(took or [np.nan]))


def _as_it_is(frame: SensorFrame) -> SensorFrame:
    return frame


def _only_camera(frame: SensorFrame) -> SensorFrame:
    return SensorFrame(frame.stamp, images=frame.images, available=CAMERA)


def _drift_rows(seconds: float, what: str, heard: Callable[[SensorFrame], SensorFrame]) -> list[Row]:
    pipeline = VisualSlam().build(SE2(*load_world(TEXTURED).start))
    drive = _follow(TEXTURED, seconds, 1, lambda frame: {"visual_slam": pipeline.update(heard(frame)).T_map_base})
    drift = 100.0 * drive.end_error("visual_slam") / max(drive.way, 1e-9)
    return [
        Row(GROUP, f"visual odometry without markers, {what}: drift after {drive.way:.0f} m", drift, "% of the way", "≤ 1.5"),
        Row(GROUP, f"visual odometry, {what}: update with an image of 848 x 480", float(np.median(drive.image_ms)), "ms", "≤ 33"),
    ]


def _fusion_rows(world: str, drives: list[dict[str, float]]) -> list[Row]:
    ours = [errors["fusion"] for errors in drives]
    best = [min(errors[name] for name in INPUTS) for errors in drives]
    ratios = [a / b for a, b in zip(ours, best, strict=True)]
    reach = "≤ 3" if world == "aruco_room" else ""
    peer = f"best of {', '.join(INPUTS)}"
    return [
        Row(
            GROUP,
            f"{world}, position RMSE, median of {len(drives)} seeds",
            statistics.median(ours),
            "mm",
            reach,
            peer,
            statistics.median(best),
        ),
        Row(GROUP, f"{world}, error over the best single input's, median of {len(drives)} seeds", statistics.median(ratios), "x", "≤ 1.05"),
    ]


def position_errors(fused: Fused) -> dict[str, float]:
    """Position RMSE after alignment of every method on a drive [mm]."""
    cv2.setNumThreads(1)
    start = SE2(*load_world(fused.world).start)
    fusion, wheels = Fusion().build(start), Odometry().build(start)

    def follower(frame: SensorFrame) -> dict[str, SE2]:
        found, floor = fusion.update(frame), wheels.update(frame)
        return {
            "fusion": found.T_map_base,
            "lidar_slam": fusion.lidar_estimate.T_map_base,
            "visual_slam": fusion.visual_estimate.T_map_base,
            "odometry": floor.T_map_base,
        }

    drive = _follow(fused.world, fused.seconds, fused.seed, follower)
    return {name: drive.rms(name) for name in drive.said}
