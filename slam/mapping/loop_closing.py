"""Recognising submaps: a search as wide as the uncertainty, and many reasons to refuse what it finds."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_not_negative, require_positive
from slam.mapping.submap import Agreement, Submap
from slam.mapping.submaps import UNPACKED, Closure, Link, Submaps
from slam.mapping.uncertainty import composed, inverted, to_body
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
    """Two recognitions of a submap in a row must place it so near [m]; 0.3 of it in the heading [rad]."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Here:
    """A scan, and where the robot is in the current submap."""

    current: int
    T_current_base: SE2
    covariance: FloatArray
    """(3, 3) of the body."""
    cloud: PointScan


@dataclass(frozen=True, slots=True, eq=False)
class _Sighting:
    """A submap recognised by searching: believed when the next sighting, of it or of another, says the same."""

    current: int
    T_map_current: SE2


class LoopCloser:
    """Ties the current submap to others in which the robot recognises where it is."""

    def __init__(self, settings: LoopClosing, submaps: Submaps) -> None:
        self._settings = settings
        self._submaps = submaps
        self._pyramids: dict[int, tuple[int, ScorePyramid]] = {}
        self._sighting: _Sighting | None = None

    def around(self, here: Here, radius: float) -> Iterator[Recognition]:
        """Submaps whose origin may lie within `radius` [m] and that are recognised, nearest first."""
        searches = 0
        for other, expected in self._candidates(here, radius):
            wide = self._settings.is_wide(expected[1])
            if wide and (searches >= self._settings.searches or self._submaps.tied(other.number, here.current)):
                continue
            searches += wide
            pyramid = self._pyramid(other) if wide else None
            found = recognise(self._settings, self._submaps.use(other.number), pyramid, here.cloud, expected)
            if found is not None and self._confirmed(found, here):
                yield found

    def anywhere(self, cloud: PointScan, T_map_base: SE2) -> Recognition | None:
        """The scan's place among all submaps: about the expected pose, else wherever only one submap knows it best."""
        near = np.diag([0.3, 0.3, 0.2]) ** 2
        far = np.diag([self._settings.farthest, self._settings.farthest, math.pi]) ** 2
        by_distance = sorted(self._submaps.all, key=lambda submap: _distance(submap.T_map_submap, T_map_base))
        for submap in by_distance[:3]:
            expected = (submap.T_map_submap.inverse() @ T_map_base, near)
            found = recognise(self._settings, self._submaps.use(submap.number), self._pyramid(submap), cloud, expected)
            if found is not None:
                return found
        found = [
            recognise(self._settings, self._submaps.use(submap.number), self._pyramid(submap), cloud, (SE2(), far))
            for submap in by_distance
        ]
        return max((one for one in found if one is not None), key=lambda one: one.known * one.inliers, default=None)

    def _candidates(self, here: Here, radius: float) -> list[tuple[Submap, tuple[SE2, FloatArray]]]:
        """Submaps whose region may hold the robot, nearest first, with the expected `T_submap_base` and its body covariance."""
        chains = self._submaps.relative(here.current)
        T_map_current = self._submaps[here.current].T_map_submap
        T_map_base = T_map_current @ here.T_current_base
        found: list[tuple[float, Submap, tuple[SE2, FloatArray]]] = []
        for other in self._submaps.all:
            if other.number == here.current or _distance(other.T_map_submap, T_map_base) >= radius + self._settings.farthest:
                continue
            T_other_current = other.T_map_submap.inverse() @ T_map_current
            relative = inverted(chains[other.number], T_other_current.inverse())
            expected, covariance = T_other_current @ here.T_current_base, composed(relative, here.T_current_base, here.covariance)
            distance, reach = math.hypot(expected.x, expected.y), 3.0 * math.sqrt(max(covariance[0, 0], covariance[1, 1]))
            if distance < radius + min(reach, self._settings.farthest):
                found.append((distance, other, (expected, covariance)))
        return [(other, place) for _, other, place in sorted(found, key=lambda item: item[0])]

    def _pyramid(self, submap: Submap) -> ScorePyramid:
        scans, pyramid = self._pyramids.pop(submap.number, (-1, None))
        if pyramid is None or scans != submap.scans:
            pyramid = ScorePyramid.of(submap.grid)
        self._pyramids[submap.number] = (submap.scans, pyramid)
        if len(self._pyramids) > UNPACKED:
            del self._pyramids[next(iter(self._pyramids))]
        return pyramid

    def _confirmed(self, found: Recognition, here: Here) -> bool:
        """What was searched for must be found twice, in the same place."""
        if not found.searched:
            return True
        T_map_current = self._submaps[found.submap].T_map_submap @ found.T_submap_base @ here.T_current_base.inverse()
        before, self._sighting = self._sighting, _Sighting(here.current, T_map_current)
        if before is None or before.current != here.current:
            return False
        change = before.T_map_current.inverse() @ T_map_current
        return math.hypot(change.x, change.y) < self._settings.agreement and abs(change.yaw) < 0.3 * self._settings.agreement

    def close(self, found: Recognition, here: Here) -> None:
        """Tie the two submaps and settle the graph; one link between two is enough."""
        if self._submaps.tied(found.submap, here.current):
            return
        T_base_current = here.T_current_base.inverse()
        Ad = here.T_current_base.adjoint()
        covariance = Ad @ (found.covariance + here.covariance) @ Ad.T
        T_other_current = found.T_submap_base @ T_base_current
        self._submaps.tie(Link(found.submap, here.current, T_other_current, covariance, closure=True, seen=self._seen(found, here)))
        self._submaps.settle()

    def _seen(self, found: Recognition, here: Here) -> Closure | None:
        kept = self._submaps[found.submap].keyframes
        near = min(kept, key=lambda keyframe: _distance(keyframe.T_submap_base, found.T_submap_base), default=None)
        return None if near is None else Closure(near.stamp, here.cloud.stamp, near.T_submap_base.inverse() @ found.T_submap_base)


def _distance(T_map_a: SE2, T_map_b: SE2) -> float:
    return math.hypot(T_map_a.x - T_map_b.x, T_map_a.y - T_map_b.y)
