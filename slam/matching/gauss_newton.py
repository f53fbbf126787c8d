"""Scan-to-map registration by Gauss-Newton on the nearest-surface field."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.errors import require_not_negative, require_positive
from slam.kernels import gauss_newton as kernels
from slam.matching.match import Match, finite, no_prior
from slam.matching.point_map import point_map
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class GaussNewton:
    """Point-to-surface Gauss-Newton with an adaptive Geman-McClure kernel and a motion prior.

    The kernel starts as wide as the guess is expected to be wrong, as the threshold of KISS-ICP does (Vizzo et al.,
    2023), and narrows step by step (graduated non-convexity) to where only the residuals of the right surface count.
    """

    iterations: int = 30
    """Most Gauss-Newton steps."""
    kernel_min: float = 0.1
    """Last, narrowest kernel [m]. Letting it follow the residuals instead kept it wide in clutter and lost the track."""
    kernel_max: float = 0.5
    """Widest kernel [m]; never beyond the reach of the field."""
    shrink: float = 0.7
    """Share of the kernel width that remains from step to step."""
    tolerance: float = 1e-3
    """Converged when no component moves more than this [m or rad]."""
    lone_weight: float = 0.2
    """Weight of a surface that is a lone point against one that is a line."""
    residual_floor: float = 0.01
    """Smallest standard deviation believed of one residual [m]."""
    correlated_beams: float = 10.0
    """Neighbouring beams share the map's errors: beside the prior this many count as one independent residual."""
    systematic: float = 0.15
    """Share of the residual that half a metre of wall has in common beyond what is seen of it: the ranges' own bias."""

    def __post_init__(self) -> None:
        require_positive(self, "iterations", "kernel_min", "kernel_max", "shrink", "tolerance", "residual_floor", "correlated_beams")
        require_not_negative(self, "lone_weight", "systematic")

    def match(
        self, field: SurfaceField, points: FloatArray, guess: SE2, prior: FloatArray, width: float, start: SE2 | None = None
    ) -> Match:
        """Register points (M, 2) [m], given in base, on the field.

        Args:
            field: the map's surfaces.
            points: in base, deskewed.
            guess: T_map_base by odometry, the mean of the prior.
            prior: (3, 3) covariance of the guess (x, y, yaw) in the map frame [m, rad].
            width: expected size of the start's error [m]; the kernel starts here.
            start: where to start from; the guess when not given.
        """
        kernel = min(max(width, self.kernel_min), self.kernel_max)
        mean = guess.as_array()
        pose, covariance, rms, share, converged, iterations = kernels.match_in_map(
            points,
            mean if start is None else start.as_array(),
            (mean, prior),
            field.T_map_grid.as_array(),
            field.arrays,
            (self.iterations, kernel, self.kernel_min, self.tolerance, self.shrink, self.lone_weight),
            (self.residual_floor, self.correlated_beams, self.systematic),
        )
        x, y, yaw = pose.tolist()
        return Match(SE2(x, y, yaw), covariance, converged and math.isfinite(yaw), rms, share, iterations, points)

    def register(self, source: FloatArray, target: FloatArray, guess: SE2, prior: FloatArray | None = None) -> Match:
        """See `slam.matching.matchers.ScanMatcher`."""
        field = SurfaceField(point_map(target))
        return self.match(field, finite(source), guess, no_prior() if prior is None else prior, self.kernel_max)
