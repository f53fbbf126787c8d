"""What has moved and how: a window of full poses for the devices, and the track of `base` for the truth."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sim import kernels
from slam.se2 import SE2, FloatArray, wrap_angle
from slam.se3 import SE3

NANOSECONDS = 9
"""Digits of every stamp: what a recording keeps, so that a replay sees the same bits."""
STEP = 0.002
"""Physics step [s]: the period of the EV3's motor regulator."""
WHEELS = 7
"""First column of the wheel angles in a row."""
BODIES = 9
"""First column of the bodies' poses in a row."""


class Frames(NamedTuple):
    """Frames of one rigid body at equal distances in time; between two their numbers are interpolated linearly."""

    values: FloatArray
    """(K, 12) rotation row by row and position [m] of T_world_body."""
    first: float
    """Time of the first [s]."""
    step: float
    """Time between two [s]."""


class Motion:
    """Rows of the last second, one a physics step, and the planar track of `base` since the start.

    A row holds T_world_base as x y z [m] and quaternion x y z w, two wheel angles [rad], and seven columns for each body.
    """

    def __init__(self, bodies: int, T_inertial_base: SE3) -> None:
        self._rows = np.zeros((512, BODIES + 7 * bodies))
        self._first = 0
        self._count = 0
        self._offset = (np.array(T_inertial_base.t), np.array(T_inertial_base.quaternion()))
        self._track = np.zeros((1 << 14, 3))
        self.steps = 0
        """Rows so far; the newest is at `(steps - 1) * STEP`."""

    @property
    def end(self) -> float:
        """Time of the newest row [s]."""
        return (self.steps - 1) * STEP

    @property
    def track(self) -> FloatArray:
        """(steps, 3) x, y [m], yaw [rad] of T_world_base at every step since the start."""
        return self._track[: self.steps]

    def append(self, rows: list[tuple[float, ...]]) -> None:
        """Add rows, 256 at most at a time, whose leading pose is that of PyBullet's inertial frame."""
        self._make_room(len(rows))
        added = self._rows[self._count : self._count + len(rows)]
        added[:] = rows
        self._track[self.steps : self.steps + len(rows)] = kernels.to_base(added, *self._offset)
        self._count += len(rows)
        self.steps += len(rows)

    def row_at(self, t: float) -> FloatArray:
        """Row at time `t` [s], columns interpolated one by one: good for angles and positions, not for quaternions."""
        k, f = self._place(t, self._first, self._count)
        return self._rows[k] + f * (self._rows[min(k + 1, self._count - 1)] - self._rows[k])

    def poses_between(self, start: float, end: float, column: int = 0, count: int = 1) -> tuple[FloatArray, float]:
        """Poses (K, 7 count) that start in `column`, a row a physics step, two at least, from before `start` to after `end` [s].

        Returns:
            The poses and the time of the first one [s].
        """
        first = min(max(int(start / STEP) - self._first, 0), max(self._count - 2, 0))
        last = min(math.ceil(end / STEP) - self._first, self._count - 1)
        poses = self._rows[[0, 0]] if self._count == 1 else self._rows[first : max(last, first + 1) + 1]
        return poses[:, column : column + 7 * count], (self._first + first) * STEP

    def frames_between(self, start: float, end: float, column: int = 0) -> Frames:
        """The poses of `poses_between` as frames."""
        poses, first = self.poses_between(start, end, column)
        return Frames(kernels.frames_of(poses), first, STEP)

    def pose_at(self, t: float) -> SE2:
        """T_world_base at any past time."""
        k, f = self._place(t, 0, self.steps)
        (xa, ya, yaw_a), (xb, yb, yaw_b) = self._track[k].tolist(), self._track[min(k + 1, self.steps - 1)].tolist()
        return SE2(xa + f * (xb - xa), ya + f * (yb - ya), yaw_a + f * wrap_angle(yaw_b - yaw_a))

    def yaw_rate_at(self, t: float) -> float:
        """Mean yaw rate of `base` over the physics step that ends at or after `t` [rad/s]."""
        k = min(max(math.ceil(t / STEP - 1e-6), 1), self.steps - 1)
        return wrap_angle(float(self._track[k, 2] - self._track[k - 1, 2])) / STEP if k > 0 else 0.0

    @staticmethod
    def _place(t: float, first: int, count: int) -> tuple[int, float]:
        place = min(max(t / STEP - first, 0.0), count - 1.0)
        k = min(int(place), max(count - 2, 0))
        return k, place - k

    def _make_room(self, count: int) -> None:
        if self._count + count > len(self._rows):
            kept = len(self._rows) // 2
            self._rows[:kept] = self._rows[self._count - kept : self._count]
            self._first += self._count - kept
            self._count = kept
        if self.steps + count > len(self._track):
            self._track = np.vstack([self._track, np.zeros_like(self._track)])
