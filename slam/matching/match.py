"""What every matcher answers."""

from __future__ import annotations

from dataclasses import dataclass

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

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", read_only(self.covariance))
