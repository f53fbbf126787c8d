"""How the robot moves between two scans, by its own sensors or, without wheels, as it did before."""

from __future__ import annotations

import math

import numpy as np

from slam.messages import LaserScan, SensorFrame, Trajectory
from slam.motion.dead_reckoning import DeadReckoning
from slam.scans import PointScan, Unveil, deskew
from slam.se2 import SE2, FloatArray

CARRY = 1.0
"""So long after a scan a robot without wheels is taken to go on as it did [s]."""
SPAN = 0.02
"""Over which a twist is taken [s]."""


class EgoMotion:
    """What every pipeline asks of wheels and gyro: deskewed points, the step since the last known pose, the pose at a time.

    A pipeline calls `hear` with each frame, then for each scan `points` and `step`, and says with `settle` where it was taken.
    """

    def __init__(self, unveil: Unveil, T_map_base: SE2) -> None:
        self._unveil = unveil
        self.motion = DeadReckoning()
        self._stamp = -math.inf
        self._T_odom_base = SE2()
        self._T_map_base = T_map_base
        self._velocity: FloatArray = np.zeros(3)

    @property
    def T_map_base(self) -> SE2:
        """The last pose that was settled; before it the start."""
        return self._T_map_base

    def hear(self, frame: SensorFrame) -> None:
        """Take in wheels and gyro; the odometry's first pose is where the robot is now, even when scans came before it."""
        if not (frame.odometry or frame.imu):
            return
        first = self.motion.empty
        self.motion.add(frame.odometry, frame.imu)
        if first and not self.motion.empty:
            self._T_odom_base = self.motion.pose_at(-math.inf)

    def points(self, scan: LaserScan) -> PointScan:
        """The scan as points in base at its stamp: swept by wheels and gyro, without them at constant velocity."""
        scan = self._unveil.clean(scan)
        if self.wheels_cover(scan.stamp):
            return deskew(scan, self.motion.window(scan.stamp))
        swept, end = self._carried_on(scan.stamp, scan.end), max(scan.end, scan.stamp + 1e-6)
        return deskew(scan, Trajectory(np.array([scan.stamp, end]), np.array([np.zeros(3), swept.as_array()])))

    def wheels_cover(self, stamp: float) -> bool:
        """Whether the odometry has gone on since the last settled scan, so that it knows the way to one taken at `stamp` [s]."""
        return self.motion.newest > min(self._stamp, stamp)

    def step(self, stamp: float) -> SE2:
        """T_last_now: from the pose settled last to the one at `stamp` [s]."""
        if self.wheels_cover(stamp):
            return self._T_odom_base.inverse() @ self.motion.pose_at(stamp)
        if not math.isfinite(self._stamp):
            return SE2()
        return self._carried_on(self._stamp, stamp)

    def at(self, stamp: float) -> SE2:
        """T_map_base at a time [s], carried on from the last settled pose."""
        return self._T_map_base @ self.step(stamp)

    def _carried_on(self, start: float, end: float) -> SE2:
        """The step between two times [s] at the last velocity, turned by the gyro where it speaks."""
        xi, turn = self._velocity * min(max(end - start, 0.0), CARRY), self.motion.gyro_turn(start, end)
        return SE2.exp(xi if turn is None else np.array([xi[0], xi[1], turn]))

    def twist(self, stamp: float) -> FloatArray:
        """(3,) v_x, v_y [m/s], omega [rad/s] of base up to a time [s]: by wheels and gyro, without wheels as between the last poses."""
        if self.wheels_cover(stamp):
            return (self.motion.pose_at(stamp - SPAN).inverse() @ self.motion.pose_at(stamp)).log() / SPAN
        turn = self.motion.gyro_turn(stamp - SPAN, stamp)
        return self._velocity if turn is None else np.array([self._velocity[0], self._velocity[1], turn / SPAN])

    def since(self, stamp: float) -> float:
        """Time from the last settled pose to `stamp` [s]; 0 before the first."""
        return stamp - self._stamp if math.isfinite(self._stamp) else 0.0

    def settle(self, stamp: float, T_map_base: SE2, jumped: bool = False) -> None:
        """The robot was here at the time of a scan [s]; after a jump its velocity is not known."""
        if stamp > self._stamp and math.isfinite(self._stamp) and not jumped:
            self._velocity = (self._T_map_base.inverse() @ T_map_base).log() / (stamp - self._stamp)
        elif jumped:
            self._velocity = np.zeros(3)
        self._stamp, self._T_odom_base, self._T_map_base = stamp, self.motion.pose_at(stamp), T_map_base

    def place(self, T_map_base: SE2) -> None:
        """The last settled pose was here: the robot has been found by other means."""
        self._T_map_base, self._velocity = T_map_base, np.zeros(3)

    def rebase(self, T_new_map: SE2) -> None:
        """Go on in another map."""
        self._T_map_base = T_new_map @ self._T_map_base
