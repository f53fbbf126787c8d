"""Document B's matching optimisation: RPROP on the error table, then Kalman's fusion with odometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.kernels import perfect_match as kernels
from slam.localization.error_table import ErrorTable
from slam.se2 import SE2, FloatArray

Stage = tuple[float, FloatArray, FloatArray]


Prior = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Where the scan was taken."""

    T_map_base: SE2
    covariance: FloatArray
    """(3, 3) of (x, y, yaw) in the map frame [m, rad]."""
    explained: float
    """Share of the points that are on a wall."""
    iterations: int


@dataclass(frozen=True, slots=True)
class MatchingOptimisation:
    """Lauer, Lange, Riedmiller, "Calculating the perfect match" (2005), in two stages: c is annealed.

    The wide stage finds the way, the narrow one is not pulled by people. Starting wider than 0.25 m fails among people.
    """

    width: float = 0.25
    """c of the first stage [m]; the document's 250 is in millimetres."""
    width_last: float = 0.06
    """c of the second stage [m]."""
    steps: tuple[float, float, float] = (0.04, 0.04, 0.1)
    """First steps of x, y, yaw in the first stage [m, m, rad]."""
    steps_last: tuple[float, float, float] = (0.02, 0.02, 0.03)
    """First steps of x, y, yaw in the second stage [m, m, rad]."""
    grow: float = 1.2
    """Factor of a step while its component of the gradient keeps its sign."""
    shrink: float = 0.5
    """Factor of a step when the sign has changed."""
    tolerance: float = 2e-3
    """The first stage ends when all steps are below this [m or rad]."""
    tolerance_last: float = 5e-4
    """The second stage ends when all steps are below this [m or rad]."""
    iterations: int = 60
    """Most iterations of a stage."""
    coarse_beams: int = 150
    """Most points that show the way in the first stage."""
    beams: int = 300
    """Most points of the second stage; all of them have their say in the fusion with odometry."""
    residual_floor: float = 0.01
    """Smallest standard deviation believed of one residual [m]."""
    correlated_beams: float = 10.0
    """Neighbouring beams share the map's errors: beside odometry this many count as one independent residual."""
    displaced: float = 0.02
    """Standard deviation of half a metre of wall from where the map has it: the map is bent, and things are moved [m]."""

    def __post_init__(self) -> None:
        require_positive(self, "width", "width_last", "tolerance", "tolerance_last", "iterations")
        require_positive(self, "coarse_beams", "beams", "residual_floor", "correlated_beams")
        require_not_negative(self, "displaced")
        for name in ("steps", "steps_last"):
            if not all(step > 0.0 for step in getattr(self, name)):
                raise ParameterError(self, name, "three numbers above 0")
        if not self.grow >= 1.0:
            raise ParameterError(self, "grow", "1 or above")
        if not 0.0 < self.shrink < 1.0:
            raise ParameterError(self, "shrink", "above 0 and below 1")

    @property
    def stages(self) -> tuple[Stage, Stage]:
        """c, first steps (3,) and last steps (3,) of both stages."""
        first = self.width, np.array(self.steps), np.full(3, self.tolerance)
        return first, (self.width_last, np.array(self.steps_last), np.full(3, self.tolerance_last))

    @property
    def schedule(self) -> tuple[int, float, float]:
        """Most iterations, growth and shrinkage of the steps."""
        return self.iterations, self.grow, self.shrink

    def match(self, table: ErrorTable, points: FloatArray, starts: FloatArray, guess: SE2, prior: Prior) -> Found:
        """The best pose reached from any start, fused with odometry's.

        Args:
            table: of the map.
            points: (M, 2) in base, deskewed [m].
            starts: (K, 3) poses in the map from which to go down.
            guess: T_map_base by odometry.
            prior: two covariances (3, 3) (x, y, yaw) in the map frame [m, rad]: of the step since the last scan, by which odometry is
                weighed against the scan, and of the guess in all, on which the answer's builds.
        """
        pose, covariance, explained, iterations = kernels.locate(
            points,
            starts,
            (guess.as_array(), *prior),
            table.T_map_table.as_array(),
            (table.patches, table.cell),
            self.stages,
            self.schedule,
            (self.coarse_beams, self.beams, self.residual_floor, self.correlated_beams, self.displaced),
        )
        return Found(SE2.from_array(pose), covariance, explained, iterations)
