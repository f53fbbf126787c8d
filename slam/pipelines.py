"""Pipelines by name. Every one has the same face: `update(frame) -> Estimate`, `snapshot() -> Snapshot`."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from slam.errors import UnknownNameError
from slam.fusion.pipeline import Fusion
from slam.localization.amcl import Amcl
from slam.localization.known_map import KnownMap
from slam.localization.localizability import Localizability
from slam.localization.mcl import Mcl
from slam.localization.perfect_match import PerfectMatch
from slam.mapping.icp_odometry import IcpOdometry
from slam.mapping.lidar import Lidar
from slam.mapping.lidar_slam import LidarSlam
from slam.mapping.odometry import Odometry
from slam.mapping.rbpf import Rbpf
from slam.mapping.visual_slam import VisualSlam
from slam.messages import Estimate, Imu, LaserScan, SensorFrame, WheelOdometry
from slam.se2 import SE2
from slam.snapshot import Snapshot


class Pipeline(Protocol):
    """A stateful estimator. It never raises on what the sensors say and never waits."""

    def update(self, frame: SensorFrame) -> Estimate:
        """Take in one frame; answer with the pose at its stamp."""
        ...

    def snapshot(self) -> Snapshot:
        """What is known now, frozen."""
        ...


@runtime_checkable
class Finishing(Protocol):
    """A pipeline that has something left to do when a run is over."""

    def finish(self) -> None:
        """Refine what `snapshot` shows."""
        ...


@runtime_checkable
class Resumable(Protocol):
    """A pipeline that keeps sessions."""

    def resume(self, folder: Path) -> bool:
        """Go on in the session that a folder holds; False where it holds none.

        Raises:
            SessionError: it cannot be used.
        """
        ...

    def save(self, folder: Path) -> None:
        """Keep the session in a folder.

        Raises:
            SessionError: it cannot be written.
        """
        ...


class PipelineSettings(Protocol):
    """A frozen dataclass of parameters that builds a pipeline."""

    def build(self, T_map_base: SE2 | None = None) -> Pipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the map's origin by default."""
        ...


class LocalizerSettings(Protocol):
    """A frozen dataclass of parameters that builds a pipeline which localises the robot in a finished map."""

    def build(self, known_map: KnownMap, T_map_base: SE2 | None = None) -> Pipeline:
        """Make the pipeline; the robot starts near `T_map_base`, or anywhere in the map when it is None."""
        ...


PIPELINES: dict[str, type[PipelineSettings]] = {
    "odometry": Odometry,
    "icp_odometry": IcpOdometry,
    "lidar": Lidar,
    "rbpf": Rbpf,
    "lidar_slam": LidarSlam,
    "visual_slam": VisualSlam,
    "fusion": Fusion,
}
"""name -> frozen dataclass of parameters."""

LOCALIZERS: dict[str, type[LocalizerSettings]] = {
    "mcl": Mcl,
    "perfect_match": PerfectMatch,
    "amcl": Amcl,
    "localizability": Localizability,
}
"""name -> frozen dataclass of parameters of those that need a map."""


def warm_up(pipeline: Pipeline) -> None:
    """Compile the kernels of such a pipeline, or load them from the disk, so that the first scan of a run does not wait for it.

    The pipeline itself is spoilt: give a fresh one that is not used any more.
    """
    angles = np.linspace(-2.0, 2.0, 90)
    for k in range(4):
        stamp = 0.1 * k
        odometry = tuple(WheelOdometry(stamp + 0.02 * i, SE2(0.5 * (stamp + 0.02 * i))) for i in range(5))
        imu = tuple(Imu(reading.stamp, 0.0) for reading in odometry)
        scan = LaserScan(stamp, np.full(90, 1.0 + 0.1 * k), angles, 1e-4, 0.0, 5.0)
        pipeline.update(SensorFrame(stamp + 0.08, odometry, imu, (scan,), frozenset({"odometry", "imu", "scans"})))


def pipeline_settings(name: str) -> type[PipelineSettings]:
    """The parameter class of a pipeline that makes its own map, if any.

    Raises:
        UnknownNameError: no such pipeline; the message lists those there are.
    """
    if name not in PIPELINES:
        raise UnknownNameError("pipeline", name, sorted([*PIPELINES, *LOCALIZERS]))
    return PIPELINES[name]
