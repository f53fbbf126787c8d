"""The kinematic body: two wheels that roll on the floor without slipping, under a circle that walls stop."""

from __future__ import annotations

import math

import numpy as np

from hardware.spec import DriveSpec, RobotSpec
from sim import rolling_kernel
from sim.drive import Drive, Wheels
from sim.motion import STEP, Motion
from sim.scene import standing_solids
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3
from worlds.geometry import sides
from worlds.world import ROBOT_HEIGHT, World

CARRIED = 4e-4
"""What each wheel carries of the robot's inertia [kg m^2]: half of 0.9 kg at 28 mm, and its own."""
HULL_SLACK = 1e-9
"""Added to hulls, so that rounding shuts nothing out [m]."""


LEAST = 1e-9
"""Way of both wheels in a step above which a body that stays in its place is held by a wall [m]."""


class Unicycle:
    """Implements `sim.stage.Body`: the exact arc of both wheels, a step at a time, on the floor.

    Where the circle would come nearer to an outline the body turns with its wheels but stays in its place: the wheels slip, as they
    do in the physics. What can be pushed stands firm; people and swinging doors do not stop it.
    """

    def __init__(self, world: World, spec: RobotSpec) -> None:
        self._drive = spec.drive or DriveSpec()
        self._radius = spec.radius
        self._obstacles = obstacles(world)
        start = SE2(*world.start)
        self._pose = start.x, start.y, start.yaw
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
        limits = motors.torques[0] * STEP / CARRIED, motors.torques[1] * STEP / CARRIED
        left, right = rolling_kernel.braked(before, motors.rates, limits)
        loads = CARRIED * (left - before[0]) / STEP, CARRIED * (right - before[1]) / STEP
        angles = self._wheels.angles[0] + left * STEP, self._wheels.angles[1] + right * STEP
        return Wheels(angles, (left, right), loads)

    def _roll(self, left: float, right: float) -> None:
        """The wheels turn by angles [rad]; the body follows as far as there is room."""
        geometry = (*self._drive.wheel_radii, self._drive.track)
        before, walls = self._pose, (*self._obstacles, self._radius)
        self._pose, self._room = rolling_kernel.roll(before, self._room, (left, right), geometry, walls)
        if abs(left * geometry[0] + right * geometry[1]) > LEAST:
            held = self._pose[:2] == before[:2]
            self._collisions += held and not self._touches
            self._touches = held

    def _row(self, encoders: tuple[float, float]) -> tuple[float, ...]:
        x, y, yaw = self._pose
        pose = (x, y, 0.0, 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
        return (*pose, *encoders)


def obstacles(world: World) -> tuple[FloatArray, FloatArray]:
    """Outlines (N, 4) [m] of all that stands as low as the robot is high, and its hulls (M, 5), see `outline_kernel.clearance_of`."""
    rings = [sides(solid.footprint()) for solid in standing_solids(world) if solid.z_span[0] < ROBOT_HEIGHT]
    ends = np.cumsum([len(ring) for ring in rings])
    middles = np.array([ring[:, :2].mean(axis=0) for ring in rings])
    radii = [np.linalg.norm(ring[:, :2] - middle, axis=1).max() + HULL_SLACK for ring, middle in zip(rings, middles, strict=True)]
    return np.concatenate(rings), np.column_stack([middles, radii, ends - [len(ring) for ring in rings], ends])
