"""Where in a known map a single scan was taken, from nothing; or that this cannot be said."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slam.errors import ParameterError, require_not_negative, require_positive
from slam.kernels import evidence, views
from slam.localization.known_map import KnownMap
from slam.localization.panoramas import BEARINGS, REACH, Panoramas
from slam.localization.whole_scan import WholeScan, whole_scan
from slam.matching.gauss_newton import GaussNewton
from slam.matching.match import no_prior
from slam.messages import read_only
from slam.se2 import SE2, FloatArray

SHAKES = np.array([[x, y, yaw] for x in (-0.3, 0.3) for y in (-0.3, 0.3) for yaw in (-0.2, 0.2)])
"""Starts about a pose that is refined again [reach; rad for a reach of 1 m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A place where the scan may have been taken."""

    T_map_base: SE2
    score: float
    """Tempered log-likelihood of the scan; the difference of two is the logarithm of how many times likelier the first one is."""
    covariance: FloatArray
    """(3, 3) of (x, y, yaw) in the map [m, rad], of the refinement alone."""
    explained: float
    """Share of the beams that are as they should be, 0 to 1."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", read_only(self.covariance))


@dataclass(frozen=True, slots=True)
class GlobalAnswer:
    """Ranked places."""

    hypotheses: tuple[Hypothesis, ...]
    """Best first; none where the scan fits nowhere at all."""
    ambiguous: bool
    """The first is not the only one, or explains too little to be believed."""
    reason: str
    """Why it is ambiguous; empty when it is not."""


@dataclass(frozen=True, slots=True)
class GlobalSearch:
    """Looks for the place of one scan in the whole map, at all headings.

    1. The scan, as ranges of sectors, is compared with what could be seen from every place (`Panoramas`) at every heading. Intervals
       make the comparison tolerant of what lies between two places and two headings, so the lattice may be coarse.
    2. The best are refined on the map's surfaces by Gauss-Newton.
    3. Each beam is cast from the refined poses: it must end at a wall, and must not pass through one or end in the open.
    4. The best pose is the answer, unless another one explains the scan about as well.
    """

    candidates: int = 60
    """Poses of the lattice that are refined."""
    reach: float = 0.3
    """First kernel of the refinement: how far the lattice's poses may be off [m]."""
    view_margin: float = 0.1
    """Mean cost by which a pose of the lattice may be above a neighbour's and still be refined."""
    view_span: float = 1.0
    """Mean cost by which a pose of the lattice may be above the best and still be refined."""
    shaken: int = 6
    """Poses that are refined from places around them once more."""
    beams: int = 240
    """Beams that are cast from each refined pose."""
    view_width: float = 0.05
    """Difference between a range and a view that costs one, and the width of view that costs log 2 [m]."""
    view_cost: float = 16.0
    """Largest cost of one sector: people and moved things."""
    range_sigma: float = 0.01
    """Standard deviation of near ranges [m]."""
    range_share: float = 0.01
    """Standard deviation of far ranges, as a share of the range."""
    map_sigma: float = 0.02
    """Standard deviation of the map's walls [m]."""
    unexpected: float = 0.05
    """Share of the beams that end where the map is free."""
    impossible: float = 0.01
    """Share of the beams that end beyond a wall, or see none where there is one."""
    correlated: float = 0.2
    """Beams within this angle are right or wrong together: they count as one [rad]."""
    odds: float = 20.0
    """How many times likelier than every other the best pose must be to be the only one."""
    explained: float = 0.6
    """Share of the beams that the only pose must explain."""
    apart: tuple[float, float] = (0.5, math.radians(20.0))
    """Distance [m] and turn [rad] beyond which a pose is another one."""
    matcher: GaussNewton = field(default_factory=GaussNewton)
    """Refines the poses."""

    def __post_init__(self) -> None:
        require_positive(
            self,
            "candidates",
            "shaken",
            "reach",
            "beams",
            "view_width",
            "view_cost",
            "range_sigma",
            "unexpected",
            "impossible",
            "correlated",
        )
        require_not_negative(self, "view_margin", "view_span", "range_share", "map_sigma", "explained")
        if not self.odds >= 1.0:
            raise ParameterError(self, "odds", "1 or above")

    def search(
        self, known_map: KnownMap, points: FloatArray, origins: FloatArray | None = None, clear: FloatArray | None = None
    ) -> GlobalAnswer:
        """Places where the scan may have been taken.

        Args:
            known_map: the map; what is derived from it is made at the first call.
            points: (M, 2) hits in base, deskewed [m].
            origins: (M, 2) where the laser was [m]; base, when not given.
            clear: (C, 2) ends, at the sensor's range, of the beams that met nothing, in base [m]. What is not there tells much in large
                places.
        """
        scan = whole_scan(points, origins, clear, self.beams)
        if scan is None:
            return GlobalAnswer((), True, "the scan has too few points to be looked for")
        found = self._weighed(known_map, scan, self._seen_from(known_map.panoramas, scan))
        return self._judged(self._shaken(known_map, scan, found))

    def judge(
        self, known_map: KnownMap, T_map_base: SE2, points: FloatArray, origins: FloatArray | None = None, clear: FloatArray | None = None
    ) -> Hypothesis:
        """How well one pose explains a scan, as `search` would rate it; not at all when it has too few points. Arguments as there."""
        scan = whole_scan(points, origins, clear, self.beams)
        if scan is None:
            return Hypothesis(T_map_base, -math.inf, np.zeros((3, 3)), 0.0)
        logs, fits = self._explained(known_map, scan, T_map_base.as_array()[None])
        return Hypothesis(T_map_base, self._score(scan, logs[0]), np.zeros((3, 3)), float(fits.mean()))

    def follow(
        self,
        known_map: KnownMap,
        poses: Sequence[SE2],
        points: FloatArray,
        origins: FloatArray | None = None,
        clear: FloatArray | None = None,
    ) -> list[Hypothesis]:
        """Places known from earlier scans, each refined on a new one and rated by it as `search` would; arguments as there."""
        scan = whole_scan(points, origins, clear, self.beams)
        if scan is None or not poses:
            return [Hypothesis(pose, -math.inf, np.zeros((3, 3)), 0.0) for pose in poses]
        starts = np.array([pose.as_array() for pose in poses])
        refined, covariances, converged = self._matched(known_map, scan, starts)
        refined = np.where(converged[:, None], refined, starts)
        covariances = np.where(converged[:, None, None], covariances, 0.0)
        logs, fits = self._explained(known_map, scan, refined)
        return [
            Hypothesis(SE2.from_array(refined[i]), self._score(scan, logs[i]), covariances[i], float(fits[i].mean()))
            for i in range(len(poses))
        ]

    def _seen_from(self, panoramas: Panoramas, scan: WholeScan) -> FloatArray:
        """The likeliest poses (K, 3) of base on the lattice, in the map."""
        sectors = scan.sectors(BEARINGS)
        model = (self.view_width, self.view_cost, min(scan.reach, REACH))
        costs = views.rate((panoramas.nearest, panoramas.farthest), sectors, model)
        found = views.valleys(costs, panoramas.neighbours, self.view_margin, float(costs.min()) + self.view_span)
        found = found[np.argsort(costs.reshape(-1)[found], kind="stable")][: self.candidates]
        T_laser_base = scan.T_base_laser.inverse()
        poses = [panoramas.T_map_grid @ panoramas.pose(*divmod(int(flat), BEARINGS)) @ T_laser_base for flat in found]
        return np.array([pose.as_array() for pose in poses]).reshape(-1, 3)

    def _weighed(self, known_map: KnownMap, scan: WholeScan, starts: FloatArray) -> list[Hypothesis]:
        """The refined poses, each mode once, best first."""
        poses, covariances, converged = self._matched(known_map, scan, starts)
        poses, covariances = poses[converged], covariances[converged]
        logs, fits = self._explained(known_map, scan, poses)
        scores = [self._score(scan, logs[i]) for i in range(len(logs))]
        hypotheses: list[Hypothesis] = []
        for i in sorted(range(len(scores)), key=lambda i: -scores[i]):
            pose = SE2.from_array(poses[i])
            if not any(same(pose, other.T_map_base, self.apart) for other in hypotheses):
                hypotheses.append(Hypothesis(pose, scores[i], covariances[i], float(fits[i].mean())))
        return hypotheses

    def _shaken(self, known_map: KnownMap, scan: WholeScan, hypotheses: list[Hypothesis]) -> list[Hypothesis]:
        """The first few, refined once more from places around them, as a refinement may end beside the best pose."""
        few = np.array([one.T_map_base.as_array() for one in hypotheses[: self.shaken]]).reshape(-1, 1, 3)
        starts = np.concatenate([few, few + SHAKES * self.reach], axis=1).reshape(-1, 3)
        return self._weighed(known_map, scan, starts)

    def _matched(self, known_map: KnownMap, scan: WholeScan, starts: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Poses (N, 3) and covariances (N, 3, 3) that Gauss-Newton makes of the starts (N, 3), and which converged."""
        m, surfaces = self.matcher, known_map.field
        settings = (m.iterations, self.reach, m.kernel_min, m.tolerance, m.shrink, m.lone_weight)
        noise = (m.residual_floor, m.correlated_beams, m.systematic)
        frame = surfaces.T_map_grid.as_array()
        field = (surfaces.nearest, surfaces.surfaces, surfaces.resolution)
        return evidence.refine(scan.points, starts, no_prior(), frame, field, settings, noise)

    def _explained(self, known_map: KnownMap, scan: WholeScan, poses: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Log-likelihood (K, N) of the beams at poses (K, 3), and whether each is as it should be."""
        surfaces, panoramas = known_map.field, known_map.panoramas
        in_grid = np.array([(surfaces.T_grid_map @ SE2.from_array(pose)).as_array() for pose in poses]).reshape(-1, 3)
        field = (surfaces.nearest, surfaces.surfaces, surfaces.resolution)
        squares = (panoramas.closed, panoramas.walls, panoramas.resolution)
        noise = (self.range_sigma, self.range_share, self.map_sigma, self.unexpected, self.impossible)
        return evidence.explain(in_grid, scan.beams, field, squares, noise)

    def _score(self, scan: WholeScan, logs: FloatArray) -> float:
        """Tempered log-likelihood of the beams (N,): those that are right or wrong together count as one."""
        return float(logs.sum()) / max(1.0, self.correlated / scan.spacing)

    def _judged(self, hypotheses: list[Hypothesis]) -> GlobalAnswer:
        if not hypotheses:
            return GlobalAnswer((), True, "the scan fits nowhere in the map")
        best = hypotheses[0]
        likely = tuple(one for one in hypotheses if best.score - one.score < math.log(self.odds))
        if best.explained < self.explained:
            return GlobalAnswer(likely, True, f"the best place explains only {100.0 * best.explained:.0f} % of the scan")
        if len(likely) > 1:
            return GlobalAnswer(likely, True, f"{len(likely)} places explain the scan about as well")
        return GlobalAnswer(likely, False, "")


def same(a: SE2, b: SE2, apart: tuple[float, float]) -> bool:
    """Whether two poses are of one mode: no farther apart than a distance [m] and a turn [rad]."""
    step = a.inverse() @ b
    return math.hypot(step.x, step.y) <= apart[0] and abs(step.yaw) <= apart[1]
