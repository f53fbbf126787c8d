"""The beam model of a range finder: Thrun, Burgard, Fox, Probabilistic Robotics (2005), section 6.3."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from slam.errors import require_not_negative, require_positive
from slam.kernels import beam_model as kernels
from slam.kernels.particle_motion import in_frame
from slam.kernels.rays import empty_squares
from slam.localization.known_map import KnownMap
from slam.scans import PointScan
from slam.se2 import FloatArray

BINS = 560
"""Ranges that are told apart: 1 cm with a reach of 5.6 m."""


@dataclass(frozen=True, slots=True)
class BeamModel:
    """Each beam is cast through the map and its range compared: `beam_range_finder_model`, table 6.1."""

    z_hit: float = 0.85
    """Share of beams that end on what the map knows."""
    z_short: float = 0.05
    """Share of beams that end before it, on people."""
    z_max: float = 0.05
    """Share of beams that meet nothing."""
    z_rand: float = 0.05
    """Share of beams that end anywhere."""
    sigma_hit: float = 0.1
    """Standard deviation of a range from what the map says [m]."""
    lambda_short: float = 0.1
    """Rate at which beams end before it [1/m]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "z_hit", "z_short", "z_max")
        require_positive(self, "z_rand", "sigma_hit", "lambda_short")

    def over(self, known_map: KnownMap, range_max: float) -> BeamTable:
        """See `slam.localization.sensor_models.SensorModel`."""
        log = np.log(self.likelihoods(range_max))
        grid = known_map.grid
        squares = empty_squares(grid.likely())
        sizes = (grid.geometry.resolution, range_max / BINS)
        table = np.ascontiguousarray((log - log.max()).T.astype(np.float32))
        return BeamTable(grid.geometry.T_map_grid.as_array(), squares, table, sizes)

    def likelihoods(self, range_max: float) -> FloatArray:
        """p(z | z*) (B + 1, B + 1) [1/m] with z* along the rows, both in equal bins up to a range [m] that stands in the last one."""
        z = np.append((np.arange(BINS) + 0.5) * range_max / BINS, range_max)
        expected = z[:, None]
        within = z[None, :] < range_max
        away = (z[None, :] - expected) / self.sigma_hit
        mass = ndtr((range_max - expected) / self.sigma_hit) - ndtr(-expected / self.sigma_hit)
        p_hit = np.exp(-0.5 * away**2) / (self.sigma_hit * math.sqrt(2.0 * math.pi)) / mass
        p_short = self.lambda_short * np.exp(-self.lambda_short * z[None, :]) / -np.expm1(-self.lambda_short * expected)
        p_short = np.where(z[None, :] <= expected, p_short, 0.0)
        inside = self.z_hit * p_hit + self.z_short * p_short + self.z_rand / range_max
        return np.where(within, inside, np.maximum(self.z_max, 1e-6) + self.z_hit * p_hit * (expected >= range_max))


@dataclass(frozen=True, eq=False)
class BeamTable:
    """The beam model in one map."""

    frame: FloatArray
    """(3,) T_map_grid."""
    squares: NDArray[np.uint8]
    """Of `slam.kernels.rays.empty_squares`."""
    table: NDArray[np.float32]
    """(B + 1, B + 1) log-likelihoods below the best one, of the measured range along the rows."""
    sizes: tuple[float, float]
    """Of the map's cells and of the bins [m]."""

    def log(self, poses: FloatArray, cloud: PointScan, weights: FloatArray) -> FloatArray:
        """See `slam.localization.sensor_models.Likelihood`; a beam of the sensor's range or more has met nothing."""
        away, log_likelihoods = cloud.points - cloud.origins, np.empty(len(poses))
        bearings, ranges = np.arctan2(away[:, 1], away[:, 0]), np.hypot(away[:, 0], away[:, 1])
        beams = np.column_stack([cloud.origins, bearings, ranges])
        kernels.weigh(in_frame(poses, self.frame), beams, weights, self.squares, self.table, self.sizes, log_likelihoods)
        return log_likelihoods
