"""Which loop closures to believe: those that the graph foresees closely, and sets of those that agree with each other.

A closure is weighed by its evidence: the logarithm of how much likelier its error is when it is true (normal, with the covariance that
the graph foresees) than when it is false (any heading, spread like the errors of the closures that the graph refutes). One that the graph
could not foresee closely proves little by agreeing with it. It waits for others: the cycle of two closures and the odometry between their
ends is short even where the loop is long, and a set whose members foresee each other is tried as a whole. What costs more than leaving
it out is out, as in truncated least squares. In the spirit of Y. Latif, C. Cadena, J. Neira, "Robust loop closing over time for pose
graph SLAM" (IJRR 2013).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from slam.mapping.closure_links import compare
from slam.mapping.least_squares import LeastSquares
from slam.mapping.pose_edges import BoolArray, Edges, IndexArray
from slam.se2 import FloatArray

GATE = 16.27
"""Squared Mahalanobis distance that 99.9 % of true closures keep: chi-square, 3 degrees of freedom."""
REFUTED = 2.0 * GATE
"""Squared distance from what the others say beyond which a closure that was believed is dropped."""
BEND = 4.0
"""A set may bend the graph by this many gates: odometry may be this optimistic about its variances."""
FALSE_SHARE = 0.1
"""False closures believed in the mean."""
FEWEST = 10
"""Closures that stand for the spread of false ones, and for their number, before any is refuted; degrees of freedom that stand for the
stated variances before any loop is closed."""
SLACK = 2.0
"""Errors of true closures have longer tails than the normal distribution: their variance is taken this much larger than seen."""
SETS = 5
"""Sets believed before single closures are weighed again."""
FEW = 0.05
"""Share of the closures below which well foreseen ones are running out, so that sets are tried too."""
ROUNDS = 50
LEAST_SQUARE = 0.01
"""False closures err by 0.1 m at least, in the mean square [m^2]."""


@dataclass(frozen=True, eq=False)
class Selection:
    """What a graph and its C closures agree on."""

    poses: FloatArray
    """(N, 3), the optimum"""
    trusted: Edges
    closures: Edges
    accepted: BoolArray
    """(C,)"""
    solver: LeastSquares
    """Of the trusted edges and the accepted closures."""
    scale: float
    """What the stated variances are multiplied by, at most 1: many are stated far too large, and then false closures fit as well."""
    contested: int = 0
    """Closures in sets that agree with each other but not with the graph."""

    @classmethod
    def settled(cls, poses: FloatArray, trusted: Edges, closures: Edges, accepted: BoolArray, scale: float = 1.0) -> Selection:
        """The optimum from near `poses`, without those accepted closures that it does not explain."""
        while True:
            solver = LeastSquares(len(poses), trusted.and_(closures.of(accepted)))
            poses = solver.optimise(poses)
            explained = accepted & (closures.chi2(poses) <= GATE * scale)
            if np.array_equal(explained, accepted):
                return cls(poses, trusted, closures, accepted, solver, scale)
            accepted = explained

    def changed(self, numbers: IndexArray, accepted: bool) -> Selection:
        """With these closures accepted, or without them."""
        if len(numbers) == 0:
            return self
        changed = self.accepted.copy()
        changed[numbers] = accepted
        return Selection.settled(self.poses, self.trusted, self.closures, changed, self.scale)

    def rescaled(self) -> Selection:
        """With the variances that the loops closed so far show."""
        freedom = 3 * (len(self.solver.edges) - len(self.poses) + 1)
        return replace(self, scale=min(1.0, SLACK * (self.chi2 + FEWEST) / (freedom + FEWEST)))

    @cached_property
    def chi2(self) -> float:
        """e^T Omega e, summed over the trusted edges and the accepted closures."""
        return float(self.solver.edges.chi2(self.poses).sum())

    def cost(self, scale: float) -> float:
        """Truncated least squares: chi2, and the gate's worth for every closure left out."""
        return self.chi2 / scale + GATE * float(np.sum(~self.accepted))


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """How C closures look to the graph without each of them."""

    distance: FloatArray
    """(C,) squared Mahalanobis distance from what the graph foresees"""
    evidence: FloatArray
    """(C,) [nat]"""
    false_density: float
    """Logarithm of the density of a false closure's error [1/(m^2 rad)]"""
    threshold: float
    """Evidence from which a closure is believed: rises with the number that could be false [nat]"""


def select(start: Selection) -> Selection:
    """Believe closures until nothing changes: first those well foreseen, then sets."""
    now = start
    tried: set[tuple[int, ...]] = set()
    for _ in range(ROUNDS if len(start.closures) else 0):
        grown, weights = _reviewed(now.rescaled())
        more = ~grown.accepted & (weights.distance <= GATE) & (weights.evidence >= weights.threshold)
        grown = grown.changed(np.flatnonzero(more), True)
        if np.sum(more) < FEW * len(now.closures) and not np.all(grown.accepted):
            grown = _with_sets(grown, weights, tried)
        done = np.array_equal(grown.accepted, now.accepted)
        now = grown
        if done:
            break
    return replace(now, contested=len({member for members in tried for member in members if not now.accepted[member]}))


def _reviewed(now: Selection) -> tuple[Selection, Weights]:
    """Without the closures that the others refute, the worst first, as a false one makes true ones look bad."""
    while True:
        weights = _weigh(now)
        refuted = np.where(now.accepted, weights.distance, 0.0)
        if refuted.max() <= REFUTED:
            return now, weights
        now = now.changed(np.flatnonzero(refuted > max(REFUTED, 0.5 * refuted.max())), False)


def _weigh(now: Selection) -> Weights:
    errors, graph = now.solver.foresee(now.poses, now.closures)
    own = now.closures.covariance()
    distance = _distance(errors, now.scale * np.where(now.accepted[:, None, None], own - graph, own + graph))
    reach = np.median(np.sum(now.closures.measured[:, :2] ** 2, axis=1))
    refuted = ~now.accepted & (distance > GATE)
    square = (FEWEST * reach + np.sum(errors[refuted, :2] ** 2)) / (FEWEST + np.sum(refuted))  # [m^2]
    false_density = -float(np.log(math.tau * math.pi * max(square, LEAST_SQUARE)))
    threshold = math.log(max(int(np.sum(~now.accepted)), FEWEST) / FALSE_SHARE)
    return Weights(distance, _evidence(distance, now.scale * (own + graph), false_density), false_density, threshold)


def _with_sets(now: Selection, weights: Weights, tried: set[tuple[int, ...]]) -> Selection:
    """With up to SETS sets of closures that agree with each other and cost less than leaving them out; the others go to `tried`."""
    believed = 0
    for members in _sets(now, weights):
        key = tuple(members.tolist())
        if key in tried or believed == SETS:
            continue
        bend = float(weights.distance[members].min())
        hypothesis = now.changed(members, True) if bend <= GATE * min(len(members), BEND) else now
        if hypothesis.cost(now.scale) < now.cost(now.scale):
            now, believed = hypothesis, believed + 1
        else:
            tried.add(key)
    return now


def _sets(now: Selection, weights: Weights) -> list[IndexArray]:
    """Sets of two and more pending closures, the strongest first, whose evidence together is enough.

    A set's evidence is that of its root from the graph, and of each other member from the member that foresees it best.
    """
    pending = np.flatnonzero(~now.accepted).astype(np.int64)
    links = compare(now.poses, now.trusted, now.closures.of(pending))
    covariance = now.scale * links.covariance
    distance = _distance(links.errors, covariance)
    evidence = _evidence(distance, covariance, weights.false_density)
    agree = (distance <= GATE) & (evidence > 0.0)
    (a, b), count = links.pairs[agree].T, len(pending)
    number, labels = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(count, count)), directed=False)
    foreseen = np.zeros(count)
    np.maximum.at(foreseen, b, evidence[agree])
    root = np.full(number, -np.inf)
    np.maximum.at(root, labels, weights.evidence[pending] - foreseen)
    total = root + np.bincount(labels, weights=foreseen, minlength=number)
    enough = (total >= weights.threshold) & (np.bincount(labels, minlength=number) > 1)
    strongest = [label for label in np.argsort(-total, kind="stable") if enough[label]]
    return [pending[labels == label] for label in strongest]


def _distance(errors: FloatArray, covariance: FloatArray) -> FloatArray:
    return np.einsum("ni,nij,nj->n", errors, np.linalg.inv(covariance), errors)


def _evidence(distance: FloatArray, covariance: FloatArray, false_density: float) -> FloatArray:
    return -0.5 * distance - 0.5 * np.linalg.slogdet(math.tau * covariance)[1] - false_density
