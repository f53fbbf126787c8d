"""The Hokuyo URG-04LX-UG01: one beam after the other from a moving robot. The errors' sources are in docs/realism.md."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from hardware.spec import LidarSpec
from sim import kernels, lidar_kernel
from sim.grid_rays import GridRays
from sim.lidar_kernel import Met
from sim.motion import NANOSECONDS, Motion
from sim.moving import MovingBodies
from sim.rays import EmbreeRays, Rays
from sim.realism import Realism
from sim.scene import static_materials, static_solids, static_triangles
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
BIAS_SPACING = 0.05
"""Ranges between which the bias is interpolated [m]."""

Constants = tuple[FloatArray, FloatArray, lidar_kernel.Optics, tuple[float, ...], tuple[float, float], FloatArray]
"""Beams' directions in base (N, 3), their origin in base (3,) [m]; see `lidar_kernel.report` for the rest."""


def grid_rays(world: World, *, glass: bool = True) -> GridRays:
    """Rays against everything that never moves, with panes or without."""
    return GridRays(static_solids(world, glass=glass))


def embree_rays(world: World, *, glass: bool = True) -> EmbreeRays:
    """The same by Intel Embree."""
    return EmbreeRays(static_triangles(world, glass=glass), static_materials(world, glass=glass))


CASTERS: dict[str, Callable[..., Rays]] = {"grid": grid_rays, "embree": embree_rays}
"""name -> what makes the rays of a world."""


def static_rays(world: World, caster: Callable[..., Rays] = grid_rays) -> tuple[Rays, Rays | None]:
    """Rays against everything that never moves; and as if panes were not there, None in a world without panes."""
    panes = any(solid.material == "glass" for solid in static_solids(world))
    return caster(world), caster(world, glass=False) if panes else None


class Lidar:
    """Sweeps every `period`; a scan is measured when its sweep ends and arrives `ARRIVAL` after the device's zero."""

    def __init__(
        self,
        spec: LidarSpec,
        realism: Realism,
        rays: Rays,
        bodies: Sequence[MovingBodies],
        rng: np.random.Generator,
        through_glass: Rays | None = None,
    ) -> None:
        errors, increment = realism.lidar, abs(spec.angle_increment)
        self._spec = spec
        self._errors = errors
        self._glass = (math.cos(errors.glare), errors.pane_seen, errors.pane_seen_aslant)
        edge = (errors.edge_depth, errors.edge_reject, increment)
        reaches = np.array([errors.matte_reach, errors.dark_reach, errors.glossy_reach, errors.matte_reach])
        losses = (math.cos(errors.glare), errors.glare_blinds, errors.gloss_silent, errors.dropout)
        self._optics = (errors.spot / increment, edge, reaches, losses)
        slant = (errors.spot, errors.incidence_sigma, errors.incidence_bias)
        self._model = (errors.range_sigma, errors.range_sigma_share, *slant, STEPS, 1.0 / BIAS_SPACING)
        self._rays = rays
        self._through_glass = through_glass
        self._bodies = bodies
        self._rng = rng
        self._biases = self._own_biases()
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

    def arrived(self, now: float) -> list[tuple[float, LaserScan]]:
        """Time of arrival and scan of those that have arrived since the last call, oldest first."""
        scans: list[tuple[float, LaserScan]] = []
        while self._arriving and self._arriving[0][0] <= now:
            scans.append(self._arriving.popleft())
        return scans

    def scan(self, motion: Motion, stamp: float) -> LaserScan:
        """One scan whose first beam leaves at `stamp` [s], with distortion and errors."""
        spec = self._spec
        ranges = self._reported(self._met(motion, stamp), stamp)
        return LaserScan(stamp, ranges, self._angles, spec.time_increment, spec.range_min, spec.range_max, spec.T_base_laser)

    @property
    def constants(self) -> Constants:
        """What the kernels are told of this device, `biases` at time 0 the last."""
        limits = (self._spec.range_min, self._spec.range_max)
        return self._directions, self._mount, self._optics, self._model, limits, self.biases(0.0)

    def biases(self, stamp: float) -> FloatArray:
        """Bias at normal incidence (K,) [m] of ranges `BIAS_SPACING` apart from 0 on: the device's own, its swing, its warming up."""
        errors = self._errors
        return self._biases + errors.warm_up * math.exp(-stamp / errors.warm_up_time) if errors.warm_up else self._biases

    def _reported(self, met: Met, stamp: float) -> FloatArray:
        """Ranges (N,) [m] that the device makes of what its beams meet."""
        spec = self._spec
        draws, normals = self._rng.random(spec.beams), self._rng.standard_normal(spec.beams)
        limits = (spec.range_min, spec.range_max)
        return lidar_kernel.report(met, (draws, normals), self._optics, self._model, self.biases(stamp), limits)

    def _own_biases(self) -> FloatArray:
        """Drawn once for each device."""
        errors, ranges = self._errors, np.arange(0.0, REACH * self._spec.range_max + 2.0 * BIAS_SPACING, BIAS_SPACING)
        offset, phase = errors.offset_sigma * self._rng.standard_normal(), math.tau * self._rng.random()
        return offset + errors.cyclic_bias * np.sin(math.tau * ranges / errors.cyclic_length + phase)

    def _met(self, motion: Motion, stamp: float) -> Met:
        reach = REACH * self._spec.range_max
        end = stamp + (self._spec.beams - 1) * self._spec.time_increment
        frames = motion.frames_between(stamp, end)
        places = (stamp - frames.first) / frames.step, self._spec.time_increment / frames.step
        origins, directions = kernels.beams(frames.values, places, self._directions, self._mount)
        met = self._rays.meet(origins, directions, reach)
        if self._through_glass is not None:
            behind = self._through_glass.meet(origins, directions, reach)
            lidar_kernel.see_through(met, behind, self._rng.random(self._spec.beams), self._glass)
        times = (stamp, self._spec.time_increment, end)
        for bodies in self._bodies:
            bodies.meet(motion, times, (origins, directions), met, reach)
        return met
