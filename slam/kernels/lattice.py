"""The lattice of poses that a branch-and-bound search looks through, and what its nodes are away from a pose of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Lattice = tuple[Floats, float, int, int, float, float]
"""Centre x, y [cells], yaw; heading step [rad]; cells and headings to each side; costs of a squared cell and of a squared heading."""
Node = tuple[int, int, int, int]
"""Level, group of headings, shift (row, col) of the lower left pose."""


@njit
def cost_at(pose: tuple[int, int, int], lattice: Lattice) -> float:
    """Cost of the distance of one pose, heading and shift (row, col), from the centre."""
    turn, row, col = pose
    return lattice[4] * (row * row + col * col) + lattice[5] * (turn - lattice[3]) ** 2


@njit
def least_cost(node: Node, groups: Integers, lattice: Lattice) -> float:
    """Least cost of the distance from the centre in a node: level, group of headings, shift (row, col)."""
    size, headings = 1 << node[0], groups[node[0]]
    row, col = _nearest(node[2], size), _nearest(node[3], size)
    turn = _nearest(node[1] * headings - lattice[3], headings)
    return lattice[4] * (row * row + col * col) + lattice[5] * turn * turn


@njit
def belongs(node: Node, groups: Integers, mode: tuple[int, int, int, int, int]) -> bool:
    """Whether all poses of a node belong to the mode."""
    size, headings = 1 << node[0], groups[node[0]]
    if _farthest(node[1] * headings - mode[0], headings) >= mode[3]:
        return False
    row, col = _farthest(node[2] - mode[1], size), _farthest(node[3] - mode[2], size)
    return row * row + col * col < mode[4] * mode[4]


@njit
def _nearest(first: int, size: int) -> int:
    """The smallest distance from 0 of `first`..`first + size - 1`."""
    return max(first, 0, 1 - first - size)


@njit
def _farthest(first: int, size: int) -> int:
    """The largest distance from 0 of `first`..`first + size - 1`."""
    return max(abs(first), abs(first + size - 1))
