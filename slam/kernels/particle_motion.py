"""Particles moved by a sampled motion: Thrun, Burgard, Fox, Probabilistic Robotics (2005), tables 5.3 and 5.6.

The noise comes as an array of standard normals, so that whoever calls decides about the random stream.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit
from slam.kernels.rays import direction

BLOCK = 256
"""Particles that are moved together: one short loop for each step, so that the compiler takes several at once."""


@njit
def move_by_odometry(
    poses: NDArray[np.float64],
    step: tuple[float, float, float],
    deviations: tuple[float, float, float],
    normals: NDArray[np.float32],
) -> NDArray[np.float64]:
    """Poses (N, 3) [m, rad] after a turn, a way and a turn, each with noise of its own for every particle.

    Args:
        poses: (N, 3) before.
        step: first turn [rad], way [m], second turn [rad].
        deviations: their standard deviations.
        normals: (3, N) standard normal.
    """
    moved = np.empty_like(poses)
    yaws, over = np.empty(BLOCK), np.empty((2, BLOCK))
    for start in range(0, len(poses), BLOCK):
        stop = min(start + BLOCK, len(poses))
        block, noise, result = poses[start:stop], normals[:, start:stop], moved[start:stop]
        for n in range(len(block)):
            yaws[n] = block[n, 2] + step[0] + deviations[0] * noise[0, n]
        for n in range(len(block)):
            c, s = direction(yaws[n])
            way = step[1] + deviations[1] * noise[1, n]
            over[0, n], over[1, n] = way * c, way * s
        for n in range(len(block)):
            result[n, 0], result[n, 1] = block[n, 0] + over[0, n], block[n, 1] + over[1, n]
            result[n, 2] = _wrapped(yaws[n] + step[2] + deviations[2] * noise[2, n])
    return moved


@njit
def move_by_velocity(
    poses: NDArray[np.float64],
    motion: tuple[float, float, float],
    deviations: tuple[float, float, float],
    normals: NDArray[np.float32],
) -> NDArray[np.float64]:
    """Poses (N, 3) [m, rad] after an arc at constant velocities, each with noise of its own for every particle.

    The chord of an arc is L = v dt sinc(w dt / 2) in the direction of its middle: no division by a small yaw rate.

    Args:
        poses: (N, 3) before.
        motion: speed v [m/s], yaw rate w [rad/s], time dt [s].
        deviations: standard deviations of speed, yaw rate and final turn rate.
        normals: (3, N) standard normal.
    """
    dt = motion[2]
    moved = np.empty_like(poses)
    for n in range(len(poses)):
        half = 0.5 * dt * (motion[1] + deviations[1] * normals[1, n])
        c, s = direction(poses[n, 2] + half)
        chord = dt * (motion[0] + deviations[0] * normals[0, n]) * _sinc(half)
        moved[n, 0], moved[n, 1] = poses[n, 0] + chord * c, poses[n, 1] + chord * s
        moved[n, 2] = _wrapped(poses[n, 2] + 2.0 * half + dt * deviations[2] * normals[2, n])
    return moved


@njit
def _sinc(x: float) -> float:
    """sin(x) / x."""
    return np.sin(x) / x if abs(x) > 1e-4 else 1.0 - x * x / 6.0


@njit
def _wrapped(angle: float) -> float:
    """In (-pi, pi] [rad]."""
    return angle - 2.0 * np.pi * np.ceil(angle * (0.5 / np.pi) - 0.5)


@njit
def in_frame(poses: NDArray[np.float64], frame: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses (N, 3) of the frame in which `frame` (3,) x, y, yaw is given, seen from `frame`."""
    c, s = np.cos(frame[2]), np.sin(frame[2])
    seen = np.empty_like(poses)
    for n in range(len(poses)):
        dx, dy = poses[n, 0] - frame[0], poses[n, 1] - frame[1]
        seen[n, 0], seen[n, 1], seen[n, 2] = c * dx + s * dy, c * dy - s * dx, poses[n, 2] - frame[2]
    return seen
