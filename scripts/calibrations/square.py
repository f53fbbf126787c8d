"""The drive of `twin calibrate odometry --square`: a square to the left and the same one to the right, where there is room for it.

After Borenstein and Feng, "Measurement and correction of systematic odometry errors in mobile robots" (1996), section III: what unequal
wheels and a wrong track do to the one, they do to the other with the other sign.
"""

from __future__ import annotations

import math

import numpy as np

from scripts.errors import UsageError
from slam.messages import Estimate, SensorFrame, Twist
from slam.navigation.costmap import Costmap, Inflation
from slam.navigation.spin import Spin
from slam.navigation.tour import Tour, TourPolicy
from slam.se2 import SE2, FloatArray
from slam.snapshot import Snapshot

SETTING_OUT = math.radians(5.0)
"""Between two ways to set out that are looked at [rad]."""
SHARES = 0.5, 0.0, 1.0
"""Where on the square's side the robot may stand at first, from its first corner on."""
GRAIN = 0.05
"""Between two places of the way at which there must be room [m]."""
SMALLEST = 0.3
"""A smaller square tells nothing [m]."""
CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64)


class SquareDrive:
    """A `Policy`: looks all round, chooses where the square lies, then drives it to both sides, in turn, for ever."""

    def __init__(self, side: float, inflation: Inflation) -> None:
        """A square of so many metres, by a robot that needs so much room."""
        self._side = side
        self._inflation = inflation
        self._look = Spin(middle=False, step=math.radians(90.0), dwell=0.2).build(np.empty((0, 2)))
        self._tour: TourPolicy | None = None

    def __call__(self, frame: SensorFrame, estimate: Estimate, snapshot: Snapshot) -> Twist:
        """The next command.

        Raises:
            UsageError: there is no room.
        """
        if self._tour is None:
            if not self._look.done:
                return self._look(frame, estimate, snapshot)
            self._tour = Tour().build(self._chosen(estimate.T_map_base, snapshot))
        return self._tour(frame, estimate, snapshot)

    def _chosen(self, T_map_base: SE2, snapshot: Snapshot) -> FloatArray:
        """Waypoints (N, 2) [m] in the map, of the square with the most room round it."""
        costmap = Costmap.of(snapshot.map, self._inflation, snapshot.trajectory)
        way, room = self._roomiest(costmap, T_map_base, self._side)
        if room >= self._inflation.tight:
            return way
        fitting = [
            side for side in np.arange(self._side, SMALLEST, -0.1) if self._roomiest(costmap, T_map_base, side)[1] >= self._inflation.tight
        ]
        better = f"--square {fitting[0]:.1f} has room, or " if fitting else ""
        raise UsageError(
            f"--square {self._side:g}: no room for such a square where the robot stands; {better}put it where it is free all round"
        )

    def _roomiest(self, costmap: Costmap, T_map_base: SE2, side: float) -> tuple[FloatArray, float]:
        """The way with the most room [m] at its narrowest place, which is that room or none where it may meet what is unknown."""
        turns = np.arange(0.0, math.tau, SETTING_OUT)
        ways = [T_map_base.transform(SE2(yaw=turn).transform(square_way(side, share))) for turn in turns for share in SHARES]
        rooms = [_room(costmap, way) for way in ways]
        best = int(np.argmax(rooms))
        return ways[best], rooms[best]


def square_way(side: float, share: float) -> FloatArray:
    """Waypoints (N, 2) [m] of a square that is driven to the left, then to the right, as a closed route from (0, 0) on.

    The square's first side lies along x, and (0, 0) at `share` of it.
    """
    left = side * (CORNERS - (share, 0.0))
    start = np.zeros((1, 2))
    return np.vstack([left[1:], left[:1], start, left[:1], left[:0:-1], start])


def _room(costmap: Costmap, way: FloatArray) -> float:
    """At the narrowest place of a closed way (N, 2) [m]; 0 where the robot may meet what is unknown."""
    ends = np.roll(way, -1, axis=0)
    steps = max(round(float(np.max(np.hypot(*(ends - way).T))) / GRAIN), 1)
    points = (way[:, None] + np.linspace(0.0, 1.0, steps, endpoint=False)[None, :, None] * (ends - way)[:, None]).reshape(-1, 2)
    if not np.all(np.isfinite(costmap.costs_at(points))):
        return 0.0
    return float(np.min(costmap.room_at(points)))
