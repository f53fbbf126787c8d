"""What a robust registration whose residuals are not independent really knows, and what the prior must add.

The zero of the gradient g(x) = sum w J^T r scatters as N^-1 M N^-1: White, "Maximum likelihood estimation of misspecified
models" (1982), in clusters Liang, Zeger, "Longitudinal data analysis using generalized linear models" (1986). N is the slope
of g over a step as wide as the noise, with the correspondences made anew: fixed ones claim to know what they do not, along
a corridor or where a noisy map always has some surface near. M adds up g over blocks of neighbouring beams, which share the
map's errors. The information N M^-1 N is then weighed against the prior's, so that on a weak axis the prior decides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.symmetric import add_square, enclosed, inverse, is_positive, times, with_floor

Floats = NDArray[np.float64]
Residuals = tuple[Floats, Floats, Floats, Floats, int]
"""J (K, 3), r (K,), weight w (K,), where each one's point lies (K, 2) [m], and how many rows count; neighbours beside each other."""
Place = tuple[float, float, float]
"""Where the last point of an open block lies, x and y [m], and how long the block is so far [m]."""

H00, H01, H02, H11, H12, H22, S0, S1, S2, A0, A1, A2 = range(12)
"""Columns of a block: sums of w J^T J, w J^T r and w J^T."""
Sums = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
"""Of one block, in the order of its columns."""
ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Sums of no point."""
NOWHERE = (np.inf, np.inf, 0.0)
"""Before the first point."""
UNBOUNDED = np.zeros((3, 3))
"""Geometry that was not looked at."""
SURE = 1.0 / 0.008**2
"""Information that is more than chance slopes give: things too small to be lines may well give it [1/m^2]."""
NARROW = 0.25
"""Ratio of the worse to the better known axis below which a geometry may be a corridor."""
STEP = 0.02
"""Half the step over which the gradient's slope is measured: the width of a lidar's noise [m]."""
BLOCK = 0.5
"""Length of the wall whose beams count as one [m]."""
JUMP = 0.3
"""Neighbouring points farther apart lie on different things [m]."""


@njit
def opens_block(last: Place, x: float, y: float) -> tuple[bool, Place]:
    """Whether a point begins a new block, and the place to go on from."""
    step = max(abs(x - last[0]), abs(y - last[1]))  # near enough, and quick
    new = not (step <= JUMP and last[2] + step <= BLOCK)
    return new, (x, y, 0.0 if new else last[2] + step)


@njit
def close_block(blocks: Floats, k: int, sums: Sums) -> None:
    """Write the k-th block, of which there are those from 1 on: what is closed before the first point is nothing."""
    if k > 0:
        row = blocks[k - 1]
        (
            row[H00], row[H01], row[H02], row[H11], row[H12], row[H22],
            row[S0], row[S1], row[S2], row[A0], row[A1], row[A2],
        ) = sums  # fmt: skip


@njit
def blocks_of(residuals: Residuals) -> Floats:
    """Blocks (G, 12) of residuals."""
    J, r, w, places, n = residuals
    blocks = np.zeros((n, 12))
    last, k = NOWHERE, -1
    for i in range(n):
        new, last = opens_block(last, places[i, 0], places[i, 1])
        k += new
        b = blocks[k]
        for a in range(3):
            weighed = w[i] * J[i, a]
            b[S0 + a] += weighed * r[i]
            b[A0 + a] += weighed
        b[H00] += w[i] * J[i, 0] * J[i, 0]
        b[H01] += w[i] * J[i, 0] * J[i, 1]
        b[H02] += w[i] * J[i, 0] * J[i, 2]
        b[H11] += w[i] * J[i, 1] * J[i, 1]
        b[H12] += w[i] * J[i, 1] * J[i, 2]
        b[H22] += w[i] * J[i, 2] * J[i, 2]
    return blocks[: k + 1]


@njit
def narrow(blocks: Floats) -> bool:
    """Whether the residuals' normals may be those of a corridor."""
    a = b = d = 0.0
    for k in range(len(blocks)):
        a, b, d = a + blocks[k, H00], b + blocks[k, H01], d + blocks[k, H11]
    spread = np.sqrt(0.25 * (a - d) ** 2 + b * b)
    return 0.5 * (a + d) - spread < NARROW * (0.5 * (a + d) + spread)


@njit
def settle(blocks: Floats, N: Floats, prior: tuple[Floats, Floats], fisher: Floats, common: float) -> tuple[Floats, Floats]:
    """Where the answer should go from here (3,), and its covariance (3, 3).

    Args:
        blocks: (G, 12) here.
        N: (3, 3) the gradient's slope as `usable` makes it.
        prior: from the prior's mean to here (3,), and its covariance (3, 3).
        fisher: (3, 3) information that the scan's geometry can give at most, in the same frame; `UNBOUNDED` where it is not needed.
        common: standard deviation that the residuals of a block have in common beyond what is seen of it [m].
    """
    total = np.zeros(12)
    for k in range(len(blocks)):
        for i in range(12):
            total[i] += blocks[k, i]
    H = np.array([[total[H00], total[H01], total[H02]], [total[H01], total[H11], total[H12]], [total[H02], total[H12], total[H22]]])
    M = inverse(with_floor(_meat(blocks, inverse(with_floor(H)), total[S0 : S2 + 1], common)))
    G = enclosed(N, M)
    weak = _weakness(G, fisher) if fisher.any() else np.eye(3)
    information = inverse(prior[1])
    push = times(weak, times(weak, times(N, times(M, total[S0 : S2 + 1]))))
    covariance = inverse(enclosed(weak, G) + information)
    return times(covariance, -push - times(information, prior[0])), covariance


@njit
def _weakness(G: Floats, fisher: Floats) -> Floats:
    """A matrix S (3, 3) so that S G S claims no more than `fisher` along the axis of which that knows least."""
    a, b, d = fisher[0, 0], fisher[0, 1], fisher[1, 1]
    if fisher[2, 2] > 0.0:
        a -= fisher[0, 2] * fisher[0, 2] / fisher[2, 2]
        b -= fisher[0, 2] * fisher[1, 2] / fisher[2, 2]
        d -= fisher[1, 2] * fisher[1, 2] / fisher[2, 2]
    angle = 0.5 * np.arctan2(2.0 * b, a - d) + 0.5 * np.pi
    x, y = np.cos(angle), np.sin(angle)
    most = max(a * x * x + 2.0 * b * x * y + d * y * y, 0.0)
    claimed = G[0, 0] * x * x + 2.0 * G[0, 1] * x * y + G[1, 1] * y * y
    loss = 1.0 - np.sqrt(most / claimed) if most < claimed < SURE else 0.0
    S = np.eye(3)
    S[0, 0] -= loss * x * x
    S[0, 1] -= loss * x * y
    S[1, 0] -= loss * x * y
    S[1, 1] -= loss * y * y
    return S


@njit
def _meat(blocks: Floats, L: Floats, g: Floats, common: float) -> Floats:
    """Sum of the squared gradients of the blocks (3, 3) where the residuals' own answer is, L the inverse of their H."""
    M = np.zeros((3, 3))
    x0, x1, x2 = times(L, g)
    for k in range(len(blocks)):
        b = blocks[k]
        s0 = b[S0] - b[H00] * x0 - b[H01] * x1 - b[H02] * x2
        s1 = b[S1] - b[H01] * x0 - b[H11] * x1 - b[H12] * x2
        s2 = b[S2] - b[H02] * x0 - b[H12] * x1 - b[H22] * x2
        # (I - H L)^-1 s, the leave-one-out residuals, to the second order: a block that decides alone stays finite
        f0, f1, f2 = s0, s1, s2
        for _ in range(2):
            u0 = L[0, 0] * f0 + L[0, 1] * f1 + L[0, 2] * f2
            u1 = L[1, 0] * f0 + L[1, 1] * f1 + L[1, 2] * f2
            u2 = L[2, 0] * f0 + L[2, 1] * f1 + L[2, 2] * f2
            f0 = s0 + b[H00] * u0 + b[H01] * u1 + b[H02] * u2
            f1 = s1 + b[H01] * u0 + b[H11] * u1 + b[H12] * u2
            f2 = s2 + b[H02] * u0 + b[H12] * u1 + b[H22] * u2
        add_square(M, f0, f1, f2)
        add_square(M, common * b[A0], common * b[A1], common * b[A2])
    return M


@njit
def reach(points: NDArray[np.float64]) -> float:
    """How far points (M, 2) are, root mean square [m]: a slope by the heading is measured over `STEP` there."""
    squares = 0.0
    for i in range(len(points)):
        squares += points[np.uint32(i), 0] * points[np.uint32(i), 0] + points[np.uint32(i), 1] * points[np.uint32(i), 1]
    return max(np.sqrt(squares / max(len(points), 1)), STEP)


@njit
def usable(slope: Floats, reach: float) -> Floats:
    """The symmetric part of a measured slope (3, 3) without its negative eigenvalues; headings are weighed by `reach` [m]."""
    scale = np.array([1.0, 1.0, 1.0 / max(reach, 1e-3)])
    S = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            S[i, j] = 0.5 * (slope[i, j] + slope[j, i]) * scale[i] * scale[j]
    if not is_positive(S):
        values, vectors = np.linalg.eigh(S)
        for i in range(3):
            for j in range(3):
                S[i, j] = 0.0
                for k in range(3):
                    S[i, j] += max(values[k], 0.0) * vectors[i, k] * vectors[j, k]
    for i in range(3):
        for j in range(3):
            S[i, j] /= scale[i] * scale[j]
    return S
