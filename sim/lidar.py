"""The Hokuyo URG-04LX-UG01: one beam after the other from a moving robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hardware.spec import LidarSpec
from sim import kernels
from sim.bodies import movable_solids
from sim.motion import BODIES, NANOSECONDS, STEP, Motion
from sim.rays import EmbreeRays, Rays, Singles
from sim.realism import Realism
from sim.scene import body_triangles
from slam.messages import LaserScan
from slam.se2 import FloatArray
from worlds.world import World

FIRST_STEP = 44
"""Steps from the device's zero to its first delivered beam."""
ARRIVAL = 0.101
"""From the device's zero to the arrival of the scan [s]."""
STEPS = 1000.0
"""Of a range [1/m]: whole millimetres."""
REACH = 1.1
"""Rays go this share of the maximum range: noise may bring a farther wall into range."""


@dataclass(frozen=True, slots=True, eq=False)
class MovingBody:
    """A body that rays hit in its own frame."""

    rays: Rays
    radius: float
    """Of a sphere about the body's origin that holds it [m]."""
    column: int
    """First column of its pose in a row of `Motion`."""


def moving_bodies(world: World) -> list[MovingBody]:
    """Everything that can be pushed, in the order of its columns in a row of `Motion`."""
    bodies: list[MovingBody] = []
    for k, solid in enumerate(movable_solids(world)):
        triangles = body_triangles(solid)
        bodies.append(MovingBody(EmbreeRays(triangles), float(np.linalg.norm(triangles, axis=-1).max()), BODIES + 7 * k))
    return bodies


class Lidar:
    """Sweeps every `period`; a scan is measured when its sweep ends and arrives `ARRIVAL` after the device's zero."""

    def __init__(self, spec: LidarSpec, realism: Realism, rays: Rays, bodies: Sequence[MovingBody], rng: np.random.Generator) -> None:
        self._spec = spec
        self._sigmas = (realism.range_sigma, realism.range_sigma_share)
        self._rays = rays
        self._bodies = bodies
        self._rng = rng
        self._sweeps = 0
        self._angles = spec.angles
        beams = np.column_stack([np.cos(self._angles), np.sin(self._angles), np.zeros(spec.beams)])
        self._directions = beams @ spec.T_base_laser.R.T
        self._mount = np.array(spec.T_base_laser.t)
        self._arriving: deque[tuple[float, LaserScan]] = deque()

    @property
    def _stamp(self) -> float:
        return round(self._sweeps * self._spec.period + FIRST_STEP * self._spec.time_increment, NANOSECONDS)

    @property
    def due(self) -> float:
        """Time of the last beam of the next sweep [s]."""
        return self._stamp + (self._spec.beams - 1) * self._spec.time_increment

    def sweep(self, motion: Motion) -> None:
        """Measure the sweep that is due."""
        scan = self.scan(motion, self._stamp)
        self._arriving.append((round(self._sweeps * self._spec.period + ARRIVAL, NANOSECONDS), scan))
        self._sweeps += 1

    def arrived(self, now: float) -> list[LaserScan]:
        """Scans that have arrived since the last call, oldest first."""
        scans: list[LaserScan] = []
        while self._arriving and self._arriving[0][0] <= now:
            scans.append(self._arriving.popleft()[1])
        return scans

    def scan(self, motion: Motion, stamp: float) -> LaserScan:
        """One scan whose first beam leaves at `stamp` [s], with distortion and noise."""
        spec = self._spec
        ranges = kernels.measure(
            self._true_ranges(motion, stamp),
            self._rng.standard_normal(spec.beams),
            self._sigmas,
            STEPS,
            (spec.range_min, spec.range_max),
        )
        return LaserScan(stamp, ranges, self._angles, spec.time_increment, spec.range_min, spec.range_max, spec.T_base_laser)

    def _true_ranges(self, motion: Motion, stamp: float) -> Singles:
        reach = REACH * self._spec.range_max
        frames, times = self._frames(motion, stamp, 0)
        origins, directions = kernels.beams(frames, times, self._directions, self._mount)
        ranges = self._rays.cast(origins, directions, reach)
        for body in self._bodies:
            frames, times = self._frames(motion, stamp, body.column)
            hit, o, d = kernels.beams_at_body(frames, times, body.radius, (origins, directions, ranges))
            if len(hit):
                ranges[hit] = np.minimum(ranges[hit], body.rays.cast(o, d, reach))
        return ranges

    def _frames(self, motion: Motion, stamp: float, column: int) -> tuple[FloatArray, tuple[float, float]]:
        """Frames at the physics steps round the sweep, and the beams' times as places among them."""
        increment = self._spec.time_increment
        poses, first = motion.poses_between(stamp, stamp + (self._spec.beams - 1) * increment, column)
        return kernels.frames_of(poses), ((stamp - first) / STEP, increment / STEP)
