"""Bundle adjustment of a robot on a floor and markers in space: normal equations, and the poses eliminated.

Triggs, McLauchlan, Hartley, Fitzgibbon, "Bundle adjustment - a modern synthesis" (1999), section 6.1. Here the poses are eliminated:
they form a chain, their block is tridiagonal, and what is left has the size of the map, which does not grow with the way.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.planar_pose import SIGNS

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
State = tuple[Floats, Floats, Floats, Floats, Floats]
"""Poses (N, 3) x, y [m], yaw [rad] of base in the map; rotations (M, 3, 3) and translations (M, 3) [m] of the map from each marker;
rotation (3, 3) and translation (3,) [m] of base from the camera."""
Views = tuple[Indices, Indices, Floats, Floats, Floats]
"""Pose (S,), marker (S,), rays (S, 4, 2), their inverse covariances (S, 4, 2, 2), half a side (S,) [m] of every sighting."""
Steps = tuple[Floats, Floats]
"""Measured motion (N - 1, 3) from each pose to the next, in its frame, and its information (N - 1, 3, 3)."""
Normal = tuple[Floats, Floats, Floats, Floats, Floats, Floats]
"""Blocks of poses (N, 3, 3), of each with the next (N - 1, 3, 3), of poses with the rest (N, 3, n), of the rest (n, n), gradients
(N, 3), (n,): the rest are the free markers and, last, the mount."""
BEHIND = 1e12
"""Chi-square of a marker that would be behind the camera."""
NEAR = 0.01
"""Least depth of a corner [m]."""


@njit
def chi_squares(state: State, views: Views) -> Floats:
    """Squared reprojection errors (S,) over their variance."""
    pose, marker, rays, weights, half = views
    out, work = np.empty(len(pose)), np.empty((4, 2))
    for s in range(len(pose)):
        out[s] = residuals(state, (pose[s], marker[s]), (rays[s], weights[s], half[s]), work)
    return out


@njit
def normal_equations(state: State, views: Views, steps: Steps, places: tuple[Indices, int], loss: float) -> tuple[Normal, float]:
    """Normal equations at a state, and its cost.

    Args:
        state: where to linearise.
        views: the sightings; each weighs by 1 / (1 + chi2 / loss), Cauchy's loss.
        steps: motion from pose to pose.
        places: where each marker's six numbers stand among the rest, -1 for one that is known; how many numbers the rest has. Six
            more than the free markers take are the mount's.
        loss: chi-square of a sighting at which it counts half.
    """
    at, size = places
    poses, count = state[0], len(state[0])
    App, Aoff, B, D = np.zeros((count, 3, 3)), np.zeros((max(count - 1, 0), 3, 3)), np.zeros((count, 3, size)), np.zeros((size, size))
    bp, bd = np.zeros((count, 3)), np.zeros(size)
    cost = _add_steps(poses, steps, (App, Aoff, bp))
    free = 6 * int((at >= 0).sum())
    mount = free if size > free else -1
    work, J, WJ = np.empty((4, 2)), np.empty((2, 15)), np.empty((2, 15))
    H, g = np.empty((15, 15)), np.empty(15)
    for s in range(len(views[0])):
        i, m = views[0][s], views[1][s]
        chi = residuals(state, (i, m), (views[2][s], views[3][s], views[4][s]), work)
        cost += loss * np.log1p(chi / loss)
        if chi >= BEHIND:
            continue
        weight = 1.0 / (1.0 + chi / loss)
        H[:], g[:] = 0.0, 0.0
        for k in range(4):
            jacobian(state, (i, m, k), views[4][s], J)
            W = views[3][s, k]
            for c in range(15):
                WJ[0, c] = weight * (W[0, 0] * J[0, c] + W[0, 1] * J[1, c])
                WJ[1, c] = weight * (W[1, 0] * J[0, c] + W[1, 1] * J[1, c])
            for r in range(15):
                g[r] += WJ[0, r] * work[k, 0] + WJ[1, r] * work[k, 1]
                for c in range(r, 15):
                    H[r, c] += WJ[0, r] * J[0, c] + WJ[1, r] * J[1, c]
        for r in range(15):
            for c in range(r):
                H[r, c] = H[c, r]
        App[i] += H[:3, :3]
        bp[i] += g[:3]
        if at[m] >= 0:
            a = at[m]
            B[i, :, a : a + 6] += H[:3, 3:9]
            D[a : a + 6, a : a + 6] += H[3:9, 3:9]
            bd[a : a + 6] += g[3:9]
            if mount >= 0:
                D[a : a + 6, mount:] += H[3:9, 9:]
                D[mount:, a : a + 6] += H[9:, 3:9]
        if mount >= 0:
            B[i, :, mount:] += H[:3, 9:]
            D[mount:, mount:] += H[9:, 9:]
            bd[mount:] += g[9:]
    return (App, Aoff, B, D, bp, bd), cost


@njit
def eliminated(App: Floats, Aoff: Floats, B: Floats, bp: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Cholesky factor of the chain, diagonal blocks inverted (N, 3, 3) and blocks below (N - 1, 3, 3), and L^-1 of B and b."""
    count, size = len(App), B.shape[2]
    inverse, below = np.empty((count, 3, 3)), np.empty((max(count - 1, 0), 3, 3))
    Y, y = B.copy(), bp.copy()
    diagonal = np.empty((3, 3))
    for i in range(count):
        diagonal[:] = App[i]
        if i > 0:
            below[i - 1] = Aoff[i - 1].T @ inverse[i - 1].T
            diagonal -= below[i - 1] @ below[i - 1].T
            for r in range(3):
                for q in range(3):
                    factor = below[i - 1, r, q]
                    y[i, r] -= factor * y[i - 1, q]
                    for c in range(size):
                        Y[i, r, c] -= factor * Y[i - 1, q, c]
        inverse[i] = np.linalg.inv(np.linalg.cholesky(diagonal))
        y[i] = inverse[i] @ y[i]
        Y[i] = inverse[i] @ Y[i]
    return inverse, below, Y, y


@njit
def substituted(factor: tuple[Floats, Floats], Y: Floats, y: Floats, rest: Floats) -> Floats:
    """Steps (N, 3) of the poses from those of the rest (n,): L^T x = -(y + Y rest)."""
    inverse, below = factor
    count = len(inverse)
    x = np.empty((count, 3))
    for i in range(count - 1, -1, -1):
        right = -(y[i] + Y[i] @ rest)
        if i < count - 1:
            right -= below[i].T @ x[i + 1]
        x[i] = inverse[i].T @ right
    return x


@njit
def residuals(state: State, which: tuple[int, int], seen: tuple[Floats, Floats, float], out: Floats) -> float:
    """Write the four corners' residuals (4, 2); returns their chi-square."""
    poses, R, t, C, c = state
    i, m = which
    rays, weights, half = seen
    cos, sin = np.cos(poses[i, 2]), np.sin(poses[i, 2])
    chi = 0.0
    for k in range(4):
        X, Y = SIGNS[k, 0] * half, SIGNS[k, 1] * half
        px = R[m, 0, 0] * X + R[m, 0, 1] * Y + t[m, 0] - poses[i, 0]
        py = R[m, 1, 0] * X + R[m, 1, 1] * Y + t[m, 1] - poses[i, 1]
        qx, qy = cos * px + sin * py - c[0], -sin * px + cos * py - c[1]
        qz = R[m, 2, 0] * X + R[m, 2, 1] * Y + t[m, 2] - c[2]
        x = C[0, 0] * qx + C[1, 0] * qy + C[2, 0] * qz
        y = C[0, 1] * qx + C[1, 1] * qy + C[2, 1] * qz
        z = C[0, 2] * qx + C[1, 2] * qy + C[2, 2] * qz
        if not z > NEAR:
            return BEHIND
        r0, r1 = x / z - rays[k, 0], y / z - rays[k, 1]
        out[k] = r0, r1
        W = weights[k]
        chi += W[0, 0] * r0 * r0 + 2.0 * W[0, 1] * r0 * r1 + W[1, 1] * r1 * r1
    return min(chi, BEHIND)


@njit
def jacobian(state: State, which: tuple[int, int, int], half: float, J: Floats) -> None:
    """Write dr / d(pose, marker's translation and rotation in the map, mount's translation and rotation in base) (2, 15)."""
    poses, R, t, C, c = state
    i, m, k = which
    cos, sin = np.cos(poses[i, 2]), np.sin(poses[i, 2])
    X, Y = SIGNS[k, 0] * half, SIGNS[k, 1] * half
    ax, ay, az = R[m, 0, 0] * X + R[m, 0, 1] * Y, R[m, 1, 0] * X + R[m, 1, 1] * Y, R[m, 2, 0] * X + R[m, 2, 1] * Y
    px, py = ax + t[m, 0] - poses[i, 0], ay + t[m, 1] - poses[i, 1]
    bx, by = cos * px + sin * py, -sin * px + cos * py  # in base
    qx, qy, qz = bx - c[0], by - c[1], az + t[m, 2] - c[2]
    z = C[0, 2] * qx + C[1, 2] * qy + C[2, 2] * qz
    u = (C[0, 0] * qx + C[1, 0] * qy + C[2, 0] * qz) / z
    v = (C[0, 1] * qx + C[1, 1] * qy + C[2, 1] * qz) / z
    for r in range(2):
        ray = u if r == 0 else v
        dx, dy, dz = (C[0, r] - ray * C[0, 2]) / z, (C[1, r] - ray * C[1, 2]) / z, (C[2, r] - ray * C[2, 2]) / z
        mx, my, mz = cos * dx - sin * dy, sin * dx + cos * dy, dz  # by the point in the map
        J[r, 0], J[r, 1], J[r, 2] = -mx, -my, dx * by - dy * bx
        J[r, 3], J[r, 4], J[r, 5] = mx, my, mz
        J[r, 6], J[r, 7], J[r, 8] = mz * ay - my * az, mx * az - mz * ax, my * ax - mx * ay
        J[r, 9], J[r, 10], J[r, 11] = -dx, -dy, -dz
        J[r, 12], J[r, 13], J[r, 14] = dy * qz - dz * qy, dz * qx - dx * qz, dx * qy - dy * qx


@njit
def _add_steps(poses: Floats, steps: Steps, normal: tuple[Floats, Floats, Floats]) -> float:
    """Add the motion from pose to pose; returns its cost."""
    measured, information = steps
    App, Aoff, bp = normal
    cost = 0.0
    e, Ji, Jj = np.empty(3), np.zeros((3, 3)), np.zeros((3, 3))
    for i in range(len(measured)):
        cos, sin = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        x, y = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1]
        rx, ry = cos * x + sin * y, -sin * x + cos * y
        turn = poses[i + 1, 2] - poses[i, 2] - measured[i, 2]
        e[0], e[1], e[2] = rx - measured[i, 0], ry - measured[i, 1], turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
        Ji[0], Ji[1], Ji[2] = (-cos, -sin, ry), (sin, -cos, -rx), (0.0, 0.0, -1.0)
        Jj[0], Jj[1], Jj[2] = (cos, sin, 0.0), (-sin, cos, 0.0), (0.0, 0.0, 1.0)
        W = information[i]
        App[i] += Ji.T @ W @ Ji
        App[i + 1] += Jj.T @ W @ Jj
        Aoff[i] += Ji.T @ W @ Jj
        bp[i] += Ji.T @ (W @ e)
        bp[i + 1] += Jj.T @ (W @ e)
        cost += e @ (W @ e)
    return cost
