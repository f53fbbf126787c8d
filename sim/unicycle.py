"""The kinematic body: two wheels that roll on the floor without slipping, under a circle that walls stop."""

from __future__ import annotations

import math

import numpy as np

from hardware.spec import DriveSpec, RobotSpec
from sim import outline_kernel
from sim.drive import Drive, Wheels
from sim.motion import STEP, Motion
from sim.scene import standing_solids
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3
from worlds.geometry import sides
from worlds.world import ROBOT_HEIGHT, World

CARRIED = 4e-4
"""What each wheel carries of the robot's inertia [kg m^2]: half of 0.9 kg at 28 mm, and its own."""


class Unicycle:
    """Implements `sim.stage.Body`: the exact arc of both wheels, a step at a time, on the floor.

    Where the circle would come nearer to an outline the body turns with its wheels but stays in its place: the wheels slip, as they
    do in the physics. What can be pushed stands firm; people and swinging doors do not stop it.
    """

    def __init__(self, world: World, spec: RobotSpec) -> None:
        self._drive = spec.drive or DriveSpec()
        self._radius = spec.radius
        self._obstacles = _obstacles(world)
        self._pose = SE2(*world.start)
        self._wheels = Wheels()
        self._room = 0.0  # the way that is certainly free [m]
        self._motion = Motion(0, SE3())
        self._motion.append([self._row(self._wheels.angles)])
        self._touches, self._collisions = False, 0

    @property
    def motion(self) -> Motion:
        """See `Body`."""
        return self._motion

    @property
    def collisions(self) -> int:
        """See `Body`."""
        return self._collisions

    def advance(self, steps: int, motors: Drive) -> None:
        """See `Body`."""
        rows: list[tuple[float, ...]] = []
        for _ in range(steps):
            motors.tick(self._wheels)
            self._wheels = self._turned(motors)
            self._roll(self._wheels.rates[0] * STEP, self._wheels.rates[1] * STEP)
            rows.append(self._row(motors.encoders or self._wheels.angles))
        self._motion.append(rows)

    def close(self) -> None:
        """See `Body`; there is nothing to let go of."""

    def _turned(self, motors: Drive) -> Wheels:
        """The wheels one step later: brought to their motors' rates as far as the torques reach."""
        before = self._wheels.rates
        left, right = (
            old + min(max(rate - old, -limit), limit)
            for old, rate, limit in zip(before, motors.rates, (torque * STEP / CARRIED for torque in motors.torques), strict=True)
        )
        loads = CARRIED * (left - before[0]) / STEP, CARRIED * (right - before[1]) / STEP
        angles = self._wheels.angles[0] + left * STEP, self._wheels.angles[1] + right * STEP
        return Wheels(angles, (left, right), loads)

    def _roll(self, left: float, right: float) -> None:
        """The wheels turn by angles [rad]; the body follows as far as there is room."""
        moved = self._pose @ self._drive.increment(left, right)
        way = math.hypot(moved.x - self._pose.x, moved.y - self._pose.y)
        stopped = way > self._room and not self._has_room(moved)
        if stopped:
            moved, way = SE2(self._pose.x, self._pose.y, moved.yaw), 0.0
        if way > 0.0 or stopped:
            self._collisions += stopped and not self._touches
            self._touches = stopped
        self._room -= way
        self._pose = moved

    def _has_room(self, moved: SE2) -> bool:
        """Whether the body may go there: nothing is nearer than its radius, or it is on its way out."""
        now, then = (outline_kernel.clearance(self._obstacles, pose.x, pose.y) for pose in (self._pose, moved))
        self._room = max(now - self._radius, 0.0)
        return then >= min(self._radius, now)

    def _row(self, encoders: tuple[float, float]) -> tuple[float, ...]:
        half = 0.5 * self._pose.yaw
        pose = (self._pose.x, self._pose.y, 0.0, 0.0, 0.0, math.sin(half), math.cos(half))
        return (*pose, *encoders)


def _obstacles(world: World) -> FloatArray:
    """Outlines (N, 4) [m] of all that stands as low as the robot is high."""
    return np.concatenate([sides(solid.footprint()) for solid in standing_solids(world) if solid.z_span[0] < ROBOT_HEIGHT])
