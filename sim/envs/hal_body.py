"""Any robot of the HAL behind an environment: a twin in all its imperfection, or the real one."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.hal import Robot
from hardware.registry import backend_class
from hardware.spec import LidarSpec
from sim import rolling_kernel
from sim.envs import map_kernel, native_kernel
from sim.envs.locating import ByOdometry, BySlam, ByTruth, Locating
from sim.envs.map_kernel import BLOCK, CELL, CERTAIN, FREE_GREY, HALF, SIDE, UNKNOWN_GREY, WALLS_IN_BLOCK
from sim.envs.native import LEAD, PERIOD, Sight, acting_time, clear, empty_charts, quick_spec
from sim.envs.site import Site
from sim.envs.task import Task
from sim.ground_truth import GroundTruth, ground_truth
from slam.grid import OccupancyGrid
from slam.messages import LaserScan, Twist

FIRST_MAP = 20
"""Steps for which the robot stands until it has a map: SLAM has none before its odometry covers the first scan."""
PROMPT = "Put the robot where it shall start, and press Enter. "


class HalBody:
    """Implements `sim.envs.body.Body` over `hardware.hal.Robot`. `robot` stays open from episode to episode where it is a real one."""

    def __init__(self, task: Task, operator: Callable[[str], object] = input, camera: bool = False) -> None:
        self._task, self._operator, self._camera = task, operator, camera
        self._robot: Robot | None = None
        self._truth: GroundTruth | None = None
        self._charts = empty_charts(2)  # the robot's own, and what it has truly seen
        self._steps, self._began = 0, 0.0
        self._episodes = 0
        self.sight = Sight.empty(1)
        self.is_home = False
        """A real robot is where its next episode begins: nobody needs to put it there."""
        self.image: NDArray[np.uint8] | None = None
        """The newest colour image (H, W, 3)."""

    @property
    def cells(self) -> NDArray[np.uint8]:
        """See `Body`."""
        return self._charts[0][0]

    @property
    def true_way(self) -> NDArray[np.float64] | None:
        """See `Body`."""
        return None if self._truth is None else self._truth.pose(self.robot.clock.now()).as_array()

    @property
    def is_running(self) -> bool:
        """Whether a robot is open."""
        return self._robot is not None

    @property
    def robot(self) -> Robot:
        """The robot of this episode."""
        assert self._robot is not None, "reset() comes first"
        return self._robot

    def start(self, site: Site | None, seed: int) -> None:
        """See `Body`.

        Raises:
            HardwareError, SimError, WorldError: the robot cannot be opened.
        """
        self._open(site, seed)
        self._site = site
        self._locating = self._locator(site)
        for i in (0, 1):
            clear(self._charts, i)
            self._charts[3][i] = 1
            if site is not None:
                site.mark(self._charts[3][i])
        self._steps, self._began = -1, self.robot.clock.now() + (0.0 if site is not None else PERIOD - LEAD)
        self.sight.scan[0], self.image = 0.0, None
        self._advance()
        gained = int(self.sight.gained[0])
        while not self.cells.any() and self._steps < FIRST_MAP:
            self._advance()
            gained += int(self.sight.gained[0])
        self.sight.gained[0] = gained

    def step(self, twist: Twist) -> None:
        """See `Body`."""
        self.robot.drive(twist)
        self._advance()

    def close(self) -> None:
        """See `Body`."""
        if self._robot is not None:
            self._robot.close()
            self._robot = None

    def _open(self, site: Site | None, seed: int) -> None:
        """A fresh twin, or the real robot at its start."""
        options: dict[str, Any]
        if site is not None:
            self.close()
            options = {"world": site.text, "seed": seed, "realism": self._task.realism}
            if self._task.robot == "kinematic":
                options["spec"] = quick_spec()
            if self._camera:
                options["camera"] = "raster"
            elif self._task.robot == "sim":
                options["camera"] = "none"
            self._robot = backend_class(self._task.robot)(**options).build()
            self._robot.open()
            self._truth = ground_truth(self._robot)
            return
        if self._robot is None:
            options = {"ev3": self._task.ev3, "lidar": self._task.lidar}
            self._robot = backend_class("ev3")(**options).build()
            self._robot.open()
        self._robot.drive(Twist())
        if self._episodes and not self.is_home:
            self._operator(PROMPT)
        self._robot.read()
        self._episodes, self.is_home = self._episodes + 1, False

    def _locator(self, site: Site | None) -> Locating:
        if self._task.pose == "truth":
            assert site is not None
            assert self._truth is not None
            return ByTruth(self._truth.pose, site.T_world_map)
        return BySlam() if self._task.pose == "slam" else ByOdometry()

    def _advance(self) -> None:
        """Let a step pass, and see."""
        robot, clock = self.robot, self.robot.clock
        self._steps += 1
        until = self._began + acting_time(self._steps)
        if until < clock.now():  # a real robot waits for nobody: after a late step the next one is a whole one
            self._began += clock.now() - until
            until = clock.now()
        clock.sleep_until(until)
        frame = robot.read()
        self._locating.update(frame)
        if frame.images:
            self.image = frame.images[-1].colour
        gained, chart = 0, self._chart(0)
        scan: LaserScan | None = frame.scans[-1] if frame.scans else None
        for each in frame.scans:
            gained += self._enter(each)
        if isinstance(self._locating, BySlam) and frame.scans:
            _copy(self._locating.pipeline.snapshot().map, chart)
        self._show(scan, gained)

    def _show(self, scan: LaserScan | None, gained: int) -> None:
        sight, chart, pose = self.sight, self._chart(0), self._locating.at(self.robot.clock.now())
        views = sight.view[0], sight.overview[0], sight.scan[0], sight.pose[0]
        lidar = self.robot.spec.lidar or LidarSpec()
        if scan is not None:
            native_kernel.look(chart, (scan.ranges, (lidar.range_min, lidar.range_max)), pose, views)
        else:  # the ranges of the last scan stay
            map_kernel.close_up(chart[0], pose, views[0])
            map_kernel.overview(chart[2], pose, views[1])
            views[3][:] = pose
        sight.gained[0], sight.contact[0] = gained, self._touches()

    def _enter(self, scan: LaserScan) -> int:
        """Enter a scan in the map and, where the truth is known, in what was truly seen; how many cells that count are new."""
        gained = 0 if isinstance(self._locating, BySlam) else self._insert(scan, self._chart(0), self._locating)
        if self._truth is None or self._site is None or self._task.pose == "truth":
            return gained
        return self._insert(scan, self._chart(1), ByTruth(self._truth.pose, self._site.T_world_map))

    @staticmethod
    def _insert(scan: LaserScan, chart: map_kernel.Chart, locating: Locating) -> int:
        mount = scan.T_base_laser
        T_base_laser = float(mount.t[0]), float(mount.t[1]), math.atan2(float(mount.R[1, 0]), float(mount.R[0, 0]))
        poses = tuple(rolling_kernel.compose(locating.at(t), T_base_laser) for t in (scan.stamp, scan.end))
        limits = scan.range_min, scan.range_max
        return map_kernel.insert(chart, (scan.ranges, scan.angles), (poses[0], poses[1]), limits)

    def _touches(self) -> bool:
        way = self.true_way
        if way is None or self._site is None:
            return self.robot.health().stalled
        walls = *self._site.walls, self.robot.spec.radius
        return native_kernel.touches(walls, float(way[0]), float(way[1]), 0.0)

    def _chart(self, i: int) -> map_kernel.Chart:
        return self._charts[0][i], self._charts[1][i], self._charts[2][i], self._charts[3][i]


def _copy(grid: OccupancyGrid, chart: map_kernel.Chart) -> None:
    """Write a map of SLAM, whose axes are the map's, over an explorer's map."""
    cells, _, blocks, _ = chart
    geometry, known = grid.geometry, np.where(grid.log_odds < 0.0, 1, 0).astype(np.uint8)  # at the first beam, as in `map_kernel`
    known[grid.likely()] = CERTAIN
    corner = np.rint((np.array([geometry.T_map_grid.y, geometry.T_map_grid.x])) / CELL).astype(np.int64) + HALF
    low, high = np.maximum(corner, 0), np.minimum(corner + known.shape, SIDE)
    cells[:], blocks[:] = 0, UNKNOWN_GREY
    cells[low[0] : high[0], low[1] : high[1]] = known[low[0] - corner[0] : high[0] - corner[0], low[1] - corner[1] : high[1] - corner[1]]
    first, last = low // BLOCK, -(-high // BLOCK)
    height, width = (last - first).tolist()
    part = cells[first[0] * BLOCK : last[0] * BLOCK, first[1] * BLOCK : last[1] * BLOCK].reshape(height, BLOCK, width, BLOCK)
    free, walls = (part == 1).sum(axis=(1, 3)), (part == CERTAIN).sum(axis=(1, 3))
    light = np.minimum(UNKNOWN_GREY + 2 * free, FREE_GREY) * (WALLS_IN_BLOCK - np.minimum(walls, WALLS_IN_BLOCK)) // WALLS_IN_BLOCK
    blocks[first[0] : last[0], first[1] : last[1]] = light
