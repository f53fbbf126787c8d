"""The room, as a map."""

import numpy as np
import pytest

from slam.grid import LOG_ODDS_LIMIT, GridGeometry
from slam.localization.known_map import KnownMap
from slam.se2 import SE2


@pytest.fixture(scope="session")
def room_map(room, make_grid):
    """The room of 4 x 3 metres with its cupboard, in a grid that lies shifted and turned."""
    geometry = GridGeometry(0.05, 120, 110, SE2(-2.2, -2.9, 0.3))
    grid = make_grid(room.samples(), geometry)
    rows, cols = np.mgrid[0:110, 0:120]
    x, y = geometry.to_points(np.column_stack([rows.ravel(), cols.ravel()])).T.reshape(2, 110, 120)
    inside = (x > -1.97) & (x < 2.03) & (y > -1.46) & (y < 1.54) & ~((x > 0.81) & (x < 1.37) & (y > 0.62) & (y < 1.12))
    grid.log_odds[inside & (grid.log_odds == 0.0)] = -LOG_ODDS_LIMIT
    return KnownMap(grid.frozen_copy())
