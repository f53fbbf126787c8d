"""Other people's scan matchers on the same pairs: karto-scanmatcher, and ICP of small_gicp on points at z = 0."""

from __future__ import annotations

import math
from collections.abc import Callable

import karto_scanmatcher as karto
import numpy as np
import small_gicp

from hardware.spec import LidarSpec
from slam.se2 import SE2, FloatArray

T_BASE_LASER = SE2(float(LidarSpec().T_base_laser.t[0]), float(LidarSpec().T_base_laser.t[1]))
PEERS: dict[str, Callable[[FloatArray, FloatArray, SE2], Callable[[], SE2]]] = {}
"""name -> from source, target and guess to the work that finds T_target_source."""


def _small_gicp(source: FloatArray, target: FloatArray, guess: SE2) -> Callable[[], SE2]:
    """ICP with its trees, and the distances that suit it best: from 2 cm of thinning and 10 cm on its error grows to four times this."""
    flat = [np.column_stack([points, np.zeros(len(points))]) for points in (target, source)]
    start = np.eye(4)
    start[:2, :2], start[:2, 3] = guess.rotation(), (guess.x, guess.y)

    def work() -> SE2:
        found = small_gicp.align(*flat, start, registration_type="ICP", downsampling_resolution=0.02, max_correspondence_distance=0.1)
        T = found.T_target_source
        return SE2(T[0, 3], T[1, 3], math.atan2(T[1, 0], T[0, 0]))

    return work


def _karto(source: FloatArray, target: FloatArray, guess: SE2) -> Callable[[], SE2]:
    """The matcher of slam_toolbox: coarse and fine search, with its own defaults."""
    spec = LidarSpec()
    limits = (spec.angles[0], spec.angles[-1], spec.angle_increment, spec.range_min, spec.range_max, spec.range_max)
    laser = karto.LaserScanConfig(*limits, "laser")
    scans = [_karto_scan(laser, points, pose @ T_BASE_LASER, k) for k, (points, pose) in enumerate([(target, SE2()), (source, guess)])]
    matcher = karto.Wrapper(karto.ScanMatcherConfig())

    def work() -> SE2:
        best = matcher.match_scan(scans[1], [scans[0]], True, True).best_pose
        return SE2(best.x, best.y, best.yaw) @ T_BASE_LASER.inverse()

    return work


def _karto_scan(laser: object, points: FloatArray, pose: SE2, number: int) -> object:
    """A scan of Karto's: ranges of all beams, the longest where nothing was seen."""
    spec, seen = LidarSpec(), points - [T_BASE_LASER.x, T_BASE_LASER.y]
    ranges = np.full(spec.beams, spec.range_max)
    beams = np.rint((np.arctan2(seen[:, 1], seen[:, 0]) - spec.angles[0]) / spec.angle_increment).astype(int)
    ranges[np.clip(beams, 0, spec.beams - 1)] = np.hypot(seen[:, 0], seen[:, 1])
    both = (karto.Pose2(pose.x, pose.y, pose.yaw), karto.Pose2(pose.x, pose.y, pose.yaw))
    return karto.LocalizedRangeScan(laser, ranges.tolist(), *both, number, float(number))


PEERS.update({"small_gicp ICP": _small_gicp, "karto-scanmatcher": _karto})
