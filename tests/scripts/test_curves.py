"""What the report's curves are labelled with."""

import math

import numpy as np
import pytest

from scripts.runs.curves import curves
from scripts.runs.record import RunRecord
from slam.grid import GridGeometry, OccupancyGrid
from slam.messages import Trajectory

STAMPS = np.arange(5.0)


def straight(offset: float, turn: float) -> Trajectory:
    """Along x, with an error to the side that grows to `offset` [m] and a heading that is off by up to `turn` [rad]."""
    share = STAMPS / STAMPS[-1]
    return Trajectory(STAMPS, np.column_stack([STAMPS, offset * share, turn * share]))


@pytest.mark.parametrize(
    ("offset", "unit", "label"), [(0.005, "mm", "RMS 3.06 mm"), (0.5, "mm", "RMS 306 mm"), (2500.0, "m", "RMS 1531 m")]
)
def test_lengths_are_labelled_in_the_unit_that_fits(offset: float, unit: str, label: str) -> None:
    grid = OccupancyGrid.empty(GridGeometry(0.05, 4, 4))
    record = RunRecord("run", straight(offset, math.pi / 2), straight(offset, 0.0), straight(0.0, 0.0), grid)
    position, heading = curves(record)
    assert position.unit == unit
    assert label in position.lines[0].label
    assert heading.lines[0].label.endswith("RMS 55.1°")
