"""Which beams see what the map does not know, and what the others can tell of the pose: document C in its computable form.

After Wang, Chen, Wang, Wang, "Multisensor observation localizability estimation" (2016): influence factors s of people on the beams of a
lidar, and the dynamic localizability matrix D, Censi's Fisher information (2007) of the beams that are left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.localization.map_faces import Sight
from slam.se2 import FloatArray


@dataclass(frozen=True, slots=True)
class Influence:
    """How likely a beam ends on what is not in the map, by its range and by what the camera sees."""

    unseen: float = 0.05
    """Probability of somebody in a beam's way where the camera sees nobody, or does not look."""
    anywhere: float = 0.02
    """Share of beams that end anywhere."""
    range_noise: float = 0.01
    """Standard deviation of near ranges [m]."""
    range_noise_share: float = 0.01
    """Standard deviation of far ranges, as a share of the range."""
    map_noise: float = 0.02
    """Standard deviation of the map's walls [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "range_noise", "map_noise")
        require_not_negative(self, "range_noise_share")
        for name in ("unseen", "anywhere"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ParameterError(self, name, "in 0..1, below 1")

    def factors(self, ranges: FloatArray, sight: Sight, covariance: FloatArray, seen: FloatArray, range_max: float) -> FloatArray:
        """Influence factors s (M,): the probability that a beam does not end on what the map expects. 1 where it expects nothing.

        Args:
            ranges: (M,) measured [m].
            sight: what the map expects at the mean of the predicted set.
            covariance: C (3, 3) of that set [m, rad].
            seen: q (M,) probability that the camera sees somebody there.
            range_max: of the lidar [m].
        """
        expected = np.where(np.isfinite(sight.ranges), sight.ranges, range_max)
        own = np.maximum(self.range_noise, self.range_noise_share * ranges) ** 2 + self.map_noise**2
        wide = own + np.einsum("mi,ij,mj->m", sight.gradients, covariance, sight.gradients)
        blocked = 1.0 - (1.0 - seen) * (1.0 - self.unseen)
        f_A = np.exp(-0.5 * (ranges - expected) ** 2 / wide) / np.sqrt(math.tau * wide)
        f_B = (ndtr((expected - ranges) / np.sqrt(own)) - ndtr(-ranges / np.sqrt(own))) / np.maximum(expected, 0.01)
        free = (1.0 - blocked) * ((1.0 - self.anywhere) * f_A + self.anywhere / range_max)
        total = free + blocked * np.maximum(f_B, 0.0)
        known = (1.0 - blocked) * (1.0 - self.anywhere) * f_A / np.where(total > 0.0, total, 1.0)
        return np.where(np.isfinite(sight.ranges), 1.0 - known, 1.0)


def localizability_matrix(sight: Sight, weights: FloatArray) -> FloatArray:
    """D (3, 3) of (x, y, yaw) in the map [1/m^2, 1/rad^2]: sum of weights (M,) times g g^T over the beams that see a wall."""
    g = sight.gradients
    shares = np.where(sight.cosines > 0.0, weights, 0.0)
    return np.asarray((g * shares[:, None]).T @ g, np.float64)
