"""Resilient propagation on the error table: Riedmiller, Braun, "A direct adaptive method for faster backpropagation learning" (1993)."""

from __future__ import annotations

import numpy as np

from slam.kernels.jit import njit
from slam.kernels.table_error import Floats, Prior, Table, error

Stage = tuple[float, Floats, Floats]
"""c [m], first steps (3,), steps below which it has converged (3,) [m, m, rad]."""
Schedule = tuple[int, float, float]
"""Most iterations, factors by which steps grow and shrink."""


@njit
def rprop(
    points: Floats,
    stride: int,
    start: Floats,
    table: Table,
    stage: Stage,
    prior: Prior,
    schedule: Schedule,
) -> tuple[Floats, float, int]:
    """The pose where E is lowest: only the sign of each component of the gradient steers, each its own step.

    Args:
        points: (M, 2) [m] in base, of which every `stride`-th counts.
        stride: see points.
        start: (3,) pose.
        table: interpolants of the distance.
        stage: c [m], first steps (3,), steps below which it has converged (3,) [m, m, rad].
        prior: what odometry says, in units of E.
        schedule: most iterations, growth and shrinkage of steps.

    Returns:
        pose (3,), E there, iterations.
    """
    c, first, last = stage
    most, grow, shrink = schedule
    pose, step = start.copy(), first.copy()
    gradient, before, best = np.zeros(3), np.zeros(3), start.copy()
    lowest, n = np.inf, 0
    while n < most:
        n += 1
        E = error(points, stride, pose, table, c, prior, gradient)
        if lowest > E:
            lowest = E
            best[:] = pose
        small = True
        for k in range(3):
            product = gradient[k] * before[k]
            if product > 0.0:
                step[k] = min(step[k] * grow, 2.5 * first[k])
            elif product < 0.0:
                step[k] = max(step[k] * shrink, 0.2 * last[k])
            small &= step[k] < last[k]
            pose[k] -= step[k] * np.sign(gradient[k])
            before[k] = gradient[k]
        if small:
            break
    return best, lowest, n
