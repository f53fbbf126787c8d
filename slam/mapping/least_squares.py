"""Least squares over planar poses: Gauss-Newton, damped where it has to be, on a sparse Cholesky factor of 3 x 3 blocks.

G. Grisetti, R. Kuemmerle, C. Stachniss, W. Burgard, "A tutorial on graph-based SLAM" (IEEE ITS Magazine 2010), algorithm 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from slam.evaluation.poses import transform, wrap_angles
from slam.kernels import block_cholesky, pose_graph
from slam.mapping.chordal import chordal_poses
from slam.mapping.pose_edges import Edges, IndexArray
from slam.se2 import SE2, FloatArray

Equations = tuple[FloatArray, FloatArray, float]
"""Blocks (M, 3, 3) of H, right side (N, 3), chi2."""

ITERATIONS = 100
DECREASE = 1e-7
"""Relative decrease of chi2 below which the poses are the optimum."""
ANCHOR = 1e12
"""Information that holds node 0 where it is."""
LEAST_DAMPING, MOST_DAMPING = 1e-4, 1e6


class Descent(NamedTuple):
    """Where a descent ended."""

    poses: FloatArray
    chi2: float
    damped: bool
    """A step had to be damped: the guess was far off."""


class LeastSquares:
    """The optimum of edges that connect all nodes. The elimination order is found once, for the pattern of the edges."""

    def __init__(self, count: int, edges: Edges) -> None:
        self.edges = edges
        self._order = _elimination_order(count, edges.nodes)
        places = np.sort(self._order[edges.nodes], axis=1)  # (E, 2)
        keys = np.concatenate([np.arange(count) * (count + 1), places[:, 1] * count + places[:, 0]])
        blocks, slots = np.unique(keys, return_inverse=True)
        self._rows = (blocks % count).astype(np.int64)
        self._starts = np.searchsorted(blocks, np.arange(count + 1) * count).astype(np.int64)
        self._diagonal = slots[:count]
        self._slots = np.column_stack([self._diagonal[self._order[edges.nodes]], slots[count:]]).astype(np.int64)
        self._tree = block_cholesky.elimination(self._starts, self._rows)

    def optimise(self, poses: FloatArray) -> FloatArray:
        """Poses (N, 3) of least chi2; node 0 stays.

        From the guess `poses`. Where that is so far off that a Gauss-Newton step makes things worse, from the edges alone too.
        """
        found = self._descend(poses)
        if found.damped:
            T_map_first = SE2.from_array(poses[0])
            found = min(
                found, self._descend(transform(T_map_first, chordal_poses(len(poses), self.edges))), key=lambda descent: descent.chi2
            )
        return np.column_stack([found.poses[:, :2], wrap_angles(found.poses[:, 2])])

    def _descend(self, poses: FloatArray) -> Descent:
        """Gauss-Newton; a step that does not help is damped."""
        damping, damped = 0.0, False
        now = self._assemble(poses)
        for _ in range(ITERATIONS):
            tried = poses + self._step(now, damping)
            there = self._assemble(tried)
            gain = now[2] - there[2]
            if gain >= 0.0:
                poses, now = tried, there
                damping = 0.1 * damping if damping > LEAST_DAMPING else 0.0
            if abs(gain) <= DECREASE * now[2] or damping > MOST_DAMPING:
                break
            if not gain >= 0.0:
                damping, damped = max(10.0 * damping, LEAST_DAMPING), True
        return Descent(poses, now[2], damped)

    def foresee(self, poses: FloatArray, edges: Edges) -> tuple[FloatArray, FloatArray]:
        """Errors (E, 3) of any edges at the optimum `poses`, and the covariance (E, 3, 3) of what the graph says of them, in their j."""
        factor, _ = block_cholesky.factorise(self._starts, self._rows, self._assemble(poses)[0], self._tree)
        return pose_graph.predictions(poses, edges.arrays, self._order, factor)

    def _step(self, equations: Equations, damping: float) -> FloatArray:
        """Gauss-Newton step (N, 3), damped as Marquardt has it; nan where the damped matrix is still singular."""
        H, g, _ = equations
        damped = H.copy()
        damped[self._diagonal] *= 1.0 + damping * np.eye(3)
        factor, positive = block_cholesky.factorise(self._starts, self._rows, damped, self._tree)
        return block_cholesky.solve(factor, g)[self._order] if positive else np.full_like(g, np.nan)

    def _assemble(self, poses: FloatArray) -> Equations:
        H, g, chi2 = pose_graph.assemble(poses, self.edges.arrays, self._order, self._slots, len(self._rows))
        first = self._order[0]
        H[self._diagonal[first]] += ANCHOR * np.eye(3)
        g[first] = 0.0
        return H, g, chi2


def _elimination_order(count: int, nodes: IndexArray) -> IndexArray:
    """Place (N,) of each node in SuperLU's minimum degree order, which keeps the factor sparse."""
    degree = np.bincount(nodes.ravel(), minlength=count) + 1.0
    i, j = np.vstack([nodes, nodes[:, ::-1], np.repeat(np.arange(count)[:, None], 2, axis=1)]).T
    laplacian = coo_array((np.concatenate([np.full(2 * len(nodes), -1.0), degree]), (i, j)), shape=(count, count)).tocsc()
    factor = splu(laplacian, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return factor.perm_c.astype(np.int64)
