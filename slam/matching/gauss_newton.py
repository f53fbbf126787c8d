"""Scan-to-map registration by Gauss-Newton on the nearest-surface field."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.kernels import gauss_newton as kernels
from slam.matching.match import Match
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class GaussNewton:
    """Point-to-surface Gauss-Newton with an adaptive Geman-McClure kernel and a motion prior.

    The kernel starts wide enough for the guess and narrows to three times the residual's own deviation
    (after KISS-ICP, Vizzo et al. 2023, whose threshold adapts to the motion; here both ends adapt).
    """

    iterations: int = 30
    """Most Gauss-Newton steps."""
    kernel_min: float = 0.1
    """Narrowest kernel [m]."""
    kernel_max: float = 0.5
    """Widest kernel [m]; never beyond the reach of the field."""
    shrink: float = 0.7
    """Share of the kernel width that remains from step to step."""
    tolerance: float = 1e-4
    """Converged when no component moves more than this [m or rad]."""
    lone_weight: float = 0.2
    """Weight of a surface that is a lone point against one that is a line."""
    residual_floor: float = 0.01
    """Smallest standard deviation believed of one residual [m]."""
    correlated_beams: float = 10.0
    """Neighbouring beams share the map's errors: this many count as one independent residual."""

    def match(self, field: SurfaceField, points: FloatArray, guess: SE2, prior: FloatArray, width: float) -> Match:
        """Register points (M, 2) [m], given in base, on the field.

        Args:
            field: the map's surfaces.
            points: in base, deskewed.
            guess: T_map_base to start from, and the mean of the prior.
            prior: (3, 3) covariance of the guess (x, y, yaw) in the map frame [m, rad].
            width: expected size of the guess's error [m]; the kernel starts here.
        """
        to_grid = np.eye(3)
        to_grid[:2, :2] = field.T_grid_map.rotation()
        variance = self.residual_floor**2 * self.correlated_beams
        information = np.linalg.inv(to_grid @ prior @ to_grid.T) * variance
        start = field.pose_in_grid(guess).as_array()
        kernel = min(max(width, self.kernel_min), self.kernel_max)
        settings = (self.iterations, kernel, self.kernel_min, self.tolerance, self.shrink, self.lone_weight)
        pose, A, rms, share, converged = kernels.match(
            points, start, information, (field.nearest, field.surfaces, field.resolution), settings
        )
        scale = max(rms / self.residual_floor, 1.0) ** 2 * variance
        covariance = to_grid.T @ np.linalg.inv(A / scale + information / variance) @ to_grid
        converged = bool(converged) and all(math.isfinite(value) for value in pose)
        T_map_grid = field.T_grid_map.inverse()
        return Match(T_map_grid @ SE2.from_array(pose), covariance, converged, float(rms), float(share))
