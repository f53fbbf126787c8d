"""What every matcher answers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.matching.localizability import Localizability
from slam.messages import read_only
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """The pose of a scan, and how far to trust it."""

    T_target_source: SE2
    """Pose of the scan (source) in the map or the other scan (target)."""
    covariance: FloatArray
    """(3, 3) of (x, y, yaw) in the target frame [m, rad]."""
    converged: bool
    """The last step was below the tolerance."""
    rms: float
    """Weighted root mean square residual [m]."""
    inliers: float
    """Share of the points that found a counterpart, 0..1."""
    iterations: int = 0
    points: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    """(M, 2) of the scan, as they were given [m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", read_only(self.covariance))

    @property
    def localizability(self) -> Localizability:
        """How well each axis can be known by such a scan at most, and which is the weakest: worked out when asked for."""
        return Localizability.of(self.points, self.T_target_source)


def no_prior() -> FloatArray:
    """Covariance (3, 3) of a guess that hardly pulls [m, rad]."""
    return np.diag([4.0, 4.0, 1.0])


def finite(points: FloatArray) -> FloatArray:
    """Those of the points (M, 2) that are finite."""
    return np.ascontiguousarray(points[np.isfinite(points).all(axis=1)])
