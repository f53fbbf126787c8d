"""What every lidar pipeline does with a scan before it enters a map: deskew, guess, search when surprised, refine."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_not_negative
from slam.mapping.agreement import MotionAgreement
from slam.matching.correlative import Correlative
from slam.matching.gauss_newton import GaussNewton
from slam.matching.match import Match
from slam.matching.surface_field import SurfaceField
from slam.messages import Imu, LaserScan, Trajectory, WheelOdometry
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.motion_noise import MotionNoise
from slam.scans import PointScan, Unveil, deskew
from slam.se2 import SE2, FloatArray

DISTRUST = 1e4
"""Inflation of odometry's covariance when its guess fits nothing."""
LOST_AFTER = 10
"""Unusable matches in a row after which the pose is lost."""


@dataclass(frozen=True, slots=True)
class Tracking:
    """How a scan is matched to a local map."""

    unveil: Unveil = field(default_factory=Unveil)
    matcher: GaussNewton = field(default_factory=GaussNewton)
    search: Correlative = field(default_factory=Correlative)
    noise: MotionNoise = field(default_factory=MotionNoise)
    search_above: float = 0.2
    """Expected error of the guess from which the window is searched before refining [m]."""
    inliers_min: float = 0.3
    """Share of a scan's points that must lie on a known surface for its match to count."""
    settled_min: float = 0.7
    """Share of points on known surfaces above which a refined guess needs no search."""
    deviation_start: float = 0.1
    """Expected error of the first guess [m]; then it follows the corrections that matching makes."""

    def __post_init__(self) -> None:
        require_not_negative(self, "search_above", "inliers_min", "settled_min", "deviation_start")


class FrontEnd:
    """Tracks the robot in the frame of one local map, which it does not own; `rebase` moves it into another one's frame."""

    def __init__(self, settings: Tracking, T_local_base: SE2) -> None:
        self.settings = settings
        self.motion = DeadReckoning()
        self.match: Match | None = None
        """Of the newest scan; None until one has been matched."""
        self.covariance: FloatArray = np.zeros((3, 3))
        """(3, 3) of the newest scan's pose in the local frame [m, rad]."""
        self.misses = 0
        """Unusable matches in a row."""
        self.agreement = MotionAgreement()
        """Between scans and odometry."""
        self.T_local_odom = T_local_base
        self._last: tuple[float, SE2, SE2] | None = None  # stamp, T_odom_base and T_local_base of the last scan
        self._velocity = np.zeros(3)
        self._deviation = settings.deviation_start
        self._inflation = 1.0  # of the odometry's covariance, from how far matching has corrected it

    @property
    def T_local_base(self) -> SE2:
        """At the newest scan."""
        return self._last[2] if self._last else self.T_local_odom

    @property
    def lost(self) -> bool:
        """Too many scans in a row could not be matched."""
        return self.misses >= LOST_AFTER

    def hear(self, odometry: tuple[WheelOdometry, ...], imu: tuple[Imu, ...]) -> None:
        """Take in wheels and gyro; the odometry's first pose is where the robot is now, even when scans came before it."""
        first = self.motion.empty
        self.motion.add(odometry, imu)
        if first and not self.motion.empty:
            T_odom_base = self.motion.pose_at(-np.inf)
            self.T_local_odom = self.T_local_odom @ T_odom_base.inverse()
            if self._last is not None:
                self._last = (self._last[0], T_odom_base, self._last[2])

    def points(self, scan: LaserScan) -> PointScan:
        """The scan as points in base at its stamp: swept by wheels and gyro, without them at constant velocity."""
        scan = self.settings.unveil.clean(scan)
        if self._last is None or self.motion.newest > self._last[0]:
            return deskew(scan, self.motion.window(scan.stamp))
        swept = SE2.exp(self._velocity * (scan.end - scan.stamp))
        return deskew(scan, Trajectory(np.array([scan.stamp, max(scan.end, scan.stamp + 1e-6)]), np.array([np.zeros(3), swept.as_array()])))

    def track(self, cloud: PointScan, surfaces: SurfaceField | None) -> SE2:
        """`T_local_base` of a scan by matching it to the local map, by the guess where there is none or it says too little."""
        T_odom_base = self.motion.pose_at(cloud.stamp)
        guess, increment = self._predict(cloud.stamp, T_odom_base)
        pose = guess if surfaces is None else self._correct(cloud, surfaces, guess, increment)
        self.T_local_odom = pose @ T_odom_base.inverse()
        if self._last is not None and cloud.stamp > self._last[0]:
            step = self._last[2].inverse() @ pose
            self._velocity = step.log() / (cloud.stamp - self._last[0])
            if surfaces is not None and not self.misses:
                self.agreement.add(step, self._last[1].inverse() @ T_odom_base, self.motion.newest >= cloud.stamp)
        self._last = (cloud.stamp, T_odom_base, pose)
        return pose

    def place(self, T_local_base: SE2) -> None:
        """The newest scan is here: the robot has been found by other means."""
        T_odom_base = self._last[1] if self._last else SE2()
        self.T_local_odom = T_local_base @ T_odom_base.inverse()
        if self._last is not None:
            self._last = (*self._last[:2], T_local_base)
        self.misses, self._velocity = 0, np.zeros(3)

    def rebase(self, T_new_local: SE2) -> None:
        """Go on in another local frame."""
        R = np.eye(3)
        R[:2, :2] = T_new_local.rotation()
        self.covariance = R @ self.covariance @ R.T
        self.T_local_odom = T_new_local @ self.T_local_odom
        if self._last is not None:
            self._last = (*self._last[:2], T_new_local @ self._last[2])

    def at(self, stamp: float) -> tuple[SE2, FloatArray]:
        """`T_local_base` at a time, carried on from the newest scan by wheels and gyro, and its covariance (3, 3)."""
        pose = self.T_local_odom @ self.motion.pose_at(stamp)
        step = self.T_local_base.inverse() @ pose
        return pose, self.settings.noise.propagate(self.covariance, self.T_local_base, step)

    def usable(self, match: Match) -> bool:
        """Whether a match says where the robot is."""
        return match.converged and match.inliers >= self.settings.inliers_min

    def _predict(self, stamp: float, T_odom_base: SE2) -> tuple[SE2, SE2]:
        """Guess and step since the last scan: by odometry, without it at constant velocity."""
        if self._last is None:
            return self.T_local_odom @ T_odom_base, SE2()
        last_stamp, T_odom_last, T_local_last = self._last
        step = T_odom_last.inverse() @ T_odom_base
        if self.motion.newest <= last_stamp:
            step = SE2.exp(self._velocity * (stamp - last_stamp))
        return T_local_last @ step, step

    def _correct(self, cloud: PointScan, surfaces: SurfaceField, guess: SE2, increment: SE2) -> SE2:
        s = self.settings
        prior = s.noise.with_floor(increment) * self._inflation
        prior[:2, :2] = guess.rotation() @ prior[:2, :2] @ guess.rotation().T
        match = self._refined(cloud, surfaces, guess, prior)
        if not self.usable(match):  # the guess may be worse than odometry says
            match = self._searched(cloud, surfaces, guess, prior * DISTRUST)
        self.match = match
        self.misses = 0 if self.usable(match) else self.misses + 1
        if self.misses:
            self.covariance = s.noise.propagate(self.covariance, guess @ increment.inverse(), increment)
            return guess
        self._learn(cloud, guess.inverse() @ match.T_target_source, increment)
        self.covariance = np.array(match.covariance)
        return match.T_target_source

    def _refined(self, cloud: PointScan, surfaces: SurfaceField, guess: SE2, prior: FloatArray) -> Match:
        """Matched from the guess; where guesses have lately been bad and this one fits little, from the best pose of a window."""
        s = self.settings
        match = s.matcher.match(surfaces, cloud.points, guess, prior, 3.0 * self._deviation)
        if 3.0 * self._deviation <= s.search_above or (match.converged and match.inliers >= s.settled_min):
            return match
        return self._searched(cloud, surfaces, guess, prior)

    def _searched(self, cloud: PointScan, surfaces: SurfaceField, guess: SE2, prior: FloatArray) -> Match:
        """Matched from the best pose of the window about the guess."""
        s = self.settings
        start = s.search.search(surfaces, cloud.points, guess, prior)
        return s.matcher.match(surfaces, cloud.points, guess, prior, s.search_above, start)

    def _learn(self, cloud: PointScan, correction: SE2, increment: SE2) -> None:
        """How wrong guesses are: KISS-ICP, Vizzo et al. (2023), eq. 8, how far a point moves at most by the correction."""
        reach = float(np.sqrt(np.mean(cloud.points**2) * 2.0))
        size = float(np.hypot(correction.x, correction.y)) + 2.0 * reach * abs(np.sin(0.5 * correction.yaw))
        self._deviation = float(np.sqrt(0.9 * self._deviation**2 + 0.1 * size**2))
        step = correction.as_array()
        surprise = step @ np.linalg.solve(self.settings.noise.with_floor(increment), step) / 3.0
        self._inflation = max(0.9 * self._inflation + 0.1 * float(surprise), 1.0)
