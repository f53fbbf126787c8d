"""Two scans to lay over each other: the source report's synthetic check, or two of a recording."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hardware.logs.registry import open_log
from scripts.errors import UsageError
from slam.evaluation.poses import sample
from slam.messages import LaserScan, Trajectory, WheelOdometry
from slam.scans import deskew
from slam.se2 import SE2, FloatArray

DISPLACEMENT = SE2(1.0, 2.0, math.radians(30.0))
"""What the source report moved its points by."""
ROOM = ((-3, -2.5), (1, -2.5), (1, -3.3), (2.4, -3.3), (2.4, -2.5), (5, -2.5), (5, 0.5), (0.8, 0.5), (0.8, 4), (-1, 4.6), (-3, 4))
"""Corners of an L-shaped room with an alcove and a slanting wall; the lidar stands in the origin [m]."""
BEAMS = 720


@dataclass(frozen=True, slots=True)
class ScanPair:
    """Two scans and what is known of the motion between them, each a `T_target_source`."""

    title: str
    source: FloatArray
    """(M, 2) [m]"""
    target: FloatArray
    """(N, 2) [m]"""
    wheels: SE2 | None = None
    """By wheel odometry."""
    truth: SE2 | None = None


def displaced_room() -> ScanPair:
    """The check: a scan all round the room, and the same points moved by (1 m, 2 m, 30 deg). The answer is the inverse of the move."""
    target = _room_scan()
    title = "room scan, moved by 1 m, 2 m, 30 deg"
    return ScanPair(title, DISPLACEMENT.transform(target), target, truth=DISPLACEMENT.inverse())


def recorded_pair(path: Path, target: int, source: int) -> ScanPair:
    """Two scans of a recording by number, deskewed, in `base`.

    Raises:
        RecordingError: the recording cannot be used.
        UsageError: it has no such scans.
    """
    log = open_log(path)
    messages = [event.message for event in log.events()]
    scans = [message for message in messages if isinstance(message, LaserScan)]
    for number in (target, source):
        if not 0 <= number < len(scans):
            raise UsageError(f"--scans {target} {source}: {path} has {len(scans)} scans, the first is number 0")
    odometry = [message for message in messages if isinstance(message, WheelOdometry)]
    poses = np.array([reading.T_odom_base.as_array() for reading in odometry])
    wheels = Trajectory(np.array([reading.stamp for reading in odometry]), poses)
    chosen = (scans[target], scans[source])
    points = [deskew(scan, wheels).points for scan in chosen]
    title = f"{path.name}, scan {source} on scan {target}"
    return ScanPair(title, points[1], points[0], _motion(wheels, *chosen), _motion(log.truth(), *chosen))


def _motion(trajectory: Trajectory | None, target: LaserScan, source: LaserScan) -> SE2 | None:
    """`T_target_source` of the base between two scans; None for a trajectory that is not there."""
    if trajectory is None or len(trajectory) == 0:
        return None
    first, second = sample(trajectory, np.array([target.stamp, source.stamp]))
    return SE2.from_array(first).inverse() @ SE2.from_array(second)


def _room_scan() -> FloatArray:
    """Points (BEAMS, 2) where rays from the origin, all round, meet the room's walls [m]."""
    angles = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])  # (N, 2)
    corners = np.array(ROOM, dtype=np.float64)
    along = np.roll(corners, -1, axis=0) - corners  # (M, 2)
    across = directions[:, :1] * along[:, 1] - directions[:, 1:] * along[:, 0]  # (N, M)
    with np.errstate(divide="ignore", invalid="ignore"):
        ranges = (corners[:, 0] * along[:, 1] - corners[:, 1] * along[:, 0]) / across
        fraction = (corners[:, 0] * directions[:, 1:] - corners[:, 1] * directions[:, :1]) / across
    ranges[~((ranges > 0.0) & (fraction >= 0.0) & (fraction <= 1.0))] = np.inf
    return ranges.min(axis=1)[:, None] * directions
