"""Poses of a graph from its edges alone, without a guess.

L. Carlone, R. Tron, K. Daniilidis, F. Dellaert, "Initialization techniques for 3D SLAM" (ICRA 2015), section III: headings as unit
complex numbers, first as a linear problem and then projected on the circle; positions after them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from slam.mapping.pose_edges import Edges, IndexArray
from slam.se2 import FloatArray

ComplexArray = NDArray[np.complex128]


def chordal_poses(count: int, edges: Edges) -> FloatArray:
    """Poses (N, 3) of connected edges, node 0 at the origin: near the optimum unless the measured headings are very bad."""
    turn = np.exp(1j * edges.measured[:, 2])
    heading = _solve(count, edges.nodes, edges.information[:, 2, 2], turn, np.zeros(len(edges), np.complex128), 1.0)
    heading /= np.abs(heading)
    way = heading[edges.nodes[:, 0]] * (edges.measured[:, 0] + 1j * edges.measured[:, 1])
    weight = 0.5 * (edges.information[:, 0, 0] + edges.information[:, 1, 1])
    place = _solve(count, edges.nodes, weight, np.ones(len(edges), np.complex128), way, 0.0)
    return np.column_stack([place.real, place.imag, np.angle(heading)])


def _solve(count: int, nodes: IndexArray, weight: FloatArray, factor: ComplexArray, offset: ComplexArray, first: complex) -> ComplexArray:
    """Return x (N,) with x_0 = `first` that minimises the sum of weight |x_j - factor x_i - offset|^2."""
    i, j = nodes.T
    rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
    between = -weight * factor
    values = np.concatenate([weight * np.abs(factor) ** 2, weight, between.conj(), between])
    A = coo_array((values, (rows, columns)), shape=(count, count)).tocsc()
    b = np.zeros(count, np.complex128)
    np.add.at(b, j, weight * offset)
    np.add.at(b, i, -weight * factor.conj() * offset)
    free = slice(1, None)
    b = b[free] - A[free, [0]].toarray().ravel() * first
    x = splu(A[free, free].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve(b)
    return np.concatenate([[first], x])
