"""Wheels and gyro: distance from the wheels, heading from the gyro while it speaks."""

from __future__ import annotations

import logging
import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slam.messages import Imu, Trajectory, WheelOdometry
from slam.se2 import SE2, interpolate

_log = logging.getLogger(__name__)

HISTORY = 2.0
"""Length of the kept past [s]."""
STANDSTILL = 0.5
"""Time without wheel motion after which the gyro's mean is its bias [s]."""
JUMP, MAX_SPEED, MAX_YAW_RATE = 0.3, 3.0, 5.0
"""A step beyond JUMP [m, rad] and what MAX_SPEED [m/s] and MAX_YAW_RATE [rad/s] allow is a reset of the odometry."""
SLOWEST = 10.0
"""The gyro waits so long for wheel odometry [s]."""
SILENCE = 0.1
"""Gap between gyro readings beyond which the wheels give the heading, and how long motion is taken to go on as it was [s]."""


class DeadReckoning:
    """Continuous `T_odom_base` from wheel odometry and a yaw gyro."""

    def __init__(self) -> None:
        self._history: deque[tuple[float, SE2]] = deque()
        self._wheels: WheelOdometry | None = None
        self._gyro: deque[Imu] = deque()
        self._bias, self._bias_readings = 0.0, 0
        self._still_since = -np.inf
        self._jumped = False

    @property
    def empty(self) -> bool:
        """No wheel odometry has come yet."""
        return self._wheels is None

    @property
    def newest(self) -> float:
        """Time of the newest pose [s]; -inf before the first."""
        return self._history[-1][0] if self._history else -np.inf

    @property
    def wheels(self) -> SE2:
        """`T_odom_base` of the wheels alone, newest."""
        return self._wheels.T_odom_base if self._wheels else SE2()

    def add(self, odometry: Sequence[WheelOdometry], imu: Sequence[Imu]) -> None:
        """Take in new readings, oldest first; those that are not finite are left out."""
        self._gyro.extend(reading for reading in imu if math.isfinite(reading.yaw_rate))
        for reading in odometry:
            if reading.T_odom_base.is_finite():
                self._step(reading)
        while len(self._history) > 2 and self._history[1][0] < self.newest - HISTORY:
            self._history.popleft()
        while len(self._gyro) > 2 and self._gyro[1].stamp < max(self.newest, self._gyro[-1].stamp - SLOWEST) - HISTORY:
            self._gyro.popleft()

    def pose_at(self, t: float) -> SE2:
        """T_odom_base at `t` [s]: between readings along the arc, for a moment after them as they ended, held beyond."""
        if t > self.newest > -np.inf:
            return self._carried_on(min(t, self.newest + SILENCE))
        later = None
        for stamp, pose in reversed(self._history):
            if stamp <= t:
                return pose if later is None else interpolate(pose, later[1], (t - stamp) / (later[0] - stamp))
            later = (stamp, pose)
        return later[1] if later else SE2()

    def window(self, since: float) -> Trajectory:
        """The kept poses from the last one before `since` [s] on."""
        samples: list[tuple[float, float, float, float]] = []
        for stamp, pose in reversed(self._history):
            samples.append((stamp, pose.x, pose.y, pose.yaw))
            if stamp < since:
                break
        rows = np.array(samples[::-1]).reshape(-1, 4)
        return Trajectory(rows[:, 0], rows[:, 1:])

    def _carried_on(self, t: float) -> SE2:
        """The newest pose moved on to `t` [s] by the last step's twist, and turned by the gyro, which is heard more often."""
        newest, pose = self._history[-1]
        before, T_odom_before = self._history[-2] if len(self._history) > 1 else (-np.inf, pose)
        if newest - before > SILENCE:
            return pose
        xi = (T_odom_before.inverse() @ pose).log() * ((t - newest) / (newest - before))
        turn = self.gyro_turn(newest, t)
        return pose @ SE2.exp(xi if turn is None else np.array([xi[0], xi[1], turn]))

    def _step(self, reading: WheelOdometry) -> None:
        if self._wheels is None:
            self._history.append((reading.stamp, reading.T_odom_base))
        elif reading.stamp > self._wheels.stamp:
            delta = self._believable(self._wheels.T_odom_base.inverse() @ reading.T_odom_base, reading.stamp - self._wheels.stamp)
            turn = self.gyro_turn(self._wheels.stamp, reading.stamp)
            self._learn_bias(delta, self._wheels.stamp, reading.stamp)
            if turn is not None:
                xi = delta.log()
                delta = SE2.exp(np.array([xi[0], xi[1], turn]))
            self._history.append((reading.stamp, self._history[-1][1] @ delta))
        else:
            return  # its motion is part of the next reading's
        self._wheels = reading

    def _believable(self, delta: SE2, duration: float) -> SE2:
        """The step, or none where no wheel could have made it: the odometry was reset."""
        if math.hypot(delta.x, delta.y) <= JUMP + MAX_SPEED * duration and abs(delta.yaw) <= JUMP + MAX_YAW_RATE * duration:
            return delta
        if not self._jumped:
            _log.warning("the wheel odometry jumps by %.2f m, %.2f rad; taken as a reset", math.hypot(delta.x, delta.y), delta.yaw)
        self._jumped = True
        return SE2()

    def gyro_turn(self, start: float, end: float) -> float | None:
        """Turn between two times [rad] by the trapezoid rule; None where the gyro does not cover them."""
        around = self._gyro_around(start, end)
        if len(around) < 2 or around[0].stamp > start + SILENCE or around[-1].stamp < end - SILENCE:
            return None
        turn = max(around[0].stamp - start, 0.0) * around[0].yaw_rate + max(end - around[-1].stamp, 0.0) * around[-1].yaw_rate
        for a, b in pairwise(around):
            gap = b.stamp - a.stamp
            if gap > SILENCE:
                return None
            left, right = max(a.stamp, start), min(b.stamp, end)
            if right > left:
                middle = (0.5 * (left + right) - a.stamp) / gap
                turn += (right - left) * (a.yaw_rate + middle * (b.yaw_rate - a.yaw_rate))
        return turn - self._bias * (end - start)

    def _gyro_around(self, start: float, end: float) -> list[Imu]:
        """The readings between two times [s], the one before and the one after."""
        around: list[Imu] = []
        for reading in reversed(self._gyro):
            if reading.stamp >= end:
                around.clear()
            around.append(reading)
            if reading.stamp < start:
                break
        around.reverse()
        return around

    def _learn_bias(self, delta: SE2, start: float, end: float) -> None:
        """Average the gyro while the wheels stand still."""
        if delta != SE2():
            self._still_since = end
        if self._still_since == -np.inf:
            self._still_since = start
        if end - self._still_since < STANDSTILL:
            return
        for reading in self._gyro:
            if start < reading.stamp <= end:
                self._bias_readings += 1
                self._bias += (reading.yaw_rate - self._bias) / min(self._bias_readings, 1000)
