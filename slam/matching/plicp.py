"""Point-to-line ICP of two scans: Censi, "An ICP variant using a point-to-line metric" (2008)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from slam.errors import ParameterError, require_positive
from slam.kernels import plicp as kernels
from slam.kernels.line_target import Target, prepare
from slam.matching.match import Match, no_prior
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class PlIcp:
    """Each point is drawn to the line through its nearest neighbour's surroundings; walls slide along themselves in one step.

    Correspondences as in CSM: the search starts at the last match, follows the order of the bearings and stops early; what is found
    is trimmed, and cut where it is long against the rest. A target point may serve several source points: one each, as CSM has it,
    leaves half the beams unused and made the error a quarter larger.
    """

    iterations: int = 30
    """Most steps."""
    tolerance: float = 1e-3
    """Converged when no component moves more than this [m or rad]."""
    max_distance: float = 0.5
    """Longest correspondence [m]."""
    trim: float = 0.9
    """Share of the correspondences that is kept, shortest first."""
    adaptive: float = 3.0
    """Longest correspondence, in lengths that seven in ten stay below."""
    half: float = 0.15
    """How far to each side a line's points lie [m]."""
    noise: float = 0.03
    """Standard deviation of a residual beside the prior, the map's errors that neighbours share among them [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "iterations", "tolerance", "max_distance", "adaptive", "half", "noise")
        if not 0.0 < self.trim <= 1.0:
            raise ParameterError(self, "trim", "above 0 and at most 1")

    def prepare(self, target: FloatArray) -> Target:
        """The target's points (N, 2) [m] in order, with their lines: once for many sources."""
        return prepare(target, self.half)

    def match(self, source: FloatArray, target: Target, guess: SE2, prior: FloatArray) -> Match:
        """Lay points (M, 2) [m] over a prepared target; `prior` is the covariance (3, 3) of the guess."""
        start = guess.as_array()
        settings = (self.iterations, self.tolerance, self.max_distance, self.trim, self.adaptive)
        pose, covariance, rms, share, converged, iterations = kernels.match(source, target, start, (start, prior), settings, self.noise)
        if not math.isfinite(pose.sum()):
            return Match(guess, np.diag([math.inf] * 3), False, rms, share, iterations, source)
        return Match(SE2.from_array(pose), covariance, converged and share > 0.0, rms, share, iterations, source)

    def register(self, source: FloatArray, target: FloatArray, guess: SE2, prior: FloatArray | None = None) -> Match:
        """See `slam.matching.matchers.ScanMatcher`."""
        return self.match(source, self.prepare(target), guess, no_prior() if prior is None else prior)
