"""What every lidar pipeline does with a scan before it enters a map: deskew, guess, search when surprised, refine."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_not_negative
from slam.mapping.agreement import DISAGREE, MotionAgreement
from slam.matching.blocked_view import blocked
from slam.matching.correlative import Correlative
from slam.matching.gauss_newton import GaussNewton
from slam.matching.match import Match
from slam.matching.surface_field import SurfaceField
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.ego_motion import EgoMotion
from slam.motion.motion_noise import MotionNoise
from slam.scans import PointScan, Unveil
from slam.se2 import SE2, FloatArray

DISTRUST = 1e4
"""Inflation of odometry's covariance when its guess fits nothing."""
LOST_AFTER = 10
"""Unusable matches in a row after which the pose is lost."""
UNMATCHED = "the scan does not match the map"
"""Reason of an estimate."""


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
        self.ego = EgoMotion(settings.unveil, T_local_base)
        self.match: Match | None = None
        """Of the newest scan; None until one has been matched."""
        self.covariance: FloatArray = np.zeros((3, 3))
        """(3, 3) of the newest scan's pose in the local frame [m, rad]."""
        self.misses = 0
        """Unusable matches in a row."""
        self.agreement = MotionAgreement()
        """Between scans and odometry."""
        self._deviation = settings.deviation_start
        self._inflation = 1.0  # of the odometry's covariance, from how far matching has corrected it

    @property
    def T_local_base(self) -> SE2:
        """At the newest scan."""
        return self.ego.T_map_base

    @property
    def motion(self) -> DeadReckoning:
        """What wheels and gyro say."""
        return self.ego.motion

    @property
    def lost(self) -> bool:
        """Too many scans in a row could not be matched."""
        return self.misses >= LOST_AFTER

    @property
    def trouble(self) -> str:
        """What is wrong with the newest scan, or between scans and odometry; empty where nothing is."""
        return UNMATCHED if self.misses else DISAGREE if self.agreement.broken else ""

    @property
    def health(self) -> float:
        """Share of the newest scan's points on known surfaces; 1 before the first."""
        return self.match.inliers if self.match else 1.0

    def track(self, cloud: PointScan, surfaces: SurfaceField | None) -> SE2:
        """`T_local_base` of a scan by matching it to the local map, by the guess where there is none or it says too little."""
        increment, last = self.ego.step(cloud.stamp), self.T_local_base
        guess = last @ increment
        pose = guess if surfaces is None else self._correct(cloud, surfaces, guess, increment)
        if surfaces is not None and not self.misses:
            self.agreement.add(last.inverse() @ pose, increment, self.motion.newest >= cloud.stamp)
        self.ego.settle(cloud.stamp, pose)
        return pose

    def place(self, T_local_base: SE2) -> None:
        """The newest scan is here: the robot has been found by other means."""
        self.ego.place(T_local_base)
        self.misses = 0

    def rebase(self, T_new_local: SE2) -> None:
        """Go on in another local frame."""
        R = np.eye(3)
        R[:2, :2] = T_new_local.rotation()
        self.covariance = R @ self.covariance @ R.T
        self.ego.rebase(T_new_local)

    def at(self, stamp: float) -> tuple[SE2, FloatArray]:
        """`T_local_base` at a time, carried on from the newest scan, and its covariance (3, 3)."""
        step = self.ego.step(stamp)
        return self.T_local_base @ step, self.settings.noise.propagate(self.covariance, self.T_local_base, step)

    def usable(self, match: Match) -> bool:
        """Whether a match says where the robot is."""
        return match.converged and match.inliers >= self.settings.inliers_min

    def _correct(self, cloud: PointScan, surfaces: SurfaceField, guess: SE2, increment: SE2) -> SE2:
        s = self.settings
        prior = s.noise.with_floor(increment) * self._inflation  # in the local frame too: it is the same in x and y
        match = self._refined(cloud, surfaces, guess, prior)
        if not self.usable(match) and (self.lost or not blocked(cloud, surfaces, guess)):  # the guess may be worse than odometry says
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
