"""The normal equations H x = -g of Gauss and Newton for a planar pose, and the step that they ask for beside a prior."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.symmetric import inverse

Floats = NDArray[np.float64]
Equations = tuple[float, float, float, float, float, float, float, float, float]
"""Sums of the rows of H on and above its diagonal, and of g."""


@njit
def write_equations(sums: Equations, n: int, H: Floats, g: Floats) -> None:
    """Write H (3, 3) and g (3,) of every n-th point, as if of all."""
    h00, h01, h02, h11, h12, h22, g0, g1, g2 = sums
    H[0, 0], H[0, 1], H[0, 2] = n * h00, n * h01, n * h02
    H[1, 0], H[1, 1], H[1, 2] = n * h01, n * h11, n * h12
    H[2, 0], H[2, 1], H[2, 2] = n * h02, n * h12, n * h22
    g[0], g[1], g[2] = n * g0, n * g1, n * g2


@njit
def descend(H: Floats, g: Floats, pose: Floats, prior: tuple[Floats, Floats]) -> float:
    """Move a pose (3,) by one step; returns its largest component [m or rad].

    `prior` is a mean (3,) and an information (3, 3) in units of H; what it pulls with is added to g.
    """
    mean, information = prior
    S = inverse(H + information)
    for i in range(3):
        for j in range(3):
            g[i] += information[i, j] * (pose[j] - mean[j])
    largest = 0.0
    for i in range(3):
        step = S[i, 0] * g[0] + S[i, 1] * g[1] + S[i, 2] * g[2]
        pose[i] -= step
        largest = max(largest, abs(step))
    return largest
