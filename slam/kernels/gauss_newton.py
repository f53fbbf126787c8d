"""Gauss-Newton registration of points on the nearest-surface field."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.frames import into_frame, out_of_frame
from slam.kernels.jit import njit
from slam.kernels.localizability import RANGE_NOISE
from slam.kernels.localizability import information as scan_information
from slam.kernels.meetings import BEHIND, NOTHING, added, flat_of, judged, meeting, placed_at
from slam.kernels.normal_equations import descend, write_equations
from slam.kernels.sandwich import NOWHERE, S0, STEP, UNBOUNDED, ZERO, close_block, narrow, opens_block, reach, settle, usable
from slam.kernels.surfaces import Field
from slam.kernels.symmetric import inverse
from slam.kernels.uncertainty import turned

COARSE, SLOPE = 100, 75
"""At least so many points, evenly spread, show the way and measure the slope; all of them are asked at the end."""


@njit
def match(
    points: NDArray[np.float64],
    start: NDArray[np.float64],
    prior: tuple[NDArray[np.float64], NDArray[np.float64]],
    field: Field,
    settings: tuple[int, float, float, float, float, float],
    noise: tuple[float, float, float],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, bool, int]:
    """Minimise sum rho(d(T p_i)) / variance + prior over the pose; d is the distance to the nearest surface.

    Args:
        points: (M, 2) [m] in base.
        start: (3,) x, y, yaw in the grid's frame.
        prior: mean (3,) in the grid's frame and covariance (3, 3).
        field: the map's surfaces.
        settings: most iterations, first and last kernel width [m], step below which it has converged [m or rad],
            share of the kernel width kept each iteration, weight of a lone point against a line.
        noise: least standard deviation of a residual [m], residuals that count as one independent beside the prior, share of
            the residual that neighbours have in common.

    Returns:
        pose (3,), its covariance (3, 3), RMS residual [m], share of points within the last kernel of a surface, converged, iterations.
    """
    iterations, kernel, kernel_last, tolerance, shrink, lone = settings
    variance = noise[0] * noise[0] * noise[1]
    mean, information = prior[0], inverse(prior[1]) * variance
    pose = start.copy()
    H, g = np.zeros((3, 3)), np.zeros(3)
    few = max(1, len(points) // COARSE)
    largest, n = np.inf, 0
    while n < iterations:
        n += 1
        normal_equations((points, few), pose, field, (kernel, lone), H, g)
        largest = descend(H, g, pose, (mean, information))
        if kernel == kernel_last and largest < tolerance:
            break
        kernel = max(kernel_last, shrink * kernel)
    # a point that hops between two surfaces keeps the last steps above the tolerance, but below 2 cm
    return _settled(points, pose, (mean, prior[1]), field, (kernel_last, lone), noise, (largest < 20.0 * tolerance, n))


@njit
def _settled(
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    prior: tuple[NDArray[np.float64], NDArray[np.float64]],
    field: Field,
    kernel: tuple[float, float],
    noise: tuple[float, float, float],
    so_far: tuple[bool, int],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, bool, int]:
    """The last steps, with all points, and the covariance; as `match`."""
    converged, n = so_far
    blocks, rms, share = _blocks(points, pose, field, kernel)
    fisher, stride = UNBOUNDED, max(1, len(points) // SLOPE)
    if narrow(blocks):  # a corridor, of which a few beams may see the end: seldom, and it takes as long again
        fisher, stride = turned(scan_information(points, RANGE_NOISE), pose[2]), 1
    slope = _slope((points, stride), pose, field, kernel)
    step, covariance = settle(blocks, slope, (pose - prior[0], prior[1]), fisher, noise[2] * max(rms, noise[0]))
    if np.abs(step).max() > 0.25 * STEP:
        pose = pose + step
        blocks, rms, share = _blocks(points, pose, field, kernel)
        step, covariance = settle(blocks, slope, (pose - prior[0], prior[1]), fisher, noise[2] * max(rms, noise[0]))
    return pose + step, covariance, rms, share, converged, n + 1


@njit
def match_in_map(
    points: NDArray[np.float64],
    start: NDArray[np.float64],
    prior: tuple[NDArray[np.float64], NDArray[np.float64]],
    frame: NDArray[np.float64],
    field: Field,
    settings: tuple[int, float, float, float, float, float],
    noise: tuple[float, float, float],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, bool, int]:
    """`match` with start, prior and answer in the map; `frame` (3,) is T_map_grid."""
    mean = into_frame(prior[0], frame)
    begin = into_frame(start, frame)
    mean[2] = begin[2] + np.arctan2(np.sin(mean[2] - begin[2]), np.cos(mean[2] - begin[2]))
    covariance = turned(prior[1], -frame[2])
    pose, covariance, rms, share, converged, n = match(points, begin, (mean, covariance), field, settings, noise)
    return out_of_frame(pose, frame), turned(covariance, frame[2]), rms, share, converged, n


@njit
def _slope(
    beams: tuple[NDArray[np.float64], int], pose: NDArray[np.float64], field: Field, kernel: tuple[float, float]
) -> NDArray[np.float64]:
    """How the gradient of every n-th point changes over `STEP` to both sides, (3, 3), with the surfaces found anew."""
    points, stride = beams
    far, flat = reach(points), flat_of(field)
    slope = np.zeros((3, 3))
    for j in range(3):
        step = STEP / far if j == 2 else STEP
        for side in (-step, step):
            moved = (pose[0] + (side if j == 0 else 0.0), pose[1] + (side if j == 1 else 0.0), pose[2] + (side if j == 2 else 0.0))
            placed, g = placed_at(moved, field, kernel), ZERO
            for i in range(0, len(points), stride):
                met = meeting(points[np.uint32(i), 0], points[np.uint32(i), 1], placed, flat)
                if met[0] > BEHIND:
                    g = added(g, met)
            for i in range(3):
                slope[j, i] += 0.5 * stride / side * g[S0 + i]
    return usable(slope, far)


@njit
def _blocks(
    points: NDArray[np.float64], pose: NDArray[np.float64], field: Field, kernel: tuple[float, float]
) -> tuple[NDArray[np.float64], float, float]:
    """Blocks (G, 12) of `sandwich`, RMS residual and share of points within the kernel; normals look away from the robot."""
    placed, last, k, sums, quality = placed_at((pose[0], pose[1], pose[2]), field, kernel), NOWHERE, 0, ZERO, (0.0, 0.0, 0)
    blocks, flat = np.empty((len(points) + 1, 12)), flat_of(field)
    for i in range(len(points)):
        met = meeting(points[np.uint32(i), 0], points[np.uint32(i), 1], placed, flat)
        if met[0] == NOTHING:
            continue
        quality = judged(quality, met, placed)
        new, last = opens_block(last, met[1] + pose[0], met[2] + pose[1])
        if new:
            close_block(blocks, k, sums)
            k, sums = k + 1, ZERO
        if met[0] > BEHIND:
            sums = added(sums, met)
    close_block(blocks, k, sums)
    total, squares, found = quality
    return blocks[:k], np.sqrt(squares / total) if total > 0.0 else 0.0, found / max(len(points), 1)


@njit
def normal_equations(
    beams: tuple[NDArray[np.float64], int],
    pose: NDArray[np.float64],
    field: Field,
    kernel: tuple[float, float],
    H: NDArray[np.float64],
    g: NDArray[np.float64],
) -> None:
    """Normal equations of every n-th point: writes H = n sum w J^T J, g = n sum w J^T d."""
    points, stride = beams
    placed, flat, sums = placed_at((pose[0], pose[1], pose[2]), field, kernel), flat_of(field), ZERO
    for i in range(0, len(points), stride):
        met = meeting(points[np.uint32(i), 0], points[np.uint32(i), 1], placed, flat)
        if met[0] > BEHIND:
            sums = added(sums, met)
    write_equations(sums[:9], stride, H, g)
