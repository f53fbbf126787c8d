"""A coarse search that cannot be trapped: every pose of a window is tried."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import require_not_negative, require_positive
from slam.kernels import correlative as kernels
from slam.matching.surface_field import SurfaceField
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class Correlative:
    """Exhaustive search on the cell lattice; its answer starts a refinement."""

    reach: float = 0.3
    """Window to each side in x and y [m]."""
    turn: float = 0.3
    """Window to each side in heading [rad]."""
    step: float = 0.015
    """Heading step [rad]."""
    sigma: float = 0.1
    """Width of the score exp(-d^2 / 2 sigma^2) about a surface [m]."""
    penalty: float = 0.005
    """Mean score that a pose one standard deviation from the guess must gain to be preferred."""
    beams: int = 180
    """Most points used, evenly spread."""

    def __post_init__(self) -> None:
        require_positive(self, "step", "sigma", "beams")
        require_not_negative(self, "reach", "turn", "penalty")

    def search(self, field: SurfaceField, points: FloatArray, guess: SE2, prior: FloatArray) -> SE2:
        """Best pose `T_map_base` about the guess, whose covariance (3, 3) is `prior`, for points (M, 2) in base [m]."""
        if len(points) == 0:
            return guess
        cells = math.ceil(self.reach / field.resolution)
        turns = math.ceil(self.turn / self.step)
        squares = np.arange(field.radius**2 + 2) * field.resolution**2
        table = np.exp(-0.5 * squares / self.sigma**2).astype(np.float32)
        table[-1] = 0.0
        variance = np.array([0.5 * (prior[0, 0] + prior[1, 1]), prior[2, 2]])
        penalty = self.penalty * np.array([field.resolution**2, self.step**2]) / variance
        thinned = np.ascontiguousarray(points[:: max(1, len(points) // self.beams)])
        start = field.pose_in_grid(guess).as_array()
        pose, _ = kernels.search(thinned, start, (field.squares, field.resolution), (cells, turns, self.step), (table, penalty))
        return field.T_map_grid @ SE2.from_array(pose)
