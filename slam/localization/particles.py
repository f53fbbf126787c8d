"""A belief as weighted poses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slam.kernels import bins as kernels
from slam.kernels.particle_weights import normalised
from slam.kernels.rays import directions
from slam.localization.known_map import KnownMap
from slam.se2 import SE2, FloatArray

BIN = 0.5
"""Side of a bin, in which particles are counted and hang together [m]."""
YAW_BINS = 36
"""Bins to a turn."""


@dataclass(frozen=True, eq=False)
class Particles:
    """Weighted poses in the map. Weights are kept as logarithms and never have to be normalised."""

    poses: FloatArray
    """(N, 3) x, y [m], yaw [rad]."""
    log_weights: FloatArray
    """(N,)"""

    def __len__(self) -> int:
        return len(self.poses)

    @classmethod
    def equal(cls, poses: FloatArray) -> Particles:
        """Particles (N, 3) of one weight."""
        return cls(poses, np.zeros(len(poses)))

    @classmethod
    def about(cls, T_map_base: SE2, covariance: FloatArray, count: int, rng: np.random.Generator) -> Particles:
        """Drawn from a normal distribution with a covariance (3, 3) in the map frame [m, rad]."""
        values, vectors = np.linalg.eigh(covariance)
        off = rng.standard_normal((count, 3)) @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
        return cls.equal(T_map_base.as_array() + off)

    @classmethod
    def anywhere(cls, known_map: KnownMap, count: int, rng: np.random.Generator) -> Particles:
        """Uniform over the free cells of a map, in any direction."""
        return cls.equal(anywhere(known_map, count, rng))

    @cached_property
    def _normalised(self) -> tuple[FloatArray, float]:
        return normalised(self.log_weights)

    @property
    def weights(self) -> FloatArray:
        """(N,) their sum is 1."""
        return self._normalised[0]

    @property
    def effective(self) -> float:
        """N_eff = 1 / sum w^2: how many particles of one weight say as much (Doucet, Godsill, Andrieu 2000)."""
        return self._normalised[1]

    @cached_property
    def bins(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The bin of every particle, (N,), and the places of the bins that are filled, (K, 3) in x, y and yaw."""
        return kernels.fill(self.poses, (BIN, math.tau / YAW_BINS))

    def mean(self) -> SE2:
        """Weighted mean; of the headings the direction of their mean vector."""
        return mean(self.poses, self.weights)

    def covariance(self, about: SE2) -> FloatArray:
        """Weighted covariance (3, 3) of (x, y, yaw) about a pose [m, rad]."""
        return covariance(self.poses, self.weights, about)

    def as_rows(self) -> FloatArray:
        """(N, 4) of x, y [m], yaw [rad], weight: what `Snapshot.particles` holds."""
        rows = np.column_stack([self.poses, self.weights])
        rows.setflags(write=False)
        return rows


def anywhere(known_map: KnownMap, count: int, rng: np.random.Generator) -> FloatArray:
    """Poses (count, 3), uniform over the free cells and all headings."""
    cells = known_map.free_cells[rng.integers(len(known_map.free_cells), size=count)]
    geometry = known_map.grid.geometry
    within = (cells[:, ::-1] + rng.random((count, 2))) * geometry.resolution
    return np.column_stack([geometry.T_map_grid.transform(within), rng.uniform(-np.pi, np.pi, count)])


def mean(poses: FloatArray, weights: FloatArray) -> SE2:
    """Mean of poses (N, 3) by weights (N,) whose sum is 1; of the headings the direction of their mean vector."""
    cos, sin = directions(poses)
    yaw = math.atan2(float(np.sum(weights * sin)), float(np.sum(weights * cos)))
    return SE2(float(np.sum(weights * poses[:, 0])), float(np.sum(weights * poses[:, 1])), yaw)


def covariance(poses: FloatArray, weights: FloatArray, about: SE2) -> FloatArray:
    """Covariance (3, 3) of poses (N, 3) about a pose, by weights (N,) whose sum is 1 [m, rad]."""
    off = poses - about.as_array()
    off[:, 2] = np.remainder(off[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    return np.einsum("n,ni,nj->ij", weights, off, off, optimize=False)
