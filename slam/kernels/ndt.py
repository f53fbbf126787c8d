"""Normal distributions transform: Biber, Strasser, "The normal distributions transform: a new approach to laser scan matching" (2003)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.localizability import RANGE_NOISE, in_order
from slam.kernels.localizability import information as scan_information
from slam.kernels.normal_equations import descend, write_equations
from slam.kernels.sandwich import STEP, UNBOUNDED, Residuals, blocks_of, narrow, settle, usable
from slam.kernels.symmetric import inverse
from slam.kernels.uncertainty import turned

Floats = NDArray[np.float64]
Cells = tuple[Floats, float, float, float]
"""Normal distribution (4, H, W, 7) of each cell of four overlapping grids, x and y of the first one's corner [m], cell size [m]."""

MEAN_X, MEAN_Y, NORMAL_X, NORMAL_Y, ACROSS, ALONG, KNOWN = 0, 1, 2, 3, 4, 5, 6
"""Columns of a distribution: mean [m], direction across, inverse standard deviations across and along [1/m], 1 where there is one."""
FEWEST = 4
"""Points that make a distribution."""
COMMON = 0.1
"""What half a metre of wall has in common beyond what is seen of it, in deviations of the distributions."""


@njit
def prepare(points: Floats, size: float, thinnest: float) -> Cells:
    """The distributions of points (N, 2) [m] in cells of `size` [m], each `thinnest` [m] at least."""
    points = in_order(points)
    if len(points) == 0:
        return np.zeros((4, 1, 1, 7)), 0.0, 0.0, size
    x0, y0 = points[:, 0].min() - size, points[:, 1].min() - size
    height = int((points[:, 1].max() - y0) / size) + 2
    width = int((points[:, 0].max() - x0) / size) + 2
    sums = np.zeros((4, height, width, 6))
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        for grid in range(4):
            row, col = _cell(x, y, (x0, y0, size), grid)
            cell = sums[grid, row, col]
            # about the cell's corner: sums of squares far from the origin lose their digits
            u, v = x - x0 - col * size, y - y0 - row * size
            cell[0] += 1.0
            cell[1] += u
            cell[2] += v
            cell[3] += u * u
            cell[4] += u * v
            cell[5] += v * v
    cells = np.zeros((4, height, width, 7))
    for grid in range(4):
        for row in range(height):
            for col in range(width):
                if sums[grid, row, col, 0] >= FEWEST:
                    _fit(sums[grid, row, col], (x0 + col * size, y0 + row * size), thinnest, cells[grid, row, col])
    return cells, x0, y0, size


@njit
def _cell(x: float, y: float, frame: tuple[float, float, float], grid: int) -> tuple[int, int]:
    """Row and column in one of the grids, which lie half a cell apart."""
    x0, y0, size = frame
    return int(np.floor((y - y0) / size + 0.5 * (grid // 2))), int(np.floor((x - x0) / size + 0.5 * (grid % 2)))


@njit
def _fit(sums: Floats, corner: tuple[float, float], thinnest: float, cell: Floats) -> None:
    """Write the distribution of a cell's points."""
    n = sums[0]
    mx, my = sums[1] / n, sums[2] / n
    a, b, d = sums[3] / n - mx * mx, sums[4] / n - mx * my, sums[5] / n - my * my
    spread = np.sqrt(0.25 * (a - d) ** 2 + b * b)
    angle = 0.5 * np.arctan2(2.0 * b, a - d)
    cell[MEAN_X], cell[MEAN_Y] = corner[0] + mx, corner[1] + my
    cell[NORMAL_X], cell[NORMAL_Y] = -np.sin(angle), np.cos(angle)
    cell[ACROSS] = 1.0 / max(np.sqrt(max(0.5 * (a + d) - spread, 0.0)), thinnest)
    cell[ALONG] = 1.0 / max(np.sqrt(0.5 * (a + d) + spread), thinnest)
    cell[KNOWN] = 1.0


@njit
def match(
    source: Floats, cells: Cells, start: Floats, prior: tuple[Floats, Floats], settings: tuple[int, float, float]
) -> tuple[Floats, Floats, float, float, bool, int]:
    """Lay `source` (M, 2) [m], in any order, where the distributions make it likeliest.

    Args:
        source: in its own frame.
        cells: as prepared.
        start: (3,) x, y, yaw.
        prior: mean (3,) and covariance (3, 3).
        settings: most iterations, step below which it has converged [m or rad], points that count as one independent beside the prior.

    Returns:
        pose (3,), its covariance (3, 3), RMS distance across the distributions [m], share of the points near one, converged, iterations.
    """
    iterations, tolerance, correlated = settings
    source = in_order(source)
    information = inverse(prior[1]) * correlated
    mean, pose = prior[0], start.copy()
    H, g = np.zeros((3, 3)), np.zeros(3)
    # wide distributions first: the exponential lets far points go
    softness, rms, share, converged, n = 16.0, 0.0, 0.0, False, 0
    for _ in range(iterations):
        n += 1
        rms, share = _accumulate((source, 1), cells, pose, softness, H, g)
        largest = descend(H, g, pose, (mean, information))
        converged = largest < 4.0 * tolerance
        if softness == 1.0 and largest < tolerance:
            break
        softness = max(0.5 * softness, 1.0)
    blocks, slope, fisher = blocks_of(_residuals(source, cells, pose)), _slope(source, cells, pose), UNBOUNDED
    if narrow(blocks):
        fisher = turned(scan_information(source, RANGE_NOISE), pose[2])
    step, covariance = settle(blocks, slope, (pose - mean, prior[1]), fisher, COMMON)
    return pose + step, covariance, rms, share, converged, n


@njit
def _accumulate(beams: tuple[Floats, int], cells: Cells, pose: Floats, softness: float, H: Floats, g: Floats) -> tuple[float, float]:
    """Writes g = sum e J^T C q of every n-th point, C a quarter of the inverse covariance, e = exp(-q^T C q / 2), and H = sum e J^T C J.

    Returns the RMS distance across the distributions and the share of the points near one.
    """
    source, stride = beams
    distributions, x0, y0, size = cells
    height, width = distributions.shape[1:3]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    h00 = h01 = h02 = h11 = h12 = h22 = g0 = g1 = g2 = total = squares = 0.0
    found = 0
    for i in range(0, len(source), stride):
        rx, ry = c * source[i, 0] - s * source[i, 1], s * source[i, 0] + c * source[i, 1]
        x, y = rx + pose[0], ry + pose[1]
        near = False
        for grid in range(4):
            row, col = _cell(x, y, (x0, y0, size), grid)
            if not (0 <= row < height and 0 <= col < width) or distributions[grid, row, col, KNOWN] == 0.0:
                continue
            cell = distributions[grid, row, col]
            nx, ny = cell[NORMAL_X], cell[NORMAL_Y]
            dx, dy = x - cell[MEAN_X], y - cell[MEAN_Y]
            across, along = nx * dx + ny * dy, nx * dy - ny * dx
            p, q = cell[ACROSS] ** 2, cell[ALONG] ** 2
            e = 0.25 * np.exp(-0.5 * (p * across * across + q * along * along) / softness)
            near |= e > 0.01
            total, squares = total + e, squares + e * across * across
            p, q = e * p, e * q
            turn, slide = ny * rx - nx * ry, nx * rx + ny * ry
            h00, h01 = h00 + p * nx * nx + q * ny * ny, h01 + (p - q) * nx * ny
            h11 += p * ny * ny + q * nx * nx
            h02, h12 = h02 + p * nx * turn - q * ny * slide, h12 + p * ny * turn + q * nx * slide
            h22 += p * turn * turn + q * slide * slide
            g0 += p * nx * across - q * ny * along
            g1 += p * ny * across + q * nx * along
            g2 += p * turn * across + q * slide * along
        found += near
    write_equations((h00, h01, h02, h11, h12, h22, g0, g1, g2), stride, H, g)
    return np.sqrt(squares / total) if total > 0.0 else 0.0, min(stride * found / max(len(source), 1), 1.0)


@njit
def _slope(source: Floats, cells: Cells, pose: Floats) -> Floats:
    """How the gradient changes over `STEP` to both sides, (3, 3)."""
    reach = max(np.sqrt((source * source).sum() / max(len(source), 1)), STEP)
    steps = (STEP, STEP, STEP / reach)
    slope, H, g, moved = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), pose.copy()
    stride = 2 if len(source) >= 300 else 1
    for j in range(3):
        for side in (-1.0, 1.0):
            moved[j] = pose[j] + side * steps[j]
            _accumulate((source, stride), cells, moved, 1.0, H, g)
            slope[:, j] += 0.5 * side / steps[j] * g
        moved[j] = pose[j]
    return usable(slope, reach)


@njit
def _residuals(source: Floats, cells: Cells, pose: Floats) -> Residuals:
    """Two for each point and grid, across and along in standard deviations; normals look away from the robot."""
    distributions, x0, y0, size = cells
    height, width = distributions.shape[1:3]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    rows = 8 * len(source)
    J, r, w, places = np.empty((rows, 3)), np.empty(rows), np.empty(rows), np.empty((rows, 2))
    n = 0
    for i in range(len(source)):
        rx, ry = c * source[i, 0] - s * source[i, 1], s * source[i, 0] + c * source[i, 1]
        x, y = rx + pose[0], ry + pose[1]
        for grid in range(4):
            row, col = _cell(x, y, (x0, y0, size), grid)
            if not (0 <= row < height and 0 <= col < width) or distributions[grid, row, col, KNOWN] == 0.0:
                continue
            cell = distributions[grid, row, col]
            nx, ny = cell[NORMAL_X], cell[NORMAL_Y]
            if nx * rx + ny * ry < 0.0:
                nx, ny = -nx, -ny
            dx, dy = x - cell[MEAN_X], y - cell[MEAN_Y]
            across, along = cell[ACROSS] * (nx * dx + ny * dy), cell[ALONG] * (nx * dy - ny * dx)
            e = 0.25 * np.exp(-0.5 * (across * across + along * along))
            for part in range(2):
                scale = cell[ACROSS] if part == 0 else cell[ALONG]
                ux, uy = (nx, ny) if part == 0 else (-ny, nx)
                J[n, 0], J[n, 1], J[n, 2] = scale * ux, scale * uy, scale * (uy * rx - ux * ry)
                r[n], w[n] = (across if part == 0 else along), e
                places[n, 0], places[n, 1] = x, y
                n += 1
    return J, r, w, places, n
