"""The `rbpf` pipeline: Grisetti, Stachniss, Burgard, "Improved techniques for grid mapping with Rao-Blackwellized particle filters".

IEEE Transactions on Robotics 23 (2007), algorithm 1; the steps have the paper's names. Every particle has a path and a map of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.depth_scans import DepthScan, Source, scans_of
from slam.errors import require_not_negative, require_positive
from slam.kernels import proposal
from slam.mapping.grid_mapper import FULL
from slam.mapping.particle_maps import ParticleMaps
from slam.mapping.particle_paths import ParticlePaths
from slam.mapping.side_by_side import side_by_side
from slam.messages import Estimate, LaserScan, SensorFrame, Status
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.motion_noise import MotionNoise
from slam.motion.sensor_watch import SensorWatch
from slam.scans import PointScan, deskew
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

BLIND = "the scan has no valid beam"
"""Reason of an estimate."""


@dataclass(frozen=True, slots=True)
class Rbpf:
    """A Rao-Blackwellized particle filter over paths and grid maps."""

    particles: int = 30
    source: Source = "auto"
    """Where scans come from: the lidar, the depth images, or the lidar where there is one."""
    depth: DepthScan = field(default_factory=DepthScan)
    """How a depth image becomes a scan."""
    samples: int = 12
    """K of equation 15: poses about the mode of each particle's likelihood."""
    distance: float = 0.15
    """Way after which the particles are updated [m]."""
    yaw: float = 0.15
    """Turn after which they are updated [rad]."""
    beams: int = 120
    """Most beams by which poses are judged, evenly spread; all of them enter the maps."""
    sigma: float = 0.04
    """Standard deviation of a beam's end from the map [m]."""
    together: float = 8.0
    """Neighbouring beams share the map's errors: so many count as one."""
    inliers_min: float = 0.3
    """Share of beams that must find a counterpart for a scan match to count; below it the motion model proposes."""
    resample_below: float = 0.5
    """Share of the particles below which N_eff calls for resampling."""
    iterations: int = 12
    """Most steps of the scan match."""
    resolution: float = 0.05
    """Cell size [m]."""
    hit: float = 0.6
    """Log-odds of a hit."""
    miss: float = -0.3
    """Log-odds of a cell that a ray crosses."""
    noise: MotionNoise = field(default_factory=MotionNoise)
    seed: int = 0
    """Of the particles' random stream: the same seed gives the same bits."""

    def __post_init__(self) -> None:
        names = ("particles", "samples", "beams", "sigma", "together", "iterations", "resolution", "hit")
        require_positive(self, *names)
        require_not_negative(self, "distance", "yaw", "inliers_min", "resample_below", "seed")

    def build(self, T_map_base: SE2 | None = None) -> RbpfPipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the origin by default."""
        return RbpfPipeline(self, T_map_base or SE2())


class RbpfPipeline:
    """The estimate is the pose of the heaviest particle; between updates odometry carries it."""

    def __init__(self, settings: Rbpf, T_map_base: SE2) -> None:
        self._settings = settings
        self._rng = np.random.default_rng(settings.seed)
        self._motion = DeadReckoning()
        self._watch = SensorWatch()
        self._maps = ParticleMaps(settings.particles, settings.resolution, settings.hit, settings.miss)
        self._paths = ParticlePaths(settings.particles)
        self._poses: FloatArray = np.tile(T_map_base.as_array(), (settings.particles, 1))
        self._log_weights: FloatArray = np.zeros(settings.particles)
        self._best = 0
        self._updated: SE2 | None = None  # T_odom_base at the last update
        self._begun = False
        self._full = self._blind = False

    def update(self, frame: SensorFrame) -> Estimate:
        """Take in one frame; answer with the pose at its stamp."""
        first = self._motion.empty
        self._motion.add(frame.odometry, frame.imu)
        if first and not self._motion.empty and self._updated is not None:
            self._updated = self._motion.pose_at(-np.inf)
        for scan in scans_of(frame, self._settings.source, self._settings.depth):
            self._take(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The heaviest particle's map and path."""
        return Snapshot(self._maps.grid(self._best).frozen_copy(), self._paths.trajectory(self._best))

    def _take(self, scan: LaserScan) -> None:
        cloud = deskew(scan, self._motion.window(scan.stamp))
        T_odom_base = self._motion.pose_at(scan.stamp)
        if self._updated is None:
            self._updated = T_odom_base
        step = self._updated.inverse() @ T_odom_base
        moved = math.hypot(step.x, step.y) >= self._settings.distance or abs(step.yaw) >= self._settings.yaw
        self._blind = len(cloud.points) == 0
        if not self._blind and (moved or not self._begun):
            self._filter(cloud, step)
            self._updated, self._begun, step = T_odom_base, True, SE2()
        carried = np.array([(SE2.from_array(pose) @ step).as_array() for pose in self._poses])
        self._paths.append(scan.stamp, carried)

    def _filter(self, cloud: PointScan, step: SE2) -> None:
        """Algorithm 1: propose, weigh, draw the scan into the maps, resample."""
        if self._begun:
            self._propose(cloud.points, step)
        self._full = not self._maps.insert(self._poses, cloud.points, cloud.origins)
        weights = np.exp(self._log_weights - self._log_weights.max())
        weights /= weights.sum()
        self._best = int(np.argmax(weights))
        if 1.0 / float(np.sum(weights**2)) < self._settings.resample_below * len(weights):
            self._resample(weights)

    def _propose(self, points: FloatArray, step: SE2) -> None:
        s = self._settings
        thinned = np.ascontiguousarray(points[:: math.ceil(len(points) / s.beams)])
        predicted = [SE2.from_array(pose) @ step for pose in self._poses]
        poses = np.array([pose.as_array() for pose in predicted])
        poses[:, :2] -= self._maps.corner
        information = np.asarray(np.linalg.inv(s.noise.with_floor(step)), np.float64)
        beliefs = np.tile(information, (len(poses), 1, 1))  # in the map's frame too: it is the same in x and y
        draws = self._rng.uniform(-1.0, 1.0, (len(poses), s.samples, 3)), self._rng.standard_normal((len(poses), 3))
        gained = np.zeros(len(poses))
        model, limits = (s.resolution, s.sigma, s.together), (s.iterations, s.inliers_min)

        def work(part: slice) -> None:
            some = (draws[0][part], draws[1][part])
            arrays = poses[part], beliefs[part], self._maps.tables[part], self._maps.pool
            proposal.propose(thinned, *arrays, model, limits, some, gained[part])

        side_by_side(work, len(poses))
        poses[:, :2] += self._maps.corner
        self._poses = poses
        self._log_weights += gained

    def _resample(self, weights: FloatArray) -> None:
        """Systematic resampling; who survives keeps path and map."""
        count = len(weights)
        positions = (np.arange(count) + self._rng.random()) / count
        parents = np.minimum(np.searchsorted(np.cumsum(weights), positions), count - 1).astype(np.int64)
        self._poses, self._log_weights = self._poses[parents], np.zeros(count)
        self._best = int(np.flatnonzero(parents == self._best)[0]) if self._best in parents else 0
        self._maps.resample(parents)
        self._paths.resample(parents)

    def _estimate(self, frame: SensorFrame) -> Estimate:
        since = (
            self._updated.inverse() @ self._motion.pose_at(frame.stamp) if self._updated is not None else self._motion.pose_at(frame.stamp)
        )
        pose = SE2.from_array(self._poses[self._best]) @ since
        weights = np.exp(self._log_weights - self._log_weights.max())
        covariance = _spread(self._poses, weights / weights.sum(), self._poses[self._best])
        covariance = self._settings.noise.propagate(covariance, pose @ since.inverse(), since)
        silent = self._watch.silent(frame)  # hears every frame
        reason = (FULL if self._full else BLIND if self._blind else "") or silent
        status = Status.DEGRADED if reason else Status.TRACKING
        return Estimate(frame.stamp, pose, pose @ self._motion.wheels.inverse(), covariance, status, 1.0, reason)


def _spread(poses: FloatArray, weights: FloatArray, about: FloatArray) -> FloatArray:
    """Covariance (3, 3) of weighted poses (N, 3) about one of them."""
    off = poses - about
    off[:, 2] = np.arctan2(np.sin(off[:, 2]), np.cos(off[:, 2]))
    return np.asarray((weights[:, None] * off).T @ off, np.float64)
