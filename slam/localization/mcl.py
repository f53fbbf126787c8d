"""The `mcl` pipeline: Monte-Carlo localization as the source papers compare with it. The named baseline of all localizers.

Thrun, Burgard, Fox, Probabilistic Robotics (2005), table 8.2: a fixed number of particles, a few beams, a Gaussian likelihood
field, resampling at every update. No recovery, no polish, and nothing that people walking by could not spoil.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_not_negative, require_positive
from slam.localization.beams import evenly
from slam.localization.health import NOT_HERE, UNSUPPORTED, HealthWatch
from slam.localization.known_map import KnownMap
from slam.localization.motion_models import ConstantVelocity, OdometryMotion
from slam.localization.particles import Particles
from slam.localization.places import trouble_at
from slam.localization.resampling import parents
from slam.localization.sensor_models import Likelihood, LikelihoodField
from slam.messages import Estimate, LaserScan, SensorFrame, Status
from slam.motion.ego_motion import EgoMotion
from slam.motion.keyframes import KeyframeGate
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import PointScan, Unveil
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class GaussianField(LikelihoodField):
    """The likelihood field without room for what the map does not know."""

    sigma_hit: float = 0.2
    """Standard deviation of a beam's end from the nearest surface [m]."""
    z_hit: float = 1.0
    """Share of beams that end on what the map knows."""
    z_rand: float = 0.0
    """Share of beams that end anywhere."""


@dataclass(frozen=True, slots=True)
class Mcl:
    """Monte-Carlo localization with a fixed number of particles."""

    particles: int = 2000
    beams: int = 60
    """Most beams that weigh a particle, evenly spread over the valid ones; 0 takes all."""
    motion: OdometryMotion = field(default_factory=OdometryMotion)
    sensor: GaussianField = field(default_factory=GaussianField)
    update: KeyframeGate = field(default_factory=lambda: KeyframeGate(0.05, 0.1))
    """Motion after which the particles are updated; the spread of the motion model depends on it."""
    start_position: float = 0.1
    """Standard deviation of the told start [m]."""
    start_yaw: float = 0.1
    """Standard deviation of the told start's heading [rad]."""
    seed: int = 0
    """Of the particles' random stream: the same seed gives the same bits."""

    def __post_init__(self) -> None:
        require_positive(self, "particles")
        require_not_negative(self, "beams", "start_position", "start_yaw", "seed")

    def build(self, known_map: KnownMap, T_map_base: SE2 | None = None) -> MclPipeline:
        """Make the pipeline; the robot starts near `T_map_base`, or anywhere in the map when it is None."""
        return MclPipeline(self, known_map, T_map_base)


class MclPipeline:
    """The estimate is the mean of all particles; between updates odometry carries it."""

    def __init__(self, settings: Mcl, known_map: KnownMap, T_map_base: SE2 | None) -> None:
        self._settings = settings
        self._map = known_map
        self._picture = known_map.grid.frozen_copy()
        self._rng = np.random.default_rng(settings.seed)
        if T_map_base is None:
            self._particles = Particles.anywhere(known_map, settings.particles, self._rng)
        else:
            spread = np.diag([settings.start_position**2, settings.start_position**2, settings.start_yaw**2])
            self._particles = Particles.about(T_map_base, spread, settings.particles, self._rng)
        self._ego = EgoMotion(Unveil(sigmas=0.0), T_map_base or self._particles.mean())
        self._watch = SensorWatch()
        self._path = ScanTrajectory()
        self._likelihood: Likelihood | None = None
        self._covariance = self._particles.covariance(self._ego.T_map_base)
        self._way: SE2 = SE2()  # since the last update
        self._duration = 0.0
        self._trouble, self._health, self._begun = "", 1.0, False
        self._support = HealthWatch(UNSUPPORTED)

    def update(self, frame: SensorFrame) -> Estimate:
        """Take in one frame; answer with the pose at its stamp."""
        self._ego.hear(frame)
        for scan in frame.scans:
            self._take(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The map, the poses at scans and the particles, as they were at the newest update."""
        return Snapshot(self._picture, self._path.trajectory(), self._particles.as_rows())

    def _take(self, scan: LaserScan) -> None:
        cloud, by_wheels = self._ego.points(scan), self._ego.wheels_cover(scan.stamp)
        step = self._ego.step(scan.stamp)
        self._way, self._duration = self._way @ step, self._duration + max(self._ego.since(scan.stamp), 0.0)
        pose = self._ego.T_map_base @ step
        self._trouble = "" if len(cloud.points) else "the scan shows nothing"
        if len(cloud.points) and (not by_wheels or not self._begun or self._settings.update.passes(SE2(), self._way)):
            pose = self._filter(cloud, scan.range_max, by_wheels)
        else:
            self._covariance = MotionNoise().propagate(self._covariance, self._ego.T_map_base, step)
        if len(cloud.points):
            self._support.add(scan.stamp, self._map.share_on_walls(pose, cloud.points))
        self._ego.settle(scan.stamp, pose)
        self._path.append(scan.stamp, pose)

    def _filter(self, cloud: PointScan, range_max: float, by_wheels: bool) -> SE2:
        """Table 8.2: sample the motion, weigh, resample; the mean is taken before the draw adds its noise."""
        s = self._settings
        if self._likelihood is None:
            self._likelihood = s.sensor.over(self._map, range_max)
        motion = s.motion if by_wheels else ConstantVelocity()
        poses = motion.sample(self._particles.poses, self._way, self._duration, self._rng)
        cloud = evenly(cloud, s.beams)
        log_likelihoods = self._likelihood.log(poses, cloud, np.ones(len(cloud.points)))
        weighed = Particles(poses, log_likelihoods)
        mean = weighed.mean()
        self._covariance = weighed.covariance(mean)
        self._health = math.exp(float(log_likelihoods.max()) / len(cloud.points))
        self._particles = Particles.equal(poses[parents(weighed.weights, len(poses), self._rng)])
        self._way, self._duration, self._begun = SE2(), 0.0, True
        return mean

    def _estimate(self, frame: SensorFrame) -> Estimate:
        step = self._ego.step(frame.stamp)
        pose = self._ego.T_map_base @ step
        covariance: FloatArray = MotionNoise().propagate(self._covariance, self._ego.T_map_base, step)
        lost = NOT_HERE if self._support.lost else ""
        reasons = lost, self._watch.silent(frame), without_wheels(self._ego, frame), self._trouble, trouble_at(self._map, pose)
        reason = "; ".join(dict.fromkeys(reason for reason in reasons if reason))
        status = Status.LOST if lost else Status.DEGRADED if reason else Status.TRACKING
        T_map_odom = pose @ self._ego.motion.wheels.inverse()
        return Estimate(frame.stamp, pose, T_map_odom, covariance, status, self._health, reason)


def without_wheels(ego: EgoMotion, frame: SensorFrame) -> str:
    """Says that the body has no wheel odometry, once there would have been some; a silent one is `SensorWatch`'s."""
    missing = ego.motion.empty and "odometry" not in frame.available
    return "no wheel odometry: the robot is taken to go on as it did" if missing else ""
