"""The best pose of a window over a score pyramid, however large the window is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.kernels import branch_and_bound as kernels
from slam.kernels.lattice import Lattice, cost_at
from slam.kernels.merging import merge
from slam.matching.score_pyramid import LEVELS, ScorePyramid
from slam.messages import read_only
from slam.se2 import SE2, FloatArray

ScanTables = tuple[ScorePyramid, FloatArray]
"""Score tables of a scan, and its points (N, 2) in base [m]."""
NEARBY = math.radians(1.0)
"""Turn to each side in which a pose is compared with another [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The best pose of a window."""

    T_map_base: SE2
    score: float
    """Mean over the points: 1 when all lie on surfaces, 0 when nothing is known there, below 0 when they lie where it is free."""
    covariance: FloatArray
    """(3, 3) of (x, y, yaw) in the map [m, rad], from the scores about the best pose."""
    ambiguity: float
    """Score of the best pose of another mode over that of the best; 0 where it is below the share that is looked for."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", read_only(self.covariance))


@dataclass(frozen=True, slots=True)
class BranchAndBound:
    """Correlative matching: Olson, "Real-time correlative scan matching" (2009), with the exact pruning of Hess et al. (2016)."""

    reach: float = 1.0
    """Window to each side in x and y of the map's cells [m]."""
    turn: float = math.radians(45.0)
    """Window to each side in heading [rad]."""
    step: float = 0.0
    """Heading step [rad]; 0: the one at which the farthest point moves by a cell."""
    penalty: float = 0.001
    """Mean score that a pose on the window's edge must gain to be preferred to one in its middle; the square of the distance counts."""
    correlated_beams: float = 1.0
    """Neighbouring beams share the map's errors: this many count as one independent in the covariance."""
    rival: float = 0.8
    """Other modes of less than this share of the best score are not looked for; none are at 1."""
    apart: tuple[float, float] = (0.3, math.radians(10.0))
    """Distance [m] and turn [rad] beyond which a pose is of another mode."""

    def __post_init__(self) -> None:
        require_positive(self, "correlated_beams")
        require_not_negative(self, "reach", "turn", "step", "penalty")
        if not 0.0 < self.rival <= 1.0:
            raise ParameterError(self, "rival", "above 0 and at most 1")

    def search(
        self,
        pyramid: ScorePyramid,
        points: FloatArray,
        centre: SE2,
        reach: float | None = None,
        turn: float | None = None,
        min_score: float = 0.0,
    ) -> Found | None:
        """Best pose `T_map_base` of the window about `centre` for points (M, 2) in base [m].

        Args:
            pyramid: of the map or the scan.
            points: in base; those that are not finite are left out.
            centre: middle of the window.
            reach: window to each side in x and y [m]; by default the field's.
            turn: window to each side in heading [rad]; by default the field's.
            min_score: that the pose must exceed; the higher, the faster the search.

        Returns:
            The pose; None where there is none above `min_score`.
        """
        thinned = _thinned(points, pyramid.resolution)
        if len(thinned) == 0:
            return None
        lattice = self._lattice(pyramid, thinned, centre, (self.reach if reach is None else reach, self.turn if turn is None else turn))
        return self._best(pyramid, thinned, lattice, min_score)

    def search_pair(self, target: ScanTables, source: ScanTables, centre: SE2) -> Found | None:
        """Best pose `T_target_source` of two scans, looked for both ways: of the two answers the one with the higher sum of scores.

        A wall of the target that the source should have seen speaks against a pose as much as the other way round. It matters in corridors.

        Args:
            target: score tables and points (N, 2) [m] of one scan.
            source: of the other.
            centre: middle of the window.

        Returns:
            The pose, its score the mean of both ways; None where one way finds nothing.
        """
        there = self.search(target[0], source[1], centre)
        back = self.search(source[0], target[1], centre.inverse())
        if there is None or back is None:
            return None
        poses = (there.T_map_base, back.T_map_base.inverse())
        scores = [self._mean_score(target, source, pose) for pose in poses]
        best = int(scores[1] > scores[0])
        return Found(poses[best], scores[best], there.covariance, max(there.ambiguity, back.ambiguity))

    def _mean_score(self, target: ScanTables, source: ScanTables, pose: SE2) -> float:
        """Mean over both ways of the best score within two cells and a degree of a pose; what is not found scores 0."""
        near = replace(self, turn=NEARBY, penalty=0.0, rival=1.0)
        ways = [
            near.search(target[0], source[1], pose, 2.0 * target[0].resolution),
            near.search(source[0], target[1], pose.inverse(), 2.0 * source[0].resolution),
        ]
        return 0.5 * sum(way.score for way in ways if way is not None)

    def _lattice(self, pyramid: ScorePyramid, thinned: FloatArray, centre: SE2, window: tuple[float, float]) -> Lattice:
        middle = pyramid.T_map_grid.inverse() @ centre
        farthest = max(float(np.hypot(thinned[:, 0], thinned[:, 1]).max()), 1.0)
        step = self.step or 1.0 / farthest
        cells, turns = math.ceil(window[0] / pyramid.resolution - 1e-9), math.ceil(window[1] / step - 1e-9)
        price = 255.0 * self.penalty * len(thinned)
        start = np.array([middle.x / pyramid.resolution, middle.y / pyramid.resolution, middle.yaw])
        return start, step, cells, turns, price / max(cells, 1) ** 2, price / max(turns, 1) ** 2

    def _best(self, pyramid: ScorePyramid, thinned: FloatArray, lattice: Lattice, min_score: float) -> Found | None:
        _, step, cells, turns, _, _ = lattice
        levels = min(LEVELS, max(0, (2 * cells + 1).bit_length() - 2))
        zero, span = float(pyramid.outside * len(thinned)), (255.0 - pyramid.outside) * len(thinned)
        headings, off = math.ceil(self.apart[1] / step), math.ceil(self.apart[0] / pyramid.resolution)
        share = self.rival if cells >= off or turns > headings else 1.0  # a window no wider than a mode has one
        limits = (zero + min_score * span, 255.0 * self.correlated_beams, share, headings, off)
        tables = (pyramid.tables[: levels + 1], pyramid.outside)
        best, rival, moments = kernels.find(tables, thinned, lattice, zero, limits)
        if best[1] < 0:
            return None
        score = (best[0] + cost_at(best[1:], lattice) - zero) / span
        ambiguity = (rival[0] - zero) / (best[0] - zero) if rival[1] >= 0 else 0.0
        in_grid = SE2(
            (lattice[0][0] + best[3]) * pyramid.resolution,
            (lattice[0][1] + best[2]) * pyramid.resolution,
            lattice[0][2] + (best[1] - turns) * step,
        )
        return Found(pyramid.T_map_grid @ in_grid, score, _covariance(moments, pyramid, step), ambiguity)


def _covariance(moments: FloatArray, pyramid: ScorePyramid, step: float) -> FloatArray:
    """(3, 3) of (x, y, yaw) in the map: Olson (2009), eq. 3-5, of all poses that are likely beside the best, and the lattice's own."""
    mean, second = moments[1:4] / moments[0], moments[[4, 5, 6, 5, 7, 8, 6, 8, 9]].reshape(3, 3) / moments[0]
    units = np.diag([pyramid.resolution, pyramid.resolution, step])
    units[:2, :2] = pyramid.T_map_grid.rotation() * pyramid.resolution
    return units @ (second - np.outer(mean, mean) + np.eye(3) / 12.0) @ units.T


def _thinned(points: FloatArray, resolution: float) -> FloatArray:
    """Points (K, 2) [cells], one for neighbours in a cell: near walls, hit by more beams, say no more than far ones."""
    finite = points[np.isfinite(points).all(axis=1)] / resolution
    return merge(finite, np.ones(len(finite), np.int64), 1.0)[0]
