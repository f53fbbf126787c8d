"""How well poses explain a scan, beam by beam: where it ends and what it passes through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.gauss_newton import match_in_map
from slam.kernels.jit import njit
from slam.kernels.rays import cast_along
from slam.kernels.surfaces import FLATNESS, NORMAL_X, NORMAL_Y, ONE_SIDED, Field, X, Y

Floats = NDArray[np.float64]
Squares = tuple[NDArray[np.uint8], NDArray[np.uint8], float]
"""Of `rays.empty_squares`, with all closed that is not known to be free, and of the walls alone; cell size [m]."""
Beams = tuple[Floats, Floats, NDArray[np.bool_], float]
"""Where the laser was and where each beam ended (N, 2) in base [m], in the order of their bearings; whether it hit something; the sensor's
range [m]."""
Noise = tuple[float, float, float, float, float]
"""Standard deviation of a range: least [m] and as a share of it; of the map's walls [m]; shares of the beams that end before a wall, and
beyond one, or at none though there is one."""
Ray = tuple[float, float, float, float, float]
"""A point of a beam x, y [m], its direction u, v, and how much farther it ends [m], in the grid's frame."""
UNSEEN = 0.3
"""Share of the beams into the unknown that end in any metre of it, times the sensor's range."""
SLACK = 0.07
"""How far within a wall's cells its surface may lie [m]."""
BODY = 0.12
"""What stands about the laser in the map is not there, for the robot is [m]."""
NO_SURFACE = 1e3
SHORTEST = 1e-9
"""A beam has a direction [m]."""


@njit
def refine(
    points: Floats,
    starts: Floats,
    prior: Floats,
    frame: Floats,
    field: Field,
    settings: tuple[int, float, float, float, float, float],
    noise: tuple[float, float, float],
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """`gauss_newton.match_in_map` from every start (M, 3): poses (M, 3), covariances (M, 3, 3), and which converged (M,)."""
    poses, covariances, converged = np.empty((len(starts), 3)), np.empty((len(starts), 3, 3)), np.zeros(len(starts), np.bool_)
    for i in range(len(starts)):
        pose, covariance, _, _, good, _ = match_in_map(points, starts[i], (starts[i], prior), frame, field, settings, noise)
        poses[i], covariances[i], converged[i] = pose, covariance, good and np.isfinite(pose).all()
    return poses, covariances, converged


@njit
def explain(poses: Floats, beams: Beams, field: Field, squares: Squares, noise: Noise) -> tuple[Floats, NDArray[np.bool_]]:
    """Log-likelihood (M, N) of every beam at every pose (M, 3) in the grid's frame, and whether it is as it should be (M, N).

    Thrun, Burgard, Fox, "Probabilistic Robotics" (2005), 6.3, with the distance to the surface that the beam ends at instead of that
    along the beam, which at an edge is anything. A beam beyond a wall is one whose neighbours would be, too.
    """
    origins, ends, hits, reach = beams
    n = len(ends)
    logs, fits = np.empty((len(poses), n)), np.zeros((len(poses), n), np.bool_)
    rays, headings, lengths, skipped = np.empty((n, 2)), np.empty((2, n)), np.empty(n), np.empty(n)
    for k in range(len(poses)):
        c, s = np.cos(poses[k, 2]), np.sin(poses[k, 2])
        for i in range(n):
            dx, dy = ends[i, 0] - origins[i, 0], ends[i, 1] - origins[i, 1]
            lengths[i] = np.hypot(dx, dy)
            rays[i, 0] = poses[k, 0] + c * origins[i, 0] - s * origins[i, 1]
            rays[i, 1] = poses[k, 1] + s * origins[i, 0] + c * origins[i, 1]
            length = max(lengths[i], SHORTEST)
            headings[0, i], headings[1, i] = (c * dx - s * dy) / length, (s * dx + c * dy) / length
            skipped[i] = min(BODY, 0.5 * lengths[i])
            rays[i] += skipped[i] * headings[:, i]
        open_to = cast_along(squares[0], rays, headings, squares[2], reach)
        wall_at = cast_along(squares[1], rays, headings, squares[2], reach)
        for i in range(n):
            open_to[i], wall_at[i] = open_to[i] + skipped[i], wall_at[i] + skipped[i]
        for i in range(n):
            wall = max(wall_at[i], wall_at[max(i - 1, 0)], wall_at[min(i + 1, n - 1)])
            opening = max(open_to[i], open_to[max(i - 1, 0)], open_to[min(i + 1, n - 1)])
            if hits[i]:
                off = min(abs(wall_at[i] - lengths[i]), abs(open_to[i] - lengths[i]))
                beam = rays[i, 0], rays[i, 1], headings[0, i], headings[1, i], lengths[i] - skipped[i]
                logs[k, i], fits[k, i] = _returned(beam, lengths[i], (opening, wall, reach, off), field, noise)
            else:
                logs[k, i], fits[k, i] = _missed(lengths[i], (opening, wall), noise)
    return logs, fits


@njit
def _returned(beam: Ray, length: float, seen: tuple[float, float, float, float], field: Field, noise: Noise) -> tuple[float, bool]:
    """Logarithm of the density [1/m] of a beam's end, and whether it ends where it should."""
    opening, wall, reach, off = seen
    distance, slant = _surface_at(beam, field)
    distance = min(distance, off)
    sigma = np.sqrt(max(noise[0], noise[1] * length) ** 2 + noise[2] * noise[2])
    margin = SLACK + 3.0 * sigma + SLACK / slant
    beyond = wall < length - margin
    density = (noise[4] if beyond else noise[3]) / reach
    if not beyond:
        density += np.exp(-0.5 * (distance / sigma) ** 2) / (np.sqrt(2.0 * np.pi) * sigma)
        if opening < length:
            density += UNSEEN / reach
    return np.log(density), not beyond and distance < 3.0 * sigma


@njit
def _missed(length: float, seen: tuple[float, float], noise: Noise) -> tuple[float, bool]:
    """Logarithm of the probability that a beam meets nothing up to a length [m], and whether nothing is there."""
    opening, wall = seen
    if wall < length - SLACK:
        return np.log(noise[4]), False
    if opening < length - SLACK:
        return np.log(UNSEEN), False
    return np.log(1.0 - noise[3]), True


@njit
def _surface_at(beam: Ray, field: Field) -> tuple[float, float]:
    """Distance [m] from a beam's end to the surface that faces it, `NO_SURFACE` for none, and the cosine of the incidence."""
    nearest, surfaces, resolution = field
    x, y, u, v, rest = beam
    x, y = x + rest * u, y + rest * v
    col, row = int(np.floor(x / resolution)), int(np.floor(y / resolution))
    if not (0 <= row < nearest.shape[0] and 0 <= col < nearest.shape[1]) or nearest[row, col] < 0:
        return NO_SURFACE, 1.0
    surface = surfaces.reshape(-1, 5)[nearest[row, col]]
    dx, dy = x - surface[X], y - surface[Y]
    if surface[FLATNESS] <= 0.0:
        return np.hypot(dx, dy), 1.0
    across = surface[NORMAL_X] * u + surface[NORMAL_Y] * v
    if surface[FLATNESS] == ONE_SIDED and across > 0.0:
        return NO_SURFACE, 1.0
    along = abs(surface[NORMAL_X] * dy - surface[NORMAL_Y] * dx)
    beside = max(along - 2.0 * resolution, 0.0)
    return np.hypot(surface[NORMAL_X] * dx + surface[NORMAL_Y] * dy, beside), max(abs(across), 0.05)
