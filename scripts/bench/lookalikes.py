"""The oracle of global localization: whether some other place of a world looks the same, by its true walls alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from hardware.spec import LidarSpec
from sim.lidar import embree_rays
from slam.kernels.jit import njit
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world
from worlds.raster import rasterise

SPACING = 0.1
"""Lattice of the places that are compared [m]."""
BEARINGS = 360
"""Directions, and headings, that are compared at each place."""
STRIDE = 3
"""Of the bearings of a scan that the lattice is asked for [deg]."""
SIGMA = (0.01, 0.01)
"""Standard deviation of a range by the data sheet: least [m], and as a share of it."""
SIGMAS = 3.0
EXPLAINED = 0.99
"""Share of the beams that a place must explain: a beam at an edge may go either way."""
UNLIKE = 0.12
"""Share of the lattice's beams by which a place may differ and still be looked at closely."""
CLOSEST = 48
"""Places that are looked at closely."""
CHECKED = 8
"""Beams after which is seen whether a place is out at all headings."""
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
FAR, TURNED = 0.5, math.radians(20.0)
"""Beyond this distance [m] or turn [rad] a pose is another one."""
Evidence = tuple[FloatArray, FloatArray]
"""Range [m] and tolerance [m] of each beam."""


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """What is seen from everywhere."""

    points: FloatArray
    """(K, 2) of the laser, in the world [m]."""
    nearest: NDArray[np.float32]
    """(K, B) least range about each place and bearing [m]."""
    farthest: NDArray[np.float32]
    """(K, B) and the largest."""


class Lookalikes:
    """A world's places, compared by brute force: every place, every heading, then a closer look at those that come near."""

    def __init__(self, world: str, room: float = 0.15) -> None:
        self._world, self._spec = load_world(world), LidarSpec()
        self._rays = embree_rays(self._world)
        self._room = room
        self._places: Places | None = None
        angles = self._spec.angles
        bearings = np.rint(np.degrees(np.arange(angles[0], angles[-1], math.radians(STRIDE)))).astype(np.int64)
        self._bearings = bearings[np.argsort(np.arange(len(bearings)) * GOLDEN % 1.0)]  # beams far apart first: most places are soon out

    @property
    def places(self) -> Places:
        """Made when first asked for."""
        if self._places is None:
            self._places = self._look_around()
        return self._places

    def ranges(self, poses: FloatArray, step: int = 1) -> FloatArray:
        """Ranges (N, beams) [m] without noise of every `step`-th beam from poses (N, 3) in the world; the sensor's range if more."""
        mount, angles = self._spec.T_base_laser.t, self._spec.angles[::step]
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x, y = poses[:, 0] + c * mount[0] - s * mount[1], poses[:, 1] + s * mount[0] + c * mount[1]
        bearings = poses[:, 2:] + angles
        return self._cast(np.repeat(np.column_stack([x, y]), len(angles), axis=0), bearings.reshape(-1)).reshape(len(poses), -1)

    def reaches(self, pose: SE2) -> bool:
        """Whether the robot can get there."""
        return bool(np.hypot(*(self.places.points - np.array([pose.x, pose.y])).T).min() <= 1.5 * SPACING)

    def elsewhere(self, pose: SE2) -> SE2 | None:
        """Another pose from which a scan taken at `pose` could have come: all beams within three sigma; None if there is none."""
        ranges = self.ranges(pose.as_array()[None])[0]
        tolerance = SIGMAS * np.maximum(SIGMA[0], SIGMA[1] * ranges)
        candidates = self._near_misses(pose, (ranges, tolerance))
        if len(candidates) == 0:
            return None
        poses = self._looked_at_closely(candidates, (ranges, tolerance))
        other = self._explains(poses, (ranges, tolerance)) & _apart(poses, pose)
        return SE2.from_array(poses[int(np.argmax(other))]) if other.any() else None

    def _look_around(self) -> Places:
        raster = rasterise(self._world, SPACING)
        free = raster.connected(self._room, self._world.start[:2])
        cells = np.argwhere(free)
        points = raster.points(cells)
        bearings = np.radians(np.arange(BEARINGS) * 360.0 / BEARINGS)
        table = np.full((*free.shape, BEARINGS), np.nan, np.float32)
        for block in np.array_split(np.arange(len(cells)), max(1, len(cells) // 2000)):
            cast = self._cast(np.repeat(points[block], BEARINGS, axis=0), np.tile(bearings, len(block)))
            table[cells[block, 0], cells[block, 1]] = cast.reshape(len(block), BEARINGS)
        window = {"size": 3, "mode": ("nearest", "nearest", "wrap")}
        low = ndimage.minimum_filter(np.where(np.isnan(table), np.float32(np.inf), table), **window)
        high = ndimage.maximum_filter(np.where(np.isnan(table), np.float32(-np.inf), table), **window)
        return Places(points, low[cells[:, 0], cells[:, 1]], high[cells[:, 0], cells[:, 1]])

    def _cast(self, places: FloatArray, bearings: FloatArray) -> FloatArray:
        origins = np.column_stack([places, np.full(len(places), self._spec.T_base_laser.t[2])]).astype(np.float32)
        directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))]).astype(np.float32)
        ranges = self._rays.cast(origins, directions, 1.1 * self._spec.range_max).astype(np.float64)
        return np.minimum(ranges, self._spec.range_max)

    def _near_misses(self, pose: SE2, evidence: Evidence) -> FloatArray:
        """Poses (N, 3) of base on the lattice that explain nearly all, the best of each neighbourhood, best first."""
        chosen = np.rint((np.radians(self._bearings) - self._spec.angles[0]) / self._spec.angle_increment).astype(np.int64)
        chosen = np.clip(chosen, 0, self._spec.beams - 1)
        shares = _compare(self.places.nearest, self.places.farthest, (self._bearings % BEARINGS, evidence[0][chosen], evidence[1][chosen]))
        found = np.argwhere(shares <= UNLIKE)
        found = found[np.argsort(shares[found[:, 0], found[:, 1]], kind="stable")]
        yaws = np.radians(found[:, 1] * 360.0 / BEARINGS)
        mount = self._spec.T_base_laser.t
        x = self.places.points[found[:, 0], 0] - np.cos(yaws) * mount[0] + np.sin(yaws) * mount[1]
        y = self.places.points[found[:, 0], 1] - np.sin(yaws) * mount[0] - np.cos(yaws) * mount[1]
        poses = np.column_stack([x, y, yaws])
        return _spread(poses[_apart(poses, pose)][:20_000])

    def _looked_at_closely(self, poses: FloatArray, evidence: Evidence) -> FloatArray:
        """The poses (N, 3) after a pattern search for more beams explained, all at once."""
        ranges, sigma = evidence[0][::3], evidence[1][::3] / SIGMAS

        def cost(p: FloatArray) -> FloatArray:
            return np.minimum(np.square((self.ranges(p, 3) - ranges) / sigma), 25.0).mean(axis=1)

        moves = np.concatenate([np.eye(3), -np.eye(3)])
        step = np.tile([0.05, 0.05, math.radians(1.0)], (len(poses), 1))
        best = cost(poses)
        for _ in range(28):
            tried = poses[:, None] + moves * step[:, None]
            costs = cost(tried.reshape(-1, 3)).reshape(len(poses), 6)
            winner = costs.argmin(axis=1)
            better = costs[np.arange(len(poses)), winner] < best
            poses = np.where(better[:, None], tried[np.arange(len(poses)), winner], poses)
            best = np.minimum(best, costs.min(axis=1))
            step[~better] *= 0.5
        return poses

    def _explains(self, poses: FloatArray, evidence: Evidence) -> NDArray[np.bool_]:
        """Which poses (N, 3) explain the beams; at an edge a beam may be its neighbour."""
        expected = self.ranges(poses)
        shifted = [np.roll(expected, shift, axis=1) for shift in (-1, 0, 1)]
        within = np.any([np.abs(one - evidence[0]) <= evidence[1] for one in shifted], axis=0)
        return within.mean(axis=1) >= EXPLAINED


def _apart(poses: FloatArray, pose: SE2) -> NDArray[np.bool_]:
    """Which poses (N, 3) are other ones than `pose`."""
    turn = np.abs(np.remainder(poses[:, 2] - pose.yaw + math.pi, math.tau) - math.pi)
    return (np.hypot(poses[:, 0] - pose.x, poses[:, 1] - pose.y) > FAR) | (turn > TURNED)


def _spread(poses: FloatArray) -> FloatArray:
    """The first `CLOSEST` of the poses (N, 3) that are not next to one before them."""
    kept: list[FloatArray] = []
    while len(poses) and len(kept) < CLOSEST:
        kept.append(poses[0])
        turn = np.abs(np.remainder(poses[:, 2] - poses[0, 2] + math.pi, math.tau) - math.pi)
        poses = poses[(np.hypot(poses[:, 0] - poses[0, 0], poses[:, 1] - poses[0, 1]) > 0.25) | (turn > math.radians(6.0))]
    return np.array(kept).reshape(-1, 3)


@njit
def _compare(
    nearest: NDArray[np.float32], farthest: NDArray[np.float32], scan: tuple[NDArray[np.int64], FloatArray, FloatArray]
) -> NDArray[np.float32]:
    """Share (K, B) of the beams that each place and heading does not explain; 1 as soon as it is far too many.

    All headings of a place side by side, which is what a processor does well.
    """
    bearings, ranges, tolerance = scan
    count, turns = len(bearings), nearest.shape[1]
    most = int(UNLIKE * count)
    shares = np.ones(nearest.shape, np.float32)
    near, far, missed = np.empty(2 * turns, np.float32), np.empty(2 * turns, np.float32), np.empty(turns, np.int32)
    for k in range(len(nearest)):
        near[:turns], near[turns:], far[:turns], far[turns:] = nearest[k], nearest[k], farthest[k], farthest[k]
        missed[:] = 0
        for i in range(count):
            here, there = near[bearings[i] : bearings[i] + turns], far[bearings[i] : bearings[i] + turns]
            longest, shortest = np.float32(ranges[i] + tolerance[i]), np.float32(ranges[i] - tolerance[i])
            for heading in range(turns):
                missed[heading] += np.int32(here[heading] > longest) | np.int32(there[heading] < shortest)
            if i % CHECKED == CHECKED - 1 and missed.min() > most:
                break
        for heading in range(turns):
            if missed[heading] <= most:
                shares[k, heading] = missed[heading] / count
    return shares
