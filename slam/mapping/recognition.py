"""Recognising one submap: a search as wide as the uncertainty, and many reasons to refuse what it finds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_not_negative, require_positive
from slam.mapping.submap import Agreement, Submap
from slam.mapping.uncertainty import to_body
from slam.matching.branch_and_bound import BranchAndBound, ScorePyramid
from slam.matching.gauss_newton import GaussNewton
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class LoopClosing:
    """When a scan is believed to lie in a submap."""

    matcher: GaussNewton = field(default_factory=GaussNewton)
    search: BranchAndBound = field(default_factory=BranchAndBound)
    search_above: float = 0.3
    """Uncertainty, three standard deviations, above which the window is searched [m]."""
    farthest: float = 7.0
    """Widest window to each side [m]."""
    score_min: float = 0.45
    """Score of the search that is worth a closer look."""
    inliers_min: float = 0.6
    """Share of the scan's points that must lie on surfaces of the submap, on the side from which it was seen."""
    known_min: float = 0.7
    """Share of the scan's points that must lie where the submap knows what is there."""
    contradicting_max: float = 0.15
    """Largest share of points in what the submap saw as free: people walk, walls do not."""
    deviation_max: float = 0.04
    """Largest standard deviation along the weakest axis of a recognised pose [m]; 0.4 of it in the heading [rad]."""
    near: float = 1.0
    """Farthest from a kept scan of the submap, and in its sight, that a scan may be recognised [m]: what was seen from afar is bent."""
    ambiguity_max: float = 0.9
    """Largest score of another place, against the best one's."""
    agreement: float = 0.15
    """Two recognitions of a submap in a row must place it so near, and the graph a robot that goes over into it [m]; 0.3 of it in the
    heading [rad]."""
    searches: int = 2
    """Most submaps searched in one attempt."""
    gate: float = 16.27
    """Largest squared Mahalanobis distance from where the robot is expected (chi-square, 3 degrees of freedom, 99.9 %)."""
    slack: float = 0.01
    """What a submap may be bent by, beyond what its covariance says [m]; a third of it in the heading [rad]."""

    slip: float = 0.05
    """How much tracking may slip unnoticed from a submap to the next [m]; 0.4 of it in the heading [rad]."""

    def __post_init__(self) -> None:
        require_positive(self, "farthest", "gate", "deviation_max", "near")
        require_not_negative(self, "search_above", "score_min", "inliers_min", "known_min", "contradicting_max", "slack", "slip")

    def is_wide(self, covariance: FloatArray) -> bool:
        """Whether a body covariance (3, 3) asks for a search."""
        sigma, turn = math.sqrt(max(covariance[0, 0], covariance[1, 1])), math.sqrt(covariance[2, 2])
        return 3.0 * sigma > self.search_above or 3.0 * turn > self.search_above

    def satisfied(self, agreement: Agreement, inliers: float) -> bool:
        """Whether a scan with such a share of points on surfaces fits a submap."""
        fits = agreement.known >= self.known_min and agreement.contradicting <= self.contradicting_max
        return fits and inliers - agreement.behind >= self.inliers_min

    def slipping(self) -> FloatArray:
        """Covariance (3, 3) of the slip."""
        return np.diag([self.slip**2, self.slip**2, (0.4 * self.slip) ** 2])

    def loose(self) -> FloatArray:
        """Covariance (3, 3) of the slack."""
        return np.diag([self.slack**2, self.slack**2, (self.slack / 3.0) ** 2])


@dataclass(frozen=True, slots=True, eq=False)
class Recognition:
    """A scan found in a submap."""

    submap: int
    T_submap_base: SE2
    covariance: FloatArray
    """(3, 3) of the body."""
    known: float
    """Share of the scan's points that the submap knows."""
    inliers: float
    """Share of the scan's points on its surfaces."""
    searched: bool
    """Found by searching, not by refining what was expected."""


def recognise(
    settings: LoopClosing, submap: Submap, pyramid: ScorePyramid | None, cloud: PointScan, expected: tuple[SE2, FloatArray]
) -> Recognition | None:
    """The scan's place in the submap, or None.

    Args:
        settings: when to believe it.
        submap: to match to.
        pyramid: of its grid; without it only what is expected within `search_above` is refined.
        cloud: the scan.
        expected: `T_submap_base` and its body covariance (3, 3).
    """
    guess, covariance = expected
    searched = settings.is_wide(covariance)
    start: SE2 | None = guess
    if searched:
        start = _search(settings, pyramid, cloud, expected) if pyramid is not None else None
    if start is None:
        return None
    match = settings.matcher.match(submap.surfaces, cloud.points, start, np.diag([0.3**2, 0.3**2, 0.15**2]), settings.search_above)
    T_submap_base = match.T_target_source
    if not match.converged or match.inliers < settings.inliers_min or not submap.in_sight(T_submap_base, settings.near):
        return None
    agreement = submap.agreement(T_submap_base, cloud)
    if not settings.satisfied(agreement, match.inliers):
        return None
    body = to_body(np.array(match.covariance), T_submap_base) + settings.loose()
    if max(body[0, 0], body[1, 1], body[2, 2] / 0.16) > settings.deviation_max**2:
        return None
    error = (guess.inverse() @ T_submap_base).log()
    if error @ np.linalg.solve(covariance + body, error) > settings.gate:
        return None
    return Recognition(submap.number, T_submap_base, body, agreement.known, match.inliers, searched)


def _search(settings: LoopClosing, pyramid: ScorePyramid, cloud: PointScan, expected: tuple[SE2, FloatArray]) -> SE2 | None:
    guess, covariance = expected
    reach = min(3.0 * math.sqrt(max(covariance[0, 0], covariance[1, 1])) + 0.1, settings.farthest)
    turn = min(3.0 * math.sqrt(covariance[2, 2]) + 0.05, math.pi)
    found = settings.search.search(pyramid, cloud.points, guess, reach, turn, settings.score_min)
    if found is None or found.ambiguity > settings.ambiguity_max:
        return None
    return found.T_map_base
