"""A robot in a world of cells: what it drives it drives exactly, what it sees it sees without noise, all around."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from slam.grid import FREE, OCCUPIED, UNKNOWN, GridGeometry, OccupancyGrid
from slam.kernels import outlook
from slam.kernels.jit import njit
from slam.messages import Estimate, LaserScan, SensorFrame, Status, Trajectory, Twist, WheelOdometry
from slam.navigation.policies import Policy
from slam.se2 import SE2
from slam.snapshot import Snapshot

ANGLES = np.radians(np.arange(-180.0, 180.0, 1.0))
PERIOD, REACH = 0.04, 5.6
DISTANCES = np.arange(0.05, REACH, 0.025)


def states_of_picture(picture: str, scale: int = 1) -> np.ndarray:
    """`#` occupied, `?` unknown, everything else free; the last line has the lowest y, every character is `scale` cells wide."""
    lines = [line for line in picture.split("\n") if line.strip()][::-1]
    codes = {"#": OCCUPIED, "?": UNKNOWN}
    states = np.array([[codes.get(char, FREE) for char in line.strip()] for line in lines], dtype=np.int8)
    return np.kron(states, np.ones((scale, scale), np.int8))


def grid_of_picture(picture: str, scale: int = 1, resolution: float = 0.05) -> OccupancyGrid:
    """A map of such a picture with its corner in the origin."""
    states = states_of_picture(picture, scale)
    return OccupancyGrid.from_states(GridGeometry(resolution, states.shape[1], states.shape[0]), states)


@njit
def first_hits(solid: np.ndarray, start: np.ndarray, ways: np.ndarray, distances: np.ndarray, resolution: float) -> np.ndarray:
    """The least of the distances at which each way meets a solid cell; the corner of the cells is in the origin."""
    ranges = np.full(len(ways), np.inf)
    height, width = solid.shape
    for k in range(len(ways)):
        for distance in distances:
            col = math.floor((start[0] + ways[k, 0] * distance) / resolution)
            row = math.floor((start[1] + ways[k, 1] * distance) / resolution)
            if solid[min(max(row, 0), height - 1), min(max(col, 0), width - 1)]:
                ranges[k] = distance
                break
    return ranges


class CellWorld:
    """A true map, a robot in it, and the map that it makes."""

    def __init__(self, truth: OccupancyGrid, start: SE2, *, known: bool = False) -> None:
        self.truth, self.pose, self.time = truth, start, 0.0
        self.solid = truth.states() == OCCUPIED
        self.map = truth if known else OccupancyGrid.empty(truth.geometry)
        self.closest, self.path = np.inf, [start.as_array()]
        self.added = np.zeros_like(self.solid)
        self.status = Status.TRACKING
        self._edges = truth.geometry.to_points(np.argwhere(self.solid))

    def block(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Put something into the way that no map shows."""
        (r0, c0), (r1, c1) = self.truth.geometry.to_cells(np.array([[x0, y0], [x1, y1]])).tolist()
        self.added[r0 : r1 + 1, c0 : c1 + 1] = True

    def run(self, policy: Policy, duration: float) -> None:
        """Let a policy drive until it is done or the time is over."""
        for step in range(round(duration / PERIOD)):
            frame = self._frame(scan=step % 3 == 0)
            snapshot = Snapshot(self.map, Trajectory(np.arange(len(self.path)), np.array(self.path)))
            twist = policy(frame, Estimate(self.time, self.pose, SE2(), np.eye(3) * 1e-4, self.status), snapshot) or Twist()
            if getattr(policy, "outcome", None) is not None:
                return
            self.pose = self.pose @ SE2.exp(np.array([twist.v, 0.0, twist.omega]) * PERIOD)
            self.time += PERIOD
            self.closest = min(self.closest, float(np.hypot(*(self._edges - self.pose.as_array()[:2]).T).min()))

    def seen(self) -> float:
        """Share of the free cells that the map knows."""
        free = self.truth.states() == FREE
        return float(np.mean(self.map.log_odds[free] < 0.0))

    def _frame(self, *, scan: bool) -> SensorFrame:
        odometry = (WheelOdometry(self.time, self.pose),)
        if not scan:
            return SensorFrame(self.time, odometry)
        self.path.append(self.pose.as_array())
        cell = self.truth.geometry.to_cells(self.pose.as_array()[None, :2])
        if self.map is not self.truth:
            seen = outlook.visible(self.solid, cell, REACH / self.truth.geometry.resolution)
            self.map.log_odds[seen] = self.truth.log_odds[seen]
            self.map.hit_count[seen] = self.truth.hit_count[seen]
        return SensorFrame(self.time, odometry, scans=(self._scan(),))

    def _scan(self) -> LaserScan:
        bearings = self.pose.yaw + ANGLES
        ways = np.column_stack([np.cos(bearings), np.sin(bearings)])
        start = self.pose.as_array()[:2]
        ranges = first_hits(self.solid | self.added, start, ways, DISTANCES, self.truth.geometry.resolution)
        return LaserScan(self.time, ranges, ANGLES, 0.0, 0.02, REACH)


ROOMS = """
########################################
#..................#...................#
#..................#...................#
#..................#...................#
#..................#...................#
#..................#...................#
#..................#...................#
#......................................#
#......................................#
#......................................#
#......................................#
#..................#...................#
#..................#...................#
#..................#...................#
#..................#...................#
########################################
"""
"""Two rooms and a door between; every character is four cells."""


@pytest.fixture
def rooms() -> OccupancyGrid:
    """Two rooms of 3.6 x 2.8 m and a door of 0.8 m between; the corner is in the origin."""
    return grid_of_picture(ROOMS, scale=4)


@pytest.fixture
def of_picture() -> Callable[..., OccupancyGrid]:
    """Makes a map from a picture."""
    return grid_of_picture


@pytest.fixture
def cell_world() -> type[CellWorld]:
    """Makes a world of cells."""
    return CellWorld
