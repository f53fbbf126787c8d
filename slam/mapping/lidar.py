"""The `lidar` pipeline: deskew, match to the local map, insert, propagate. No loop closure."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_not_negative
from slam.mapping.agreement import DISAGREE, MotionAgreement
from slam.mapping.grid_mapper import FULL, GridMapper, MapSettings
from slam.matching.correlative import Correlative
from slam.matching.gauss_newton import GaussNewton
from slam.matching.match import Match
from slam.messages import Estimate, LaserScan, SensorFrame, Status, Trajectory
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.keyframes import KeyframeGate
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import PointScan, Unveil, deskew
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

DISTRUST = 1e4
"""Inflation of odometry's covariance when its guess fits nothing."""
DROP, GAIN = 0.8, 0.1
"""Inliers below DROP of what they were of late, at a pose that odometry does not expect, make a search worth while, whose answer must
have this much more of them."""
CHI2_99 = 11.34
"""99 % point of chi-square with 3 degrees of freedom."""
LOST_AFTER = 10
"""Unusable matches in a row after which the pose is lost."""


@dataclass(frozen=True, slots=True)
class Lidar:
    """Lidar odometry against its own growing map."""

    unveil: Unveil = field(default_factory=Unveil)
    map: MapSettings = field(default_factory=MapSettings)
    matcher: GaussNewton = field(default_factory=GaussNewton)
    search: Correlative = field(default_factory=Correlative)
    noise: MotionNoise = field(default_factory=MotionNoise)
    keyframes: KeyframeGate = field(default_factory=KeyframeGate)
    search_above: float = 0.2
    """Expected error of the guess from which the window is searched before refining [m]."""
    inliers_min: float = 0.3
    """Share of a scan's points that must lie on a known surface for its match to count."""
    deviation_start: float = 0.1
    """Expected error of the first guess [m]; then it follows the corrections that matching makes."""

    def __post_init__(self) -> None:
        require_not_negative(self, "search_above", "inliers_min", "deviation_start")

    def build(self, T_map_base: SE2 | None = None) -> LidarPipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the origin by default."""
        return LidarPipeline(self, T_map_base or SE2())


class LidarPipeline:
    """Keeps `T_map_odom` right by matching every scan; between scans wheels and gyro carry the pose."""

    def __init__(self, settings: Lidar, T_map_base: SE2) -> None:
        self._settings = settings
        self._motion = DeadReckoning()
        self._watch = SensorWatch()
        self._mapper = GridMapper(settings.map)
        self._path = ScanTrajectory()
        self._last: tuple[float, SE2, SE2] | None = None  # stamp, T_odom_base and T_map_base of the last scan
        self._velocity = np.zeros(3)
        self._steady = SE2()  # guess at constant velocity
        self._typical = 1.0  # share of inliers of late
        self._T_map_odom = T_map_base
        self._covariance = np.zeros((3, 3))
        self._keyframe: SE2 | None = None
        self._deviation = settings.deviation_start
        self._inflation = 1.0  # of the odometry's covariance, from how far matching has corrected it
        self._match: Match | None = None
        self._agreement = MotionAgreement()  # between scans and odometry
        self._misses = 0  # unusable matches in a row

    def update(self, frame: SensorFrame) -> Estimate:
        """Register the frame's scans and answer with the pose at the frame's time."""
        first = self._motion.empty
        self._motion.add(frame.odometry, frame.imu)
        if first and not self._motion.empty:
            self._begin_odometry(self._motion.pose_at(-np.inf))
        for scan in frame.scans:
            self._register(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The map and the poses at scans so far."""
        return Snapshot(self._mapper.snapshot(), self._path.trajectory())

    def _begin_odometry(self, T_odom_base: SE2) -> None:
        """The odometry's first pose is where the robot is now, even when scans came before it."""
        self._T_map_odom = self._T_map_odom @ T_odom_base.inverse()
        if self._last is not None:
            self._last = (self._last[0], T_odom_base, self._last[2])

    def _register(self, scan: LaserScan) -> None:
        cloud = deskew(self._settings.unveil.clean(scan), self._during(scan))
        T_odom_base = self._motion.pose_at(scan.stamp)
        guess, increment = self._predict(scan.stamp, T_odom_base)
        T_map_base = self._correct(cloud, guess, increment)
        self._T_map_odom = T_map_base @ T_odom_base.inverse()
        if self._last is not None and scan.stamp > self._last[0]:
            step = self._last[2].inverse() @ T_map_base
            self._velocity = step.log() / (scan.stamp - self._last[0])
            if not self._misses:
                self._agreement.add(step, self._last[1].inverse() @ T_odom_base, self._motion.newest >= scan.stamp)
        self._last = (scan.stamp, T_odom_base, T_map_base)
        self._path.append(scan.stamp, T_map_base)
        if len(cloud.points) > 0 and self._settings.keyframes.passes(self._keyframe, T_map_base):
            self._mapper.insert(T_map_base, cloud.points, cloud.origins)
            self._keyframe = self._keyframe if self._mapper.full else T_map_base

    def _predict(self, stamp: float, T_odom_base: SE2) -> tuple[SE2, SE2]:
        """Guess `T_map_base` and the step since the last scan: by odometry, without it at constant velocity."""
        if self._last is None:
            return self._T_map_odom @ T_odom_base, SE2()
        last_stamp, T_odom_last, T_map_last = self._last
        step, steady = T_odom_last.inverse() @ T_odom_base, self._carried_on(last_stamp, stamp)
        self._steady = T_map_last @ steady
        if self._motion.newest <= last_stamp:
            step = steady
        return T_map_last @ step, step

    def _during(self, scan: LaserScan) -> Trajectory:
        """The robot's motion around a sweep: by odometry, without it as it went on from scan to scan."""
        if self._last is None or self._motion.newest > self._last[0]:
            return self._motion.window(scan.stamp)
        end = self._carried_on(scan.stamp, scan.end)
        return Trajectory(np.array([scan.stamp, scan.end]), np.array([np.zeros(3), end.as_array()]))

    def _carried_on(self, start: float, end: float) -> SE2:
        """The step between two times [s] at the last velocity, turned by the gyro where it speaks."""
        xi, turn = self._velocity * (end - start), self._motion.gyro_turn(start, end)
        return SE2.exp(xi if turn is None else np.array([xi[0], xi[1], turn]))

    def _correct(self, cloud: PointScan, guess: SE2, increment: SE2) -> SE2:
        """Match the scan; keep the guess where the map says too little."""
        if self._last is None:
            return guess
        s = self._settings
        prior = s.noise.with_floor(increment) * self._inflation
        prior[:2, :2] = guess.rotation() @ prior[:2, :2] @ guess.rotation().T
        match = self._attempt(cloud, guess, prior, 3.0 * self._deviation > s.search_above)
        if self._doubtful(match, guess, prior):
            match = self._second_thoughts(cloud, guess, prior * DISTRUST, match)
        self._typical += 0.1 * (match.inliers - self._typical)
        self._match = match
        self._misses = 0 if self._usable(match) else self._misses + 1
        if self._misses:
            self._covariance = s.noise.propagate(self._covariance, guess @ increment.inverse(), increment)
            return guess
        correction = guess.inverse() @ match.T_target_source
        # KISS-ICP, Vizzo et al. (2023), eq. 8: how far a point moves at most by the correction
        reach = float(np.sqrt(np.mean(cloud.points**2) * 2.0))
        size = float(np.hypot(correction.x, correction.y)) + 2.0 * reach * abs(np.sin(0.5 * correction.yaw))
        self._deviation = float(np.sqrt(0.9 * self._deviation**2 + 0.1 * size**2))
        surprise = correction.as_array() @ np.linalg.solve(s.noise.with_floor(increment), correction.as_array()) / 3.0
        self._inflation = max(0.9 * self._inflation + 0.1 * float(surprise), 1.0)
        self._covariance = np.array(match.covariance)
        return match.T_target_source

    def _doubtful(self, match: Match, guess: SE2, prior: FloatArray) -> bool:
        """Whether the guess may be worse than odometry says. A scan that fits less, where odometry expects it, sees a new room."""
        return not self._usable(match) or (match.inliers < DROP * self._typical and not _agrees(match.T_target_source, guess, prior))

    def _second_thoughts(self, cloud: PointScan, guess: SE2, prior: FloatArray, first: Match) -> Match:
        """The best of the first match and of searches around odometry's guess and the one at constant velocity."""
        best = first
        for centre in (guess, self._steady):
            match = self._attempt(cloud, centre, prior, True)
            if self._usable(match) and (not self._usable(best) or match.inliers > best.inliers + GAIN):
                best = match
        return best

    def _attempt(self, cloud: PointScan, guess: SE2, prior: FloatArray, search: bool) -> Match:
        """One match, from the guess or from the best pose of the window around it."""
        s, field = self._settings, self._mapper.field
        if not search:
            return s.matcher.match(field, cloud.points, guess, prior, 3.0 * self._deviation)
        start = s.search.search(field, cloud.points, guess, prior)
        return s.matcher.match(field, cloud.points, guess, prior, s.search_above, start)

    def _usable(self, match: Match) -> bool:
        return match.converged and match.inliers >= self._settings.inliers_min

    def _estimate(self, frame: SensorFrame) -> Estimate:
        pose, covariance = self._T_map_odom @ self._motion.pose_at(frame.stamp), self._covariance
        if self._last is not None:
            step = self._last[2].inverse() @ pose
            covariance = self._settings.noise.propagate(covariance, self._last[2], step)
        reason = self._watch.silent(frame) or (DISAGREE if self._agreement.broken else "")
        if self._match is not None and not self._usable(self._match):
            reason = "the scan does not match the map"
        if self._mapper.full:
            reason = FULL
        status = Status.LOST if self._misses >= LOST_AFTER else Status.DEGRADED if reason else Status.TRACKING
        health = self._match.inliers if self._match else 1.0
        return Estimate(frame.stamp, pose, pose @ self._motion.wheels.inverse(), covariance, status, health, reason)


def _agrees(T_map_base: SE2, guess: SE2, prior: FloatArray) -> bool:
    """Whether a pose is within the 99 % ellipsoid of its prior: who sees little known there has come round a corner."""
    off = np.array([T_map_base.x - guess.x, T_map_base.y - guess.y, (guess.inverse() @ T_map_base).yaw])
    return float(off @ np.linalg.solve(prior, off)) < CHI2_99
