"""The `goal` policy: to one place, through what is unknown where that is shorter."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slam.errors import GoalError
from slam.grid import FREE, OCCUPIED, OccupancyGrid
from slam.messages import Estimate, SensorFrame, Twist
from slam.navigation.astray import Astray
from slam.navigation.costmap import Costmap, Inflation
from slam.navigation.navigator import Navigation, Point, Progress
from slam.navigation.outcome import Outcome
from slam.se2 import FloatArray
from slam.snapshot import Snapshot

SURE = 3
"""So many maps in a row must say that a goal is impossible."""


@dataclass(frozen=True, slots=True)
class GoTo:
    """Drive to a place in the map and stop."""

    x: float = 0.0
    """[m]"""
    y: float = 0.0
    """[m]"""
    navigation: Navigation = field(default_factory=lambda: Navigation(inflation=Inflation(unknown=2.0)))
    astray: Astray = field(default_factory=Astray)

    def build(self, route: FloatArray) -> GoalPolicy:
        """Make the policy; it needs no route."""
        return GoalPolicy(self)


class GoalPolicy:
    """Drives to its goal; `outcome` says how that ended."""

    def __init__(self, settings: GoTo) -> None:
        self._goal: Point = (settings.x, settings.y)
        self._navigator = settings.navigation.build()
        self._astray = settings.astray.build()
        self._doubts = 0
        self._outcome: Outcome | None = None

    @property
    def outcome(self) -> Outcome | None:
        """How it ended; None while it goes on."""
        return self._outcome

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The next command."""
        if (lost := self._astray(frame, estimate)) is not None:
            return lost
        navigator = self._navigator
        if navigator.goal is None:
            navigator.go(self._goal)
        new_ways = navigator.see(frame, estimate, snapshot)
        if self._outcome is None:
            self._outcome = self._end(new_ways)
        if self._outcome is not None:
            navigator.stop()
        return navigator.drive()

    def _end(self, new_ways: bool) -> Outcome | None:
        x, y = self._goal
        ways, progress = self._navigator.ways, self._navigator.progress
        if progress is Progress.ARRIVED:
            return Outcome(True, f"the robot is at the goal ({x:g}, {y:g})")
        if new_ways and ways is not None:
            trouble = _trouble(ways.costmap, self._goal)
            self._doubts = self._doubts + 1 if trouble else 0
            if self._doubts >= SURE:
                return Outcome(False, trouble)
        if progress is Progress.FAILED:
            why = "the way stays blocked" if self._navigator.has_way else "the map shows no way to it"
            return Outcome(False, f"the goal ({x:g}, {y:g}) cannot be reached: {why}")
        return None


def check_goal(grid: OccupancyGrid, goal: Point, inflation: Inflation | None = None) -> None:
    """See that a robot can stand at a goal [m] in a finished map.

    Raises:
        GoalError: it lies outside the map, in a wall, too near to one, or where the map knows nothing.
    """
    costmap, (x, y) = Costmap.of(grid, inflation or Inflation()), goal
    cell = costmap.flat_cell(goal)
    if cell < 0:
        raise GoalError(f"the goal ({x:g}, {y:g}) lies outside the map")
    if trouble := _trouble(costmap, goal):
        raise GoalError(trouble)
    if costmap.states.flat[cell] != FREE:
        raise GoalError(f"the goal ({x:g}, {y:g}) lies where the map knows nothing")


def _trouble(costmap: Costmap, goal: Point) -> str:
    """Why a robot cannot stand at a place; empty where it can, or may."""
    x, y = goal
    cell = costmap.flat_cell(goal)
    if cell >= 0 and costmap.states.flat[cell] == OCCUPIED:
        return f"the goal ({x:g}, {y:g}) lies in a wall"
    room, needed = float(costmap.room_at(np.array([goal]))[0]), costmap.inflation.tight
    if cell >= 0 and room < needed:
        return f"the goal ({x:g}, {y:g}) has {max(room, 0.0):.2f} m of room about it, the robot needs {needed:.2f} m"
    return ""
