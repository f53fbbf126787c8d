"""How likely a scan is at a pose: Thrun, Burgard, Fox, Probabilistic Robotics (2005), chapter 6."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.kernels import likelihood_field as kernels
from slam.localization.known_map import KnownMap
from slam.scans import PointScan
from slam.se2 import FloatArray

FINEST = 4
"""Small cells along the side of a map's cell."""
MOST_SMALL_CELLS = 8_000_000


class Likelihood(Protocol):
    """A sensor model in one map."""

    def log(self, poses: FloatArray, cloud: PointScan, weights: FloatArray) -> FloatArray:
        """Sums (N,) of the weighted log-likelihoods of a scan's beams; 0 is the best that can be.

        Args:
            poses: (N, 3) T_map_base: x, y [m], yaw [rad].
            cloud: the scan, deskewed.
            weights: (M,) how much each beam counts; 1 each for the product of the book.
        """
        ...


class SensorModel(Protocol):
    """The parameters of a sensor model."""

    def over(self, known_map: KnownMap, range_max: float) -> Likelihood:
        """The model in a map, for a sensor of such a range [m]."""
        ...


@dataclass(frozen=True, slots=True)
class LikelihoodField:
    """A beam's end is normally distributed about the nearest surface, or anywhere: `likelihood_field_range_finder_model`, table 6.3."""

    sigma_hit: float = 0.1
    """Standard deviation of a beam's end from the nearest surface: ranges, map and pose [m]."""
    z_hit: float = 0.95
    """Share of beams that end on what the map knows."""
    z_rand: float = 0.05
    """Share of beams that end anywhere: people, what has been moved. Without it one person outweighs many walls."""
    max_distance: float = 2.0
    """Distance to a surface beyond which all are the same [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "sigma_hit", "z_hit", "max_distance")
        require_not_negative(self, "z_rand")

    def over(self, known_map: KnownMap, range_max: float) -> FieldTable:
        """See `SensorModel`."""
        squares = np.square(surface_distances(known_map, self.max_distance), dtype=np.float64) / self.sigma_hit**2
        density = self.z_hit / (self.sigma_hit * np.sqrt(2.0 * np.pi))
        anywhere = self.z_rand / range_max
        log = -0.5 * squares if anywhere == 0.0 else np.log((density * np.exp(-0.5 * squares) + anywhere) / (density + anywhere))
        return FieldTable.of(known_map, log)


@dataclass(frozen=True, eq=False)
class FieldTable:
    """The likelihood field of one map, looked up where beams end."""

    frame: FloatArray
    """(3,) T_map_grid."""
    table: NDArray[np.float32]
    """(k H + 2, k W + 2) log-likelihoods of small cells, 0 for the best; the border stands for all that is outside."""
    cell: float
    """Side of a small cell [m]."""

    @classmethod
    def of(cls, known_map: KnownMap, log_likelihoods: FloatArray) -> FieldTable:
        """From the log-likelihood (k H + 2, k W + 2) of each small cell."""
        geometry = known_map.grid.geometry
        cell = geometry.resolution * geometry.width / (log_likelihoods.shape[1] - 2)
        return cls(geometry.T_map_grid.as_array(), log_likelihoods.astype(np.float32), cell)

    def log(self, poses: FloatArray, cloud: PointScan, weights: FloatArray) -> FloatArray:
        """See `Likelihood`."""
        beams = len(weights)
        room = -(-beams // kernels.TOGETHER) * kernels.TOGETHER
        ends, shares, log_likelihoods = np.zeros((room, 2), np.float32), np.zeros(room, np.float32), np.empty(len(poses))
        ends[:beams], shares[:beams] = cloud.points, weights
        kernels.weigh(poses, self.frame, ends, shares, self.table, self.cell, log_likelihoods)
        return log_likelihoods


def surface_distances(known_map: KnownMap, farthest: float) -> NDArray[np.float32]:
    """Distance [m] of every small cell to the nearest surface, at most `farthest`: (k H + 2, k W + 2) with a border that is far away.

    Near by it is that to the line through the mean hits, which knows walls better than the cells' size; there is no bias of half a
    cell as in a distance transform of cell centres.
    """
    grid, field = known_map.grid, known_map.field
    finer = next((k for k in (FINEST, 2) if k * k * grid.log_odds.size <= MOST_SMALL_CELLS), 1)
    far = np.asarray(distance_transform_edt(~grid.likely()), np.float32) * np.float32(grid.geometry.resolution)
    table = np.pad(far.repeat(finer, axis=0).repeat(finer, axis=1), 1, constant_values=farthest)
    kernels.distances(field.nearest, field.surfaces, grid.hit_offset, (grid.geometry.resolution, finer), table)
    return np.minimum(table, np.float32(farthest))


def require_shares(settings: object, *names: str) -> None:
    """Raise ParameterError unless these parameters lie in 0..1."""
    for name in names:
        if not 0.0 <= getattr(settings, name) <= 1.0:
            raise ParameterError(settings, name, "in 0..1")
