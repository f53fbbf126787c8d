"""A fixed-lag smoother of poses on a floor. The only file that knows GTSAM.

Its variables are the robot's poses of the last seconds, and where another map lies in this one, which may drift. What leaves the window
is marginalised: Dellaert, Kaess, "Factor graphs for robot perception" (2017), section 5.3.
"""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any

import numpy as np

from slam.errors import SlamError
from slam.mapping.uncertainty import from_body, to_body
from slam.se2 import SE2, FloatArray

OTHER = 1 << 40
"""Keys of the other map's poses begin here; those of the robot at 0."""
EXACT = 1e-12
"""Added to a covariance, so that it has an inverse [m^2, rad^2]."""
ITERATIONS = 5


class FusionLibraryError(SlamError):
    """GTSAM is not installed."""

    def __init__(self) -> None:
        super().__init__("the pipeline 'fusion' needs GTSAM; install it with: pip install 'gtsam>=4.3'")


class Smoother:
    """Poses in one frame; all covariances are of (x, y, yaw) in the frame that the pose is given in, as everywhere but in GTSAM."""

    def __init__(self, lag: float, loss: float, T_map_base: SE2, stamp: float) -> None:
        """Begin where the robot certainly is.

        Args:
            lag: length of the window [s].
            loss: deviations at which a place counts half.
            T_map_base: the robot's pose.
            stamp: at this time [s].

        Raises:
            FusionLibraryError: GTSAM is not installed.
        """
        self._g = library()
        parameters = self._g.LevenbergMarquardtParams()
        parameters.setMaxIterations(ITERATIONS)
        self._smoother: Any = self._g.BatchFixedLagSmoother(lag, parameters)
        self._lag, self._loss = lag, loss
        self._factors: Any = self._g.NonlinearFactorGraph()
        self._values: Any = self._g.Values()
        self._times: Any = self._g.FixedLagSmootherKeyTimestampMap()
        self._newest, self._other = 0, OTHER
        self._way = 0.0  # driven since the other map's pose was last allowed to drift
        self._poses: dict[int, SE2] = {}
        self._T_map_other = SE2()
        self.stamps: dict[int, float] = {}
        """Of the poses in the window [s]."""
        for key, pose in ((0, T_map_base), (OTHER, SE2())):
            self._insert(key, pose, stamp)
            self._factors.add(self._g.PriorFactorPose2(key, _pose2(self._g, pose), self._gaussian(np.zeros((3, 3)), pose)))
        self.stamps[0] = stamp
        self.solve()

    @property
    def newest(self) -> int:
        """Number of the newest pose."""
        return self._newest

    def pose(self, node: int) -> SE2:
        """`T_map_base` of a pose in the window."""
        return self._poses[node]

    @property
    def T_map_other(self) -> SE2:
        """Where the other map lies."""
        return self._T_map_other

    def covariance(self) -> FloatArray:
        """(3, 3) of the newest pose, in the map."""
        marginals = self._g.Marginals(self._smoother.getFactors(), self._smoother.calculateEstimate())
        body = np.asarray(marginals.marginalCovariance(self._newest), dtype=np.float64)
        return from_body(0.5 * (body + body.T), self.pose(self._newest))

    def step(self, stamp: float, step: SE2, covariance: FloatArray) -> None:
        """Add a pose at a time [s] after a step with a covariance (3, 3)."""
        g, before = self._g, self._newest
        pose = self.pose(before) @ step
        self._newest += 1
        self._insert(self._newest, pose, stamp)
        self._factors.add(g.BetweenFactorPose2(before, self._newest, _pose2(g, step), self._gaussian(covariance, step)))
        self._poses[self._newest], self.stamps[self._newest] = pose, stamp
        self._way += float(np.hypot(step.x, step.y)) + abs(step.yaw)

    def place(self, node: int, T_map_base: SE2, covariance: FloatArray) -> None:
        """The robot was here, with a covariance (3, 3)."""
        g = self._g
        self._factors.add(g.PriorFactorPose2(node, _pose2(g, T_map_base), self._robust(covariance, T_map_base)))

    def place_in_other(self, node: int, T_other_base: SE2, covariance: FloatArray) -> None:
        """The robot was here in the other map, with a covariance (3, 3)."""
        g = self._g
        self._factors.add(g.BetweenFactorPose2(self._other, node, _pose2(g, T_other_base), self._robust(covariance, T_other_base)))

    def drift(self, variance: float, every: float) -> None:
        """Let the other map drift by a variance for every metre and radian driven [m^2, rad^2], in steps of so many of these."""
        if self._way < every:
            return
        g, before = self._g, self._other
        self._other += 1
        self._insert(self._other, self._T_map_other, self.stamps[self._newest])
        noise = self._gaussian(np.eye(3) * variance * self._way, SE2())
        self._factors.add(g.BetweenFactorPose2(before, self._other, _pose2(g, SE2()), noise))
        self._way = 0.0

    def solve(self) -> None:
        """Find the poses that agree best with everything in the window."""
        newest = self.stamps[self._newest]
        self._times.insert((self._other, newest))  # the other map never leaves the window
        self._smoother.update(self._factors, self._values, self._times)
        self._factors, self._values = self._g.NonlinearFactorGraph(), self._g.Values()
        self._times = self._g.FixedLagSmootherKeyTimestampMap()
        found = self._smoother.calculateEstimate()
        self.stamps = {node: stamp for node, stamp in self.stamps.items() if found.exists(node)}
        self._poses = {node: _se2(found.atPose2(node)) for node in self.stamps}
        self._T_map_other = _se2(found.atPose2(self._other))

    def _insert(self, key: int, pose: SE2, stamp: float) -> None:
        self._values.insert(key, _pose2(self._g, pose))
        self._times.insert((key, stamp))

    def _gaussian(self, covariance: FloatArray, pose: SE2) -> Any:
        """GTSAM's order: of the body, from the right."""
        return self._g.noiseModel.Gaussian.Covariance(to_body(covariance, pose) + np.eye(3) * EXACT)

    def _robust(self, covariance: FloatArray, pose: SE2) -> Any:
        loss = self._g.noiseModel.mEstimator.Cauchy.Create(self._loss)
        return self._g.noiseModel.Robust.Create(loss, self._gaussian(covariance, pose))


def library() -> ModuleType:
    """GTSAM, which is large and only wanted here.

    Raises:
        FusionLibraryError: it is not installed.
    """
    try:
        return importlib.import_module("gtsam")
    except ImportError as error:
        raise FusionLibraryError from error


def _pose2(g: ModuleType, pose: SE2) -> Any:
    return g.Pose2(pose.x, pose.y, pose.yaw)


def _se2(pose: Any) -> SE2:
    return SE2(float(pose.x()), float(pose.y()), float(pose.theta()))
