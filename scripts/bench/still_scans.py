"""Scans at any pose of a simulated world, without driving there: what pairs for matching are made of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hardware.spec import LidarSpec
from sim.lidar import FIRST_STEP, Lidar, static_rays
from sim.motion import Motion
from sim.realism import read_realism
from slam.messages import LaserScan, Trajectory
from slam.scans import deskew
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3
from worlds.loader import load_world
from worlds.world import World

ROOM = 0.25
"""Clearance that the robot needs to stand somewhere [m]."""

RANGE_NOISE = (0.01, 0.01)
"""Standard deviation of a range by the data sheet: least [m], and as a share of it."""
DIFFERENCE, EDGE = 0.01, 0.003
"""Step of a difference [m or rad], and a second difference that no surface has [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class StillPair:
    """Two scans of a robot that stood still for each."""

    source: FloatArray
    """(M, 2) [m] in base."""
    target: FloatArray
    """(N, 2) [m] in base."""
    T_target_source: SE2
    """The truth."""
    T_world_target: SE2


class StillScans:
    """A world with a lidar that is put where it is wanted."""

    def __init__(self, world: str, realism: str = "datasheet") -> None:
        self.world: World = load_world(world)
        self._spec = LidarSpec()
        self._realism = read_realism(realism)
        self._rays, self._through_glass = static_rays(self.world)

    def lidar(self, rng: np.random.Generator) -> Lidar:
        """A device of its own: its bias is drawn, its noise will be."""
        return Lidar(self._spec, self._realism, self._rays, (), rng, self._through_glass)

    def points(self, lidar: Lidar, pose: SE2) -> FloatArray:
        """Hits (M, 2) [m] in base of one scan at `pose` in the world."""
        return deskew(self.scan(lidar, pose), Trajectory(np.empty(0), np.empty((0, 3)))).points

    def scan(self, lidar: Lidar, pose: SE2) -> LaserScan:
        """One scan at `pose` in the world."""
        motion = Motion(0, SE3())
        half = 0.5 * pose.yaw
        motion.append([(pose.x, pose.y, 0.0, 0.0, 0.0, math.sin(half), math.cos(half), 0.0, 0.0)] * 60)
        return lidar.scan(motion, FIRST_STEP * self._spec.time_increment)

    def information(self, pose: SE2) -> FloatArray:
        """Fisher information (3, 3) of a scan's ranges about (x, y, yaw) of `pose`, in the world: Censi (2007), on the true walls."""
        here = self._ranges(pose)
        gradient = np.empty((len(here), 3))
        known = here <= self._spec.range_max
        for axis, step in enumerate(np.eye(3) * DIFFERENCE):
            ahead, behind = (self._ranges(SE2.from_array(pose.as_array() + side * step)) for side in (1.0, -1.0))
            with np.errstate(invalid="ignore"):
                known &= np.abs(ahead - 2.0 * here + behind) < EDGE
                gradient[:, axis] = (ahead - behind) / (2.0 * DIFFERENCE)
        J = gradient[known] / np.maximum(RANGE_NOISE[0], RANGE_NOISE[1] * here[known])[:, None]
        return J.T @ J

    def _ranges(self, pose: SE2) -> FloatArray:
        """True ranges (N,) of the beams of a lidar at `pose` [m]."""
        mount = self._spec.T_base_laser
        x, y = pose.transform(mount.t[None, :2])[0]
        bearings = pose.yaw + self._spec.angles
        directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))]).astype(np.float32)
        origins = np.tile(np.array([x, y, mount.t[2]], np.float32), (len(bearings), 1))
        return self._rays.cast(origins, directions, 1.5 * self._spec.range_max).astype(np.float64)

    def stands(self, pose: SE2) -> bool:
        """Whether the robot has room there."""
        return self.world.clearance((pose.x, pose.y), (pose.x, pose.y)) > ROOM

    def on_tour(self, rng: np.random.Generator) -> SE2:
        """A pose up to 0.3 m beside the world's tour, heading anywhere."""
        legs = self.world.legs()
        lengths = np.array([math.dist(*leg) for leg in legs])
        while True:
            (x0, y0), (x1, y1) = legs[int(rng.choice(len(legs), p=lengths / lengths.sum()))]
            share, aside = rng.random(), rng.uniform(-0.3, 0.3, 2)
            pose = SE2(x0 + share * (x1 - x0) + aside[0], y0 + share * (y1 - y0) + aside[1], rng.uniform(-math.pi, math.pi))
            if self.stands(pose):
                return pose

    def pairs(self, seed: int, apart: tuple[float, float], turned: tuple[float, float]) -> Iterator[StillPair]:
        """Pairs `apart` by a distance [m] and `turned` by an angle [rad] from..to, without end; each by a device of its own."""
        rng = np.random.default_rng(seed)
        while True:
            first, way, turn = self.on_tour(rng), rng.uniform(-math.pi, math.pi), rng.choice([-1.0, 1.0]) * rng.uniform(*turned)
            distance = rng.uniform(*apart)
            T = SE2(distance * math.cos(way), distance * math.sin(way), turn)
            second = first @ T
            if not self.stands(second) or self.world.clearance((first.x, first.y), (second.x, second.y)) <= 0.0:
                continue
            lidar = self.lidar(rng)
            yield StillPair(self.points(lidar, second), self.points(lidar, first), T, first)
