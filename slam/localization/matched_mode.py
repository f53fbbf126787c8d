"""The best mode of a set of particles, matched to the map: as exact as scan matching, as robust as the set."""

from __future__ import annotations

import numpy as np

from slam.localization.clusters import Cluster
from slam.localization.known_map import KnownMap
from slam.matching.gauss_newton import GaussNewton
from slam.matching.match import Match
from slam.motion.motion_noise import MotionNoise
from slam.se2 import SE2, FloatArray, wrap_angle

SAME = 16.27
"""Squared distance at which two poses are told apart: chi-square of three degrees of freedom at 99.9 %."""


class MatchedMode:
    """The best mode and the pose matched from it, carried on by odometry from scan to scan."""

    def __init__(self, known_map: KnownMap, matcher: GaussNewton | None, noise: MotionNoise, start: tuple[SE2, FloatArray]) -> None:
        """Begin at a pose and its covariance (3, 3).

        Args:
            known_map: to match to.
            matcher: how; without it the pose is the mode's mean.
            noise: how covariances grow on the way.
            start: of both.
        """
        self._map, self._matcher, self._noise = known_map, matcher, noise
        self._mode = start
        self._carried = start
        self.covariance: FloatArray = start[1]
        """(3, 3) of the pose at the newest scan, in the map [m, rad]."""

    def carry(self, before: SE2, step: SE2) -> None:
        """Go on from the pose `before` by a step of odometry."""
        self._mode = self._mode[0] @ step, self._noise.propagate(self._mode[1], self._mode[0], step)
        self.covariance = self._noise.propagate(self.covariance, before, step)
        self._carried = before @ step, self.covariance

    def follow(self, mode: Cluster) -> None:
        """Take this for the best mode from now on."""
        self._mode = mode.T_map_base, mode.covariance

    def move_to(self, mode: Cluster) -> None:
        """Believe the robot in this mode, wherever it was believed before."""
        self._carried = self._mode = mode.T_map_base, mode.covariance

    def match(self, points: FloatArray) -> SE2:
        """The pose at which points (M, 2) in base [m] lie on the map's surfaces; that of the mode where they do not say.

        The prior is the pose before, carried on, as long as it lies in the best mode: the mean of a set that is drawn again and
        again wanders where the scan does not hold it, along a corridor.
        """
        found = self._matched(points)
        self.covariance = self._mode[1] if found is None else np.array(found.covariance)
        return self._mode[0] if found is None else found.T_target_source

    def _matched(self, points: FloatArray) -> Match | None:
        if self._matcher is None:
            return None
        guess, covariance = self._carried if _agree(self._carried, self._mode) else self._mode
        prior = covariance + self._noise.with_floor(SE2())
        match = self._matcher.match(self._map.field, points, guess, prior, self._matcher.kernel_max)
        return match if match.converged and bool(np.isfinite(match.covariance).all()) else None


def _agree(a: tuple[SE2, FloatArray], b: tuple[SE2, FloatArray]) -> bool:
    """Whether two poses with covariances (3, 3) may be the same one."""
    off = a[0].as_array() - b[0].as_array()
    off[2] = wrap_angle(float(off[2]))
    return bool(off @ np.linalg.solve(a[1] + b[1], off) < SAME)
