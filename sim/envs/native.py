"""Ideal kinematic twins, many at a time, stepped by one kernel; what they sense, and no more, is given out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hardware.spec import DriveSpec, LidarSpec, RobotSpec
from sim.drive import LAG, MAX_ACCELERATION, TORQUE
from sim.envs import native_kernel
from sim.envs.map_kernel import BLOCK, SIDE, UNKNOWN_GREY, VIEW
from sim.envs.native_kernel import BODY, KEPT
from sim.envs.site import Site
from sim.grid_rays import GridRays
from sim.lidar import FIRST_STEP, REACH, Lidar, grid_rays
from sim.motion import NANOSECONDS, STEP
from sim.realism import Realism
from sim.unicycle import CARRIED
from slam.se2 import FloatArray

PERIOD = 0.1
"""Time of a step [s]: one sweep of the lidar."""
LEAD = 0.11
"""Time of the first observation [s]: just after the first scan has come."""
BEAMS = 181
"""Ranges in an observation."""
FIELD = math.radians(240.0)
"""From the first beam to the last [rad]."""


def quick_spec() -> RobotSpec:
    """The robot with 181 beams over the lidar's whole field, in the same time."""
    lidar = LidarSpec()
    sweep = (lidar.beams - 1) * lidar.time_increment / (BEAMS - 1)
    beams = replace(lidar, beams=BEAMS, angle_min=-0.5 * FIELD, angle_increment=FIELD / (BEAMS - 1), time_increment=sweep)
    return replace(RobotSpec(), lidar=beams)


def acting_time(steps: int) -> float:
    """When the observation after so many steps is made [s]."""
    return round(LEAD + steps * PERIOD, NANOSECONDS)


@dataclass(frozen=True, slots=True)
class Sight:
    """What is written at each step, robots in front."""

    view: NDArray[np.uint8]
    overview: NDArray[np.uint8]
    scan: NDArray[np.float32]
    pose: NDArray[np.float64]
    gained: NDArray[np.int64]
    contact: NDArray[np.bool_]

    @classmethod
    def empty(cls, count: int) -> Sight:
        """Of so many robots that have seen nothing yet."""
        views = np.zeros((count, VIEW, VIEW), np.uint8), np.zeros((count, VIEW, VIEW), np.uint8)
        return cls(*views, np.zeros((count, BEAMS), np.float32), np.zeros((count, 3)), np.zeros(count, np.int64), np.zeros(count, np.bool_))

    @property
    def arrays(self) -> native_kernel.Sights:
        """As the kernel takes them."""
        return self.view, self.overview, self.scan, self.pose, self.gained, self.contact


def empty_charts(count: int) -> native_kernel.Charts:
    """Maps of so many robots that know nothing, in which no cell counts."""
    blocks = SIDE // BLOCK
    cells, counting = np.zeros((count, SIDE, SIDE), np.uint8), np.zeros((count, SIDE, SIDE), np.uint8)
    return cells, np.zeros((count, blocks, blocks, 2), np.int16), np.full((count, blocks, blocks), UNKNOWN_GREY, np.uint8), counting


def clear(charts: native_kernel.Charts, i: int) -> None:
    """Make a robot's map know nothing."""
    charts[0][i], charts[1][i], charts[2][i] = 0, 0, UNKNOWN_GREY


class Fleet:
    """So many robots, each in a site of its own."""

    def __init__(self, count: int, spec: RobotSpec) -> None:
        self._spec, self._drive, lidar = spec, spec.drive or DriveSpec(), spec.lidar or LidarSpec()
        self._lidar = lidar
        self._robots = np.zeros((count, BODY)), np.zeros((count, KEPT, 4)), np.zeros(count, np.int64)
        self._charts = empty_charts(count)
        self._times = self._timetable(4096)
        self._worlds = _Worlds(count)
        self._device = _device(spec, lidar, self._drive)
        self._limits = _limits(self._drive)
        self._spare = 0
        """Steps for which the timetable lasts, at least."""
        self.done = np.zeros(count, np.int64)
        """Steps that each robot has made since it was placed."""

    @property
    def cells(self) -> NDArray[np.uint8]:
        """The maps (N, SIDE, SIDE), see `map_kernel`."""
        return self._charts[0]

    @property
    def way(self) -> NDArray[np.float64]:
        """T_world_base (N, 3) now."""
        return self._robots[0][:, :3]

    def place(self, i: int, site: Site) -> None:
        """Put a robot at the start of a site, with a map that knows nothing."""
        self._worlds.put(i, site)
        pose, (bodies, rows, steps) = site.T_world_map, self._robots
        bodies[i] = 0.0
        bodies[i, :3] = pose.as_array()
        rows[i] = pose.x, pose.y, math.sin(0.5 * pose.yaw), math.cos(0.5 * pose.yaw)
        steps[i] = 1
        clear(self._charts, i)
        site.mark(self._charts[3][i])
        self.done[i] = -1

    def command(self, twists: FloatArray) -> None:
        """Let all robots drive on with twists (N, 2) of forward speed [m/s] and yaw rate [rad/s], as far as their limits let them."""
        native_kernel.command(self._robots[0], twists, self._limits)

    def step(self, sight: Sight, first: int = 0, last: int | None = None) -> None:
        """Let robots `first` to before `last` drive for a step, or wait for the first scan after they were placed, and see."""
        last = len(self.done) if last is None else last
        self._spare -= 1  # too few rather than too many: other threads step other robots
        if self._spare < 0:
            self._lengthen()
        times = self.done, *self._times
        native_kernel.step(self._worlds.arrays, self._robots, self._charts, self._device, times, (sight.arrays, first, last))

    def _lengthen(self) -> None:
        """Have a timetable for the steps to come."""
        most = int(self.done.max()) + 2
        if most >= len(self._times[0]):
            self._times = self._timetable(2 * len(self._times[0]))
        self._spare = len(self._times[0]) - most

    def _timetable(self, count: int) -> tuple[FloatArray, FloatArray]:
        """By number of a step when the first beam of its scan leaves, and when it ends [s]."""
        start = FIRST_STEP * self._lidar.time_increment
        stamps = [round(k * self._lidar.period + start, NANOSECONDS) for k in range(count)]
        return np.array(stamps), np.array([acting_time(k) for k in range(count)])


class _Worlds:
    """Worlds in arrays with rows to spare; they grow when a larger one comes."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._shapes = [1, 1, 1, 1]
        self._make(None)

    @property
    def arrays(self) -> native_kernel.Worlds:
        """As the kernel takes them."""
        return self._arrays

    def put(self, i: int, site: Site) -> None:
        outlines = grid_rays(site.world).outlines
        sizes = [len(outlines[0]), len(outlines[3]), len(site.walls[0]), len(site.walls[1])]
        if any(size > room for size, room in zip(sizes, self._shapes, strict=True)):
            self._shapes = [max(room, 3 * size // 2) for size, room in zip(sizes, self._shapes, strict=True)]
            self._make(self._arrays)
        for array, values in zip(self._arrays[:8], (*outlines, *site.walls), strict=True):
            array[i, : len(values)] = values
        self._arrays[8][i] = sizes
        self._arrays[9][i] = site.T_world_map.as_array()

    def _make(self, old: native_kernel.Worlds | None) -> None:
        n, (sides, solids, walls, hulls) = self._count, self._shapes
        made: native_kernel.Worlds = (
            np.zeros((n, sides, 4)),
            np.zeros((n, sides, 2)),
            np.zeros((n, sides), np.int64),
            np.zeros((n, solids, 3), np.int64),
            np.zeros((n, solids, 5)),
            np.zeros((n, solids), np.int8),
            np.zeros((n, walls, 4)),
            np.zeros((n, hulls, 5)),
            np.zeros((n, 4), np.int64),
            np.zeros((n, 3)),
        )
        if old is not None:
            for array, before in zip(made, old, strict=True):
                array[:, : before.shape[1]] = before
        self._arrays = made


def _limits(drive: DriveSpec) -> native_kernel.Limits:
    left, right = drive.wheel_radii
    return drive.max_speed, drive.max_yaw_rate, drive.max_wheel_rate, drive.track, left, right


def _device(spec: RobotSpec, lidar: LidarSpec, drive: DriveSpec) -> native_kernel.Device:
    """Constants of an ideal robot; a device without noise draws, but nothing comes of it."""
    constants = Lidar(lidar, Realism(), GridRays(()), (), np.random.default_rng(0)).constants
    mount = lidar.T_base_laser
    pose = float(mount.t[0]), float(mount.t[1]), math.atan2(float(mount.R[1, 0]), float(mount.R[0, 0]))
    scan = lidar.angles, pose, lidar.time_increment, REACH * lidar.range_max
    motors = LAG, MAX_ACCELERATION * STEP, TORQUE * STEP / CARRIED, drive.max_wheel_rate, spec.radius
    return constants, (np.full(lidar.beams, 0.5), np.zeros(lidar.beams)), scan, (*drive.wheel_radii, drive.track), motors
