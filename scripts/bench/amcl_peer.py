"""The PyPI package `amcl`, a port of nav2's particle filter: the beam model on the same map and the same scan."""

from __future__ import annotations

import math
from collections.abc import Callable

import amcl
import numpy as np

from slam.localization.known_map import KnownMap
from slam.messages import LaserScan
from slam.se2 import SE2

OCCUPIED, FREE = 1, -1
"""How its map says it: 0 is unknown."""


def updates(known_map: KnownMap, scan: LaserScan, T_map_base: SE2, particles: int, beams: int) -> Callable[[], object]:
    """The work of one update at a pose: every call moves the odometry on by 0.3 m, for it updates at no less."""
    shares = {"z_hit": 0.85, "z_short": 0.05, "z_max": 0.05, "z_rand": 0.05, "sigma_hit": 0.1, "lambda_short": 0.1, "chi_outlier": 0.0}
    laser = amcl.LaserParameters(max_beams=beams, **shares)
    motion = amcl.MotionParameters(alpha1=0.2, alpha2=0.2, alpha3=0.2, alpha4=0.2, alpha5=0.2)
    filter_ = amcl.AMCL(
        min_particles=particles,
        max_particles=particles,
        alpha_slow=0.0,
        alpha_fast=0.0,
        motion_params=motion,
        laser_params=laser,
        robot_model_type="differential",
    )
    geometry = known_map.grid.geometry
    corner = geometry.T_map_grid
    grid = amcl.create_occupancy_grid_from_list(known_map.grid.states().tolist(), geometry.resolution, corner.x, corner.y)
    filter_.set_map(grid)
    spread = amcl.Matrix3D()
    filter_.set_initial_pose(amcl.Vector3D(T_map_base.x, T_map_base.y, T_map_base.yaw), spread)
    mount = scan.T_base_laser.to_se2()
    filter_.set_laser_pose(amcl.Vector3D(mount.x, mount.y, mount.yaw))
    ranges = np.where(np.isfinite(scan.ranges), scan.ranges, scan.range_max)
    sweep = amcl.create_laser_scan_from_list(np.column_stack([ranges, scan.angles]).tolist(), scan.range_max)
    way = 0.0

    def work() -> object:
        nonlocal way
        way += 0.3
        return filter_.update(sweep, amcl.Vector3D(0.3 * math.floor(way / 0.3 + 0.5), 0.0, 0.0))

    return work
