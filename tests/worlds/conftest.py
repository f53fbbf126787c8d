import math

import numpy as np
import pytest

CELL = 0.02


def solid_cells(world, height):
    """Cells of 2 cm, one ring wider than the world, whose middle is in something that begins below a height; and a point's cell."""
    x0, y0, x1, y1 = world.bounds
    xs, ys = np.arange(x0 - CELL, x1 + 2 * CELL, CELL), np.arange(y0 - CELL, y1 + 2 * CELL, CELL)
    solid = np.zeros((len(ys), len(xs)), bool)
    for footprint in (part.footprint() for part in (*world.solids, *world.doors) if part.z_span[0] < height):
        low, high = footprint.min(axis=0), footprint.max(axis=0)
        cols, rows = slice(*np.searchsorted(xs, [low[0], high[0]])), slice(*np.searchsorted(ys, [low[1], high[1]]))
        sides = zip(footprint, np.roll(footprint, -1, axis=0) - footprint, strict=True)
        inside = [d[0] * (ys[rows] - p[1])[:, None] - d[1] * (xs[cols] - p[0]) >= 0.0 for p, d in sides]
        solid[rows, cols] |= np.all(inside, axis=0)
    return solid, lambda point: (math.floor((point[1] - ys[0]) / CELL + 0.5), math.floor((point[0] - xs[0]) / CELL + 0.5))


@pytest.fixture(scope="session")
def cells():
    return solid_cells
