"""Normal equations of a graph of planar poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.block_cholesky import Factor, projected
from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Edges = tuple[Indices, Floats, Floats]
"""Nodes (E, 2), measured T_i_j (E, 3), information (E, 3, 3) in the frame of the measured j."""


@njit
def edge_chi2(poses: Floats, edges: Edges) -> Floats:
    """e^T Omega e (E,) of each edge."""
    nodes, measured, information = edges
    chi2 = np.empty(len(nodes))
    e, Ji, Jj = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for n in range(len(nodes)):
        _linearise(poses[nodes[n, 0]], poses[nodes[n, 1]], measured[n], e, Ji, Jj)
        total = 0.0
        for a in range(3):
            for b in range(3):
                total += e[a] * information[n, a, b] * e[b]
        chi2[n] = total
    return chi2


@njit
def assemble(poses: Floats, edges: Edges, order: Indices, slots: Indices, count: int) -> tuple[Floats, Floats, float]:
    """Blocks (count, 3, 3) of the upper triangle of J^T Omega J, right side (N, 3) = -J^T Omega e, both in elimination order, and chi2.

    Args:
        poses: (N, 3).
        edges: the graph.
        order: (N,) place of each node in the elimination order.
        slots: (E, 3) where the blocks (i, i), (j, j) and the one between them stand.
        count: blocks in all.
    """
    nodes, measured, information = edges
    H, g = np.zeros((count, 3, 3)), np.zeros((len(poses), 3))
    e, Ji, Jj = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    Wi, Wj = np.empty((3, 3)), np.empty((3, 3))
    chi2 = 0.0
    for n in range(len(nodes)):
        i, j = nodes[n]
        _linearise(poses[i], poses[j], measured[n], e, Ji, Jj)
        W = information[n]
        swapped = order[i] > order[j]
        for a in range(3):
            for b in range(3):
                Wi[a, b] = W[a, 0] * Ji[0, b] + W[a, 1] * Ji[1, b] + W[a, 2] * Ji[2, b]
                Wj[a, b] = W[a, 0] * Jj[0, b] + W[a, 1] * Jj[1, b] + W[a, 2] * Jj[2, b]
        for a in range(3):
            We = W[a, 0] * e[0] + W[a, 1] * e[1] + W[a, 2] * e[2]
            chi2 += e[a] * We
            for b in range(3):
                H[slots[n, 0], a, b] += Ji[0, a] * Wi[0, b] + Ji[1, a] * Wi[1, b] + Ji[2, a] * Wi[2, b]
                H[slots[n, 1], a, b] += Jj[0, a] * Wj[0, b] + Jj[1, a] * Wj[1, b] + Jj[2, a] * Wj[2, b]
                between = Ji[0, a] * Wj[0, b] + Ji[1, a] * Wj[1, b] + Ji[2, a] * Wj[2, b]
                if swapped:
                    H[slots[n, 2], b, a] += between
                else:
                    H[slots[n, 2], a, b] += between
                g[order[i], b] -= Ji[a, b] * We
                g[order[j], b] -= Jj[a, b] * We
    return H, g, chi2


@njit
def predictions(poses: Floats, edges: Edges, order: Indices, factor: Factor) -> tuple[Floats, Floats]:
    """Errors (E, 3) of the edges, and how uncertain the graph itself is of each: covariance (E, 3, 3) in the frame of the measured j."""
    nodes, measured, _ = edges
    errors, covariances = np.empty((len(nodes), 3)), np.empty((len(nodes), 3, 3))
    Ji, Jj, work = np.empty((3, 3)), np.empty((3, 3)), np.zeros((len(poses), 3, 3))
    for n in range(len(nodes)):
        i, j = nodes[n]
        _linearise(poses[i], poses[j], measured[n], errors[n], Ji, Jj)
        projected(factor, (int(order[i]), int(order[j])), (Ji, Jj), work, covariances[n])
    return errors, covariances


@njit
def _linearise(Ti: Floats, Tj: Floats, z: Floats, e: Floats, Ji: Floats, Jj: Floats) -> None:
    """Error T_z^-1 T_i^-1 T_j (3,) and its derivatives (3, 3) by the poses' x, y, yaw; kept in `e`, `Ji`, `Jj`."""
    yaw = Ti[2] + z[2]
    c, s = np.cos(yaw), np.sin(yaw)
    cz, sz = np.cos(z[2]), np.sin(z[2])
    dx, dy = Tj[0] - Ti[0], Tj[1] - Ti[1]
    x, y = c * dx + s * dy, c * dy - s * dx
    e[0] = x - (cz * z[0] + sz * z[1])
    e[1] = y - (cz * z[1] - sz * z[0])
    turn = Tj[2] - yaw
    e[2] = np.arctan2(np.sin(turn), np.cos(turn))
    Ji[0, 0], Ji[0, 1], Ji[0, 2] = -c, -s, y
    Ji[1, 0], Ji[1, 1], Ji[1, 2] = s, -c, -x
    Ji[2, 0], Ji[2, 1], Ji[2, 2] = 0.0, 0.0, -1.0
    Jj[0, 0], Jj[0, 1], Jj[0, 2] = c, s, 0.0
    Jj[1, 0], Jj[1, 1], Jj[1, 2] = -s, c, 0.0
    Jj[2, 0], Jj[2, 1], Jj[2, 2] = 0.0, 0.0, 1.0
