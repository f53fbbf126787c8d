from __future__ import annotations

import numpy as np
import pytest

from slam.mapping.grid_mapper import MapSettings
from slam.mapping.loop_closing import Here, LoopCloser
from slam.mapping.recognition import LoopClosing, Recognition
from slam.mapping.submap import Submap
from slam.mapping.submaps import Link, Submaps
from slam.scans import PointScan
from slam.se2 import SE2

STEP = np.diag([0.1**2, 0.1**2, 0.04**2])
CLEAR = np.diag([0.01**2, 0.01**2, 0.004**2])
TURN = SE2(2.0, 0.0, np.pi / 2)
"""From each corner of a square to the next."""


@pytest.fixture
def square() -> Submaps:
    """A submap in each corner of a square, and one more where the robot is back at the first."""
    submaps, T_map_submap = Submaps(), SE2()
    for number in range(5):
        submaps.add(Submap(number, 0.0, T_map_submap, MapSettings()))
        if number:
            submaps.tie(Link(number - 1, number, TURN, STEP, closure=False))
        T_map_submap = T_map_submap @ TURN
    return submaps


@pytest.mark.parametrize(("off", "believed"), [(0.0, True), (0.05, True), (0.9, False)])
def test_what_the_graph_leaves_out_is_not_believed(square: Submaps, off: float, believed: bool) -> None:
    here = Here(4, SE2(0.3, 0.1, 0.2), CLEAR, PointScan(1.0, np.zeros((0, 2)), np.zeros((0, 2))))
    found = Recognition(0, SE2(off, 0.0) @ here.T_current_base, CLEAR, known=1.0, inliers=1.0, searched=True)
    closer = LoopCloser(LoopClosing(), square)
    closer.close(found, here)
    assert closer.believes(found, here) == believed
