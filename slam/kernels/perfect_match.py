"""Matching optimisation on the error table: Lauer, Lange, Riedmiller, "Calculating the perfect match" (RoboCup 2005)."""

from __future__ import annotations

import numpy as np

from slam.kernels.frames import into_frame, out_of_frame
from slam.kernels.fusion import fuse
from slam.kernels.jit import njit
from slam.kernels.rprop import Schedule, Stage, rprop
from slam.kernels.symmetric import inverse
from slam.kernels.table_error import Floats, Table, error, explained
from slam.kernels.uncertainty import turned


@njit
def locate(
    points: Floats,
    starts: Floats,
    prior: tuple[Floats, Floats, Floats],
    frame: Floats,
    table: Table,
    stages: tuple[Stage, Stage],
    schedule: Schedule,
    beams: tuple[int, int, float, float, float],
) -> tuple[Floats, Floats, float, int]:
    """`match` and `fuse` with starts (K, 3), prior and answer in the map; `frame` (3,) is T_map_table.

    `prior`: mean (3,) by odometry, covariance (3, 3) of the step since the last scan, covariance (3, 3) of the mean in all. The step's
    weighs odometry against the scan, so that what has moved in the world cannot draw the pose away at once; the answer's covariance is
    what all that is known gives.

    `beams`: points of both stages, standard deviation of a residual [m], residuals that count as one independent, standard deviation
    that the residuals of half a metre of wall have in common [m].

    Returns:
        pose (3,), its covariance (3, 3), share of the points within the last c of a wall, iterations in all.
    """
    few, more, sigma, together, common = beams
    mean = into_frame(prior[0], frame)
    begins = np.empty((len(starts), 3))
    for k in range(len(starts)):
        begins[k] = into_frame(starts[k], frame)
        begins[k, 2] = mean[2] + np.arctan2(np.sin(begins[k, 2] - mean[2]), np.cos(begins[k, 2] - mean[2]))
    covariance = turned(prior[1], -frame[2])
    variance = sigma * sigma * together
    pose, share, n = match(points, begins, table, stages, (mean, inverse(covariance)), schedule, (few, more, variance))
    pose, posterior = fuse(points, pose, table, stages[1][0], (mean, covariance), common)
    known = inverse(posterior) - inverse(covariance) + inverse(turned(prior[2], -frame[2]))
    return out_of_frame(pose, frame), turned(inverse(known), frame[2]), share, n


@njit
def match(
    points: Floats,
    starts: Floats,
    table: Table,
    stages: tuple[Stage, Stage],
    prior: tuple[Floats, Floats],
    schedule: Schedule,
    beams: tuple[int, int, float],
) -> tuple[Floats, float, int]:
    """The best pose reached from any start (K, 3): a first stage with few points and a wide c, a second with more and a narrow one.

    Args:
        points: (M, 2) [m] in base.
        starts: (K, 3).
        table: interpolants of the distance.
        stages: c, first and last steps of both.
        prior: mean (3,) and information (3, 3) of the pose [1/m^2], as they are.
        schedule: of RPROP.
        beams: points of the first and of the second stage; variance of a residual, its neighbours that share it counted in [m^2].

    Returns:
        pose (3,), share of the points within the last c of a wall, iterations in all.
    """
    few, more, variance = beams
    first, second = stages
    stride = max(1, len(points) // few)
    wide, narrow_c = (prior[0], prior[1] * (2.0 * variance / first[0] ** 2)), (prior[0], prior[1] * (2.0 * variance / second[0] ** 2))
    chosen, lowest, total = starts[0].copy(), np.inf, 0
    for k in range(len(starts)):
        pose, _, n = rprop(points, stride, starts[k], table, first, wide, schedule)
        total += n
        reached = np.inf
        if len(starts) > 1:
            reached = error(points, stride, pose, table, second[0], narrow_c, np.empty(3))
        if k == 0 or lowest > reached:
            chosen, lowest = pose, reached
    pose, _, n = rprop(points, max(1, len(points) // more), chosen, table, second, narrow_c, schedule)
    return pose, explained(points, pose, table, second[0]), total + n
