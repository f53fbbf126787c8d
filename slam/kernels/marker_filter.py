"""A pose from markers that are known so well, and a marker from poses that are known so well.

Iterated extended Kalman updates in information form (Bell, Cathey 1993): the other side's uncertainty is part of the measurement's,
S = J Sigma J^T + N, for all corners of a sighting together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.marker_bundle import BEHIND, State, Views, jacobian, residuals
from slam.kernels.planar_pose import rotation

Floats = NDArray[np.float64]
ITERATIONS = 12
SETTLED = 1e-7


@njit
def locate(state: State, views: Views, covariances: Floats, prior: tuple[Floats, Floats], loss: float) -> tuple[Floats, Floats, Floats]:
    """Pose (3,), its information (3, 3) and every sighting's chi-square (S,); Cauchy's loss.

    Args:
        state: its first pose is where the search begins.
        views: sightings from that pose.
        covariances: (M, 6, 6) of the markers' translations and rotation vectors in the map.
        prior: mean (3,) and information (3, 3) of the pose.
        loss: chi-square at which a sighting counts half.
    """
    poses, R, t, C, c = state
    x = poses[0].copy()
    count = len(views[0])
    chi, information, g = np.empty(count), prior[1].copy(), np.empty(3)
    off, step = np.empty(3), np.empty(3)
    Jp, Jm, r = np.empty((8, 3)), np.empty((8, 6)), np.empty(8)
    for _ in range(ITERATIONS):
        off[:] = x - prior[0]
        off[2] -= 2.0 * np.pi * np.round(off[2] / (2.0 * np.pi))
        information[:], g[:] = prior[1], prior[1] @ off
        for s in range(count):
            if not _linearised((x.reshape(1, 3), R, t, C, c), views, (0, s), (Jp, Jm, r)):
                chi[s] = BEHIND
                continue
            W = _inverse(Jm @ covariances[views[1][s]] @ Jm.T + _noise(views[3][s]))
            chi[s] = r @ (W @ r)
            weight = 1.0 / (1.0 + chi[s] / loss)
            information += weight * (Jp.T @ W @ Jp)
            g += weight * (Jp.T @ (W @ r))
        step[:] = np.linalg.solve(information, -g)
        x += step
        if np.abs(step).max() < SETTLED:
            break
    return x, information, chi


@njit
def first_covariance(state: State, views: Views, which: int, pose: Floats) -> Floats:
    """Covariance (6, 6) of a marker that one sighting alone tells of, from a pose with a covariance (3, 3)."""
    Jp, Jm, r = np.empty((8, 3)), np.empty((8, 6)), np.empty(8)
    _linearised(state, views, (views[0][which], which), (Jp, Jm, r))
    W = _inverse(Jp @ pose @ Jp.T + _noise(views[3][which]))
    return _inverse(Jm.T @ W @ Jm + 1e-6 * np.eye(6))


@njit
def improve(state: State, views: Views, which: int, covariances: tuple[Floats, Floats], loss: float) -> float:
    """Update a marker in place by one sighting; returns its chi-square before.

    Args:
        state: poses and markers.
        views: sightings.
        which: the one that counts.
        covariances: (M, 6, 6) of the markers, updated too, and (3, 3) of the pose.
        loss: chi-square at which a sighting counts half.
    """
    i, m = views[0][which], views[1][which]
    Jp, Jm, r = np.empty((8, 3)), np.empty((8, 6)), np.empty(8)
    if not _linearised(state, views, (i, which), (Jp, Jm, r)):
        return BEHIND
    P = covariances[0][m]
    W = _inverse(Jp @ covariances[1] @ Jp.T + _noise(views[3][which]))
    S = _inverse(_inverse(W) + Jm @ P @ Jm.T)
    chi = float(r @ (S @ r))
    weight = 1.0 / (1.0 + chi / loss)
    prior = _inverse(P)
    start_t, moved = state[2][m].copy(), np.zeros(3)
    updated = P.copy()
    for _ in range(3):
        off = np.concatenate((state[2][m] - start_t, moved))
        updated = _inverse(prior + weight * (Jm.T @ W @ Jm))
        step = -updated @ (prior @ off + weight * (Jm.T @ (W @ r)))
        state[2][m] += step[:3]
        state[1][m] = rotation(step[3:]) @ state[1][m]
        moved += step[3:]
        if np.abs(step).max() < SETTLED or not _linearised(state, views, (i, which), (Jp, Jm, r)):
            break
    covariances[0][m] = 0.5 * (updated + updated.T)
    return chi


@njit
def _linearised(state: State, views: Views, which: tuple[int, int], out: tuple[Floats, Floats, Floats]) -> bool:
    """Write a sighting's Jacobians by the pose (8, 3) and by the marker (8, 6), and its residuals (8,); False when it is behind."""
    i, s = which
    Jp, Jm, r = out
    work, J = np.empty((4, 2)), np.empty((2, 15))
    m = views[1][s]
    if residuals(state, (i, m), (views[2][s], views[3][s], views[4][s]), work) >= BEHIND:
        return False
    for k in range(4):
        jacobian(state, (i, m, k), views[4][s], J)
        r[2 * k], r[2 * k + 1] = work[k, 0], work[k, 1]
        Jp[2 * k : 2 * k + 2] = J[:, :3]
        Jm[2 * k : 2 * k + 2] = J[:, 3:9]
    return True


@njit
def _inverse(A: Floats) -> Floats:
    """A^-1."""
    out = np.empty(A.shape)
    out[:] = np.linalg.inv(A)
    return out


@njit
def _noise(weights: Floats) -> Floats:
    """Covariance (8, 8) of a sighting's rays."""
    N = np.zeros((8, 8))
    for k in range(4):
        W = weights[k]
        determinant = W[0, 0] * W[1, 1] - W[0, 1] * W[1, 0]
        N[2 * k, 2 * k], N[2 * k + 1, 2 * k + 1] = W[1, 1] / determinant, W[0, 0] / determinant
        N[2 * k, 2 * k + 1] = N[2 * k + 1, 2 * k] = -W[0, 1] / determinant
    return N
