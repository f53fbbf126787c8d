"""How wrong an explorer's poses and its map were."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hardware.spec import LidarSpec
from sim.envs.driving import LASER_X, known_grid
from sim.envs.native import PERIOD
from sim.envs.site import Site
from slam.evaluation.maps import iou
from slam.evaluation.poses import compose
from slam.evaluation.trajectory import absolute_errors, align
from slam.evaluation.visibility import View, visible_walls
from slam.messages import Trajectory
from slam.se2 import FloatArray


def accuracy(believed: FloatArray, true: FloatArray, cells: NDArray[np.uint8], site: Site) -> tuple[float, float]:
    """Root mean square position error after alignment [m], and intersection over union of the map with the walls that were in view.

    Args:
        believed: poses (N, 3) in the map, one a step.
        true: poses (N, 3) in the world at the same times.
        cells: the map (SIDE, SIDE), see `map_kernel`.
        site: where it was.
    """
    stamps = PERIOD * np.arange(len(true))
    truth, estimate = Trajectory(stamps, true), Trajectory(stamps, believed)
    T_world_map = align(truth, estimate)
    errors = absolute_errors(truth, estimate, T_world_map).translation
    walls = site.world.outlines(float(LidarSpec().T_base_laser.t[2]))
    visible = visible_walls(walls, compose(true, np.tile((LASER_X, 0.0, 0.0), (len(true), 1))), View())
    return float(np.sqrt(np.mean(errors**2))), iou(known_grid(cells), walls, visible, T_world_map)
