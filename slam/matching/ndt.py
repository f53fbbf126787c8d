"""Normal distributions transform: Biber, Strasser, "The normal distributions transform: a new approach to laser scan matching" (2003)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import require_positive
from slam.kernels import ndt as kernels
from slam.matching.match import Match, no_prior
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class Ndt:
    """The target becomes a normal distribution in every cell of four overlapping grids; no correspondences are sought.

    Where the paper takes Newton's steps this takes Gauss-Newton's, which go downhill from everywhere, on distributions that start
    four times as wide.
    """

    cell: float = 0.5
    """Cell size [m]."""
    thinnest: float = 0.02
    """Least standard deviation of a distribution [m]."""
    iterations: int = 40
    """Most steps."""
    tolerance: float = 2e-4
    """Converged when no component moves more than this [m or rad]."""
    correlated: float = 10.0
    """Neighbouring beams share the target's errors: beside the prior this many count as one independent."""

    def __post_init__(self) -> None:
        require_positive(self, "cell", "thinnest", "iterations", "tolerance", "correlated")

    def prepare(self, target: FloatArray) -> kernels.Cells:
        """The distributions of the target's points (N, 2) [m]: once for many sources."""
        return kernels.prepare(target, self.cell, self.thinnest)

    def match(self, source: FloatArray, target: kernels.Cells, guess: SE2, prior: FloatArray) -> Match:
        """Lay points (M, 2) [m] over a prepared target; `prior` is the covariance (3, 3) of the guess."""
        start = guess.as_array()
        settings = (self.iterations, self.tolerance, self.correlated)
        pose, covariance, rms, share, converged, iterations = kernels.match(source, target, start, (start, prior), settings)
        if not math.isfinite(pose.sum()):
            return Match(guess, np.diag([math.inf] * 3), False, rms, share, iterations, source)
        return Match(SE2.from_array(pose), covariance, converged and share > 0.0, rms, share, iterations, source)

    def register(self, source: FloatArray, target: FloatArray, guess: SE2, prior: FloatArray | None = None) -> Match:
        """See `slam.matching.matchers.ScanMatcher`."""
        return self.match(source, self.prepare(target), guess, no_prior() if prior is None else prior)
