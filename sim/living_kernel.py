"""All people of a world at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim import gait
from sim.figure import PARTS
from slam.kernels.jit import njit
from slam.se2 import FloatArray

Walks = tuple[FloatArray, NDArray[np.int64], FloatArray]
"""Tables of `gait.states`, one after the other (R, 5), the first row of each (W + 1,), and of each person height and step [m] (W, 2)."""
ARMS_LENGTH = 1.5
"""How far from the middle of a person its parts are at most, and what it walks in a tenth of a second [m]."""


@njit
def frames(walks: Walks, tick: float, clocks: FloatArray, near: tuple[float, float, float]) -> FloatArray:
    """T_world_part as rotation row by row and position, (W * PARTS, K, 12), of the parts of all people.

    Args:
        walks: see `Walks`.
        tick: time between two rows [s].
        clocks: (>= W, K, 2) time on each clock and its rate.
        near: x, y, distance [m]: who is farther from there is left infinitely far away.
    """
    tables, firsts, bodies = walks
    found = np.full((len(bodies) * PARTS, clocks.shape[1], 12), np.inf)
    for w in range(len(bodies)):
        rows = gait.states(tables[firsts[w] : firsts[w + 1]], tick, clocks[w])
        x, y = rows[0, 0] - near[0], rows[0, 1] - near[1]
        if np.sqrt(x * x + y * y) <= near[2] + ARMS_LENGTH:
            found[w * PARTS : (w + 1) * PARTS] = gait.poses(rows, bodies[w, 0], bodies[w, 1])
    return found
