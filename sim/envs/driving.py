"""From frontiers to motion: drives an environment's robot to places, over the map that it has made itself."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.envs.body import Body
from sim.envs.map_kernel import CELL, FREEST, HALF
from sim.envs.native import BEAMS, FIELD, PERIOD
from sim.envs.tally import Tally
from slam.grid import LOG_ODDS_LIMIT, GridGeometry, OccupancyGrid
from slam.messages import Trajectory, Twist
from slam.navigation.costmap import Costmap, Inflation
from slam.navigation.follower import Follower
from slam.navigation.frontiers import Explorer, Frontier
from slam.navigation.planner import Ways, ways_from
from slam.se2 import SE2, FloatArray

HORIZON = 40
"""Steps after which a drive is looked at anew: 4 s."""
TURN_STEPS = 30
"""Steps for which a robot turns at a viewpoint, at most."""
FACING = 0.3
"""Bearing within which the robot faces a place [rad]."""
HOME, HOME_TRIES = 0.2, 60
"""So near to its start the robot is at home [m]; looks at the map, and steps of the turn there, before it gives up."""
MARGIN = 4
"""Cells around what is known."""
LASER_X = 0.03
"""Of the lidar in base [m]."""
ANGLES = np.linspace(-0.5 * FIELD, 0.5 * FIELD, BEAMS)
DIRECTIONS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
"""Of the beams (BEAMS, 2), in base."""


class Driven(Protocol):
    """What can be driven: an `ExploreEnv`."""

    @property
    def body(self) -> Body:
        """The robot."""
        ...

    @property
    def tally(self) -> Tally:
        """What the episode has come to."""
        ...

    @property
    def is_done(self) -> bool:
        """Whether to stop."""
        ...

    def advance(self, twist: Twist) -> float:
        """Drive on for a step; returns its reward."""
        ...


@dataclass(frozen=True, slots=True)
class Driving:
    """How an environment's robot gets about."""

    explorer: Explorer = field(default_factory=Explorer)
    """What counts as a frontier."""
    inflation: Inflation = field(default_factory=Inflation)
    follower: Follower = field(default_factory=Follower)
    horizon: int = HORIZON
    """Steps after which a drive is looked at anew."""

    def build(self, env: Driven) -> Driver:
        """Make the driver of an environment."""
        return Driver(self, env)


class Driver:
    """Sees frontiers and drives to them; what it is rewarded it adds up."""

    def __init__(self, settings: Driving, env: Driven) -> None:
        self._settings, self._env = settings, env
        self._follower = settings.follower.build()
        self._been = [env.body.sight.pose[0].copy()]
        self.ways: Ways | None = None
        """From where the robot was at the last look."""

    @property
    def pose(self) -> SE2:
        """T_map_base, as the robot has it."""
        return SE2.from_array(self._env.body.sight.pose[0])

    def look(self) -> list[Frontier]:
        """All frontiers that can be reached, the nearest first."""
        pose = self.pose
        been = Trajectory(np.arange(len(self._been), dtype=np.float64), np.array(self._been))
        costmap = Costmap.of(known_grid(self._env.body.cells), self._settings.inflation, been)
        self.ways = ways_from(costmap, (pose.x, pose.y))
        return sorted(self._settings.explorer.frontiers(self.ways), key=lambda frontier: frontier.way)

    def drive_to(self, place: tuple[float, float], facing: tuple[float, float] | None = None) -> float:
        """Drive towards a place, after `look`, and turn to face another one [m]; returns the reward of all steps.

        It ends at the place, at the goal of the episode, where something stands in the way, and after the horizon.
        """
        assert self.ways is not None, "look() comes first"
        corners = self.ways.to(self.ways.costmap.flat_cell(place))
        if corners is None or len(corners) < 2:
            return self._face(facing or place)
        self._follower.take(corners)
        reward = 0.0
        for _ in range(self._settings.horizon):
            twist = self._follow(self.ways.costmap)
            if twist is None:
                return reward + (self._face(facing) if facing is not None else 0.0)
            reward += self._advance(twist)
            if self._env.is_done or twist == Twist():  # it stands before something
                break
        return reward

    def stand(self, steps: int = 10) -> float:
        """Do nothing for some steps; returns their reward."""
        return sum(self._advance(Twist()) for _ in range(steps))

    def _advance(self, twist: Twist) -> float:
        """One step; returns its reward."""
        reward, pose = self._env.advance(twist), self._env.body.sight.pose[0]
        if math.dist(pose[:2], self._been[-1][:2]) > CELL:
            self._been.append(pose.copy())
        return reward

    def _follow(self, costmap: Costmap) -> Twist | None:
        pose = self.pose
        room = float(costmap.room_at(np.array([[pose.x, pose.y]]))[0])
        return self._follower.follow(pose, room, self.hits(), self._env.tally.steps * PERIOD)

    def _face(self, place: tuple[float, float]) -> float:
        """Turn towards a place."""
        reward = 0.0
        for _ in range(TURN_STEPS):
            x, y = self.pose.inverse().transform(np.array([place]))[0].tolist()
            bearing = math.atan2(y, x)
            if abs(bearing) < FACING or self._env.is_done:
                break
            reward += self._advance(self._follower.face(bearing, self._env.tally.steps * PERIOD))
        return reward + self._advance(self._follower.rest(self._env.tally.steps * PERIOD))

    def hits(self) -> FloatArray:
        """Ends (N, 2) [m] of the last scan's beams in the map, as if all had been measured at once."""
        scan = self._env.body.sight.scan[0].astype(np.float64)
        met = (scan > 0.0) & (scan < 5.5)
        return self.pose.transform(scan[met, None] * DIRECTIONS[met] + (LASER_X, 0.0))


def drive_home(env: Driven) -> bool:
    """Drive to where the episode began, and look the same way; whether that has been reached."""
    driver = Driving().build(env)
    for _ in range(HOME_TRIES):
        if math.hypot(driver.pose.x, driver.pose.y) < HOME:
            break
        driver.look()
        driver.drive_to((0.0, 0.0))
    x, y = driver.pose.x, driver.pose.y
    if math.hypot(x, y) >= HOME:
        return False
    for _ in range(HOME_TRIES):
        if abs(driver.pose.yaw) < FACING:
            return True
        env.advance(Twist(0.0, -math.copysign(0.8, driver.pose.yaw)))
    return False


def known_grid(cells: NDArray[np.uint8]) -> OccupancyGrid:
    """The known part of an explorer's map (SIDE, SIDE), with a little around it."""
    rows, cols = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    if not len(rows):  # about the start, where nothing is known either
        rows = cols = np.array([HALF])
    low = max(int(rows[0]) - MARGIN, 0), max(int(cols[0]) - MARGIN, 0)
    part = cells[low[0] : int(rows[-1]) + MARGIN + 1, low[1] : int(cols[-1]) + MARGIN + 1]
    corner = SE2((low[1] - HALF) * CELL, (low[0] - HALF) * CELL)
    grid = OccupancyGrid.empty(GridGeometry(CELL, part.shape[1], part.shape[0], corner))
    grid.log_odds[part > 0] = -LOG_ODDS_LIMIT
    grid.log_odds[part > FREEST] = LOG_ODDS_LIMIT
    return grid
