"""Which loop closures agree with each other: the cycles of two closures and the odometry between their ends.

J. Mangelson, D. Dominic, R. Eustice, R. Vasudevan, "Pairwise consistent measurement set maximization for robust multi-robot map
merging" (ICRA 2018), equation 3, for closures whose ends lie near each other on the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from slam.evaluation.poses import compose, relative
from slam.mapping.pose_edges import Edges, IndexArray
from slam.se2 import FloatArray

NEIGHBOURS = 8
"""Closures that each is compared with: those whose ends are fewest nodes away."""


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """L pairs of closures that were compared."""

    pairs: IndexArray
    """(L, 2) of a, b"""
    errors: FloatArray
    """(L, 3) of b, as foreseen by a and the odometry between their ends, in b's newer node"""
    covariance: FloatArray
    """(L, 3, 3) of it"""


def compare(poses: FloatArray, trusted: Edges, closures: Edges) -> Links:
    """Compare each closure with its neighbours on the way; the ends of a pair must be joined by a chain k -> k + 1 of trusted edges."""
    spread, piece = _chain(poses, trusted)
    ends = closures.nodes.astype(np.float64)
    _, near = KDTree(ends).query(ends, k=min(NEIGHBOURS + 1, len(closures)), p=1)
    near = near.reshape(len(closures), -1)
    pairs = np.column_stack([np.repeat(np.arange(len(closures)), near.shape[1]), near.ravel()]).astype(np.int64)
    chained = np.all(piece[closures.nodes[pairs[:, 0]]] == piece[closures.nodes[pairs[:, 1]]], axis=1)
    return _cycles(poses, spread, closures, pairs[(pairs[:, 0] != pairs[:, 1]) & chained])


def _chain(poses: FloatArray, trusted: Edges) -> tuple[FloatArray, IndexArray]:
    """Covariance (N, 3, 3) of the twist, in the map, that the chain k -> k + 1 gathers up to each node; number (N,) of its piece."""
    step = trusted.of(trusted.nodes[:, 1] - trusted.nodes[:, 0] == 1)
    ends = step.nodes[:, 1]
    gathered, joined = np.zeros((len(poses), 3, 3)), np.zeros(len(poses), np.bool_)
    gathered[ends] = _carried(adjoints(poses[ends]), step.covariance())
    joined[ends] = True
    return np.cumsum(gathered, axis=0), np.cumsum(~joined).astype(np.int64)


def _cycles(poses: FloatArray, spread: FloatArray, closures: Edges, pairs: IndexArray) -> Links:
    """T_ib_jb as T_ib_ia T_ia_ja T_ja_jb says, against its measurement; first-order covariance."""
    a, b = pairs.T
    (ia, ja), (ib, jb) = closures.nodes[a].T, closures.nodes[b].T
    T_ja_jb = relative(poses[ja], poses[jb])
    T_ia_jb = compose(closures.measured[a], T_ja_jb)
    foreseen = compose(relative(poses[ib], poses[ia]), T_ia_jb)
    own = closures.covariance()
    to_jb = adjoints(_inverse(poses[jb]))
    covariance = own[b] + _carried(adjoints(_inverse(T_ja_jb)), own[a]) + _carried(to_jb, _between(spread, ja, jb))
    covariance += _carried(adjoints(_inverse(T_ia_jb)) @ adjoints(_inverse(poses[ia])), _between(spread, ia, ib))
    return Links(pairs, relative(foreseen, closures.measured[b]), covariance)


def _between(spread: FloatArray, k: IndexArray, m: IndexArray) -> FloatArray:
    """Covariance (L, 3, 3) of the chain from nodes k to nodes m, whichever comes first."""
    return spread[np.maximum(k, m)] - spread[np.minimum(k, m)]


def adjoints(poses: FloatArray) -> FloatArray:
    """Adjoint matrices (N, 3, 3), see `SE2.adjoint`."""
    Ad = np.zeros((len(poses), 3, 3))
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    Ad[:, 0, 0], Ad[:, 0, 1], Ad[:, 0, 2] = c, -s, poses[:, 1]
    Ad[:, 1, 0], Ad[:, 1, 1], Ad[:, 1, 2] = s, c, -poses[:, 0]
    Ad[:, 2, 2] = 1.0
    return Ad


def _carried(A: FloatArray, covariance: FloatArray) -> FloatArray:
    return A @ covariance @ A.transpose(0, 2, 1)


def _inverse(poses: FloatArray) -> FloatArray:
    return relative(poses, np.zeros_like(poses))
