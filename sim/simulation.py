"""One episode of the twin: physics, motors and devices from time zero on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import ExitStack
from typing import Any

import numpy as np

from hardware.hal import WATCHDOG, Command
from hardware.queues import EventQueue
from hardware.spec import DriveSpec, LidarSpec, RobotSpec
from sim.drive import Motors, Odometer
from sim.imu import Gyro
from sim.lidar import Lidar, moving_bodies
from sim.motion import STEP
from sim.physics import Physics
from sim.rays import BulletRays, EmbreeRays
from sim.realism import Realism
from sim.scene import static_triangles
from slam.messages import Twist
from worlds.world import World

CHUNK = 10
"""Physics steps between two looks at the devices; they read at their own times whatever it is."""
STREAMS = {"scans": 0, "imu": 1}
"""Random stream of each device: switching one off leaves the others' noise as it was."""


class Simulation:
    """A robot in a world. `advance` fills the queues; `motion` and `world` are the truth."""

    def __init__(self, world: World, spec: RobotSpec, realism: Realism, seed: int, rays: str) -> None:
        self.world = world
        self.spec = spec
        self.now = 0.0
        self._drive = spec.drive or DriveSpec()
        self._deadline = math.inf
        self._commanded = Twist()
        self._motors = Motors(self._drive.max_wheel_rate)
        self._odometer = Odometer(self._drive)
        self._gyro = Gyro(spec.imu, realism, _stream(seed, "imu")) if spec.imu else None
        with ExitStack() as held:
            self._physics = Physics(world, realism.true_spec(spec))
            held.callback(self._physics.close)
            self.motion = self._physics.motion
            self._lidar = self._make_lidar(spec.lidar, realism, seed, rays) if spec.lidar else None
            held.pop_all()

    @property
    def client(self) -> int:
        """PyBullet's number of this physics."""
        return self._physics.client

    @property
    def stalled(self) -> bool:
        """Whether a wheel should turn and does not."""
        return self._odometer.stalled

    def close(self) -> None:
        """Let go of the physics; the truth stays."""
        self._physics.close()

    def command(self, twist: Twist) -> None:
        """Drive at a twist within the limits, until the watchdog stops it."""
        self._commanded = twist
        self._deadline = self.now + WATCHDOG
        self._motors.command(self._drive.wheel_rates(twist))

    def advance(self, t: float, queues: Mapping[str, EventQueue[Any]]) -> None:
        """Let time pass until `t` [s]; readings and the watchdog's stop go to the queues."""
        target = _steps_until(t)
        while (done := self.motion.steps - 1) < target:
            if done >= (expiry := _steps_until(min(self._deadline, t + 1.0))):
                self._stop(queues)
                continue
            self._physics.advance(min(CHUNK, target - done, expiry - done), self._motors)
            self._sense(min(t, self.motion.end), queues)
        self._sense(t, queues)
        self.now = max(self.now, t)

    def _sense(self, until: float, queues: Mapping[str, EventQueue[Any]]) -> None:
        while self._odometer.due <= until:
            queues["odometry"].put(self._odometer.read(self.motion, self._motors.rates))
        while self._gyro is not None and self._gyro.due <= until:
            queues["imu"].put(self._gyro.read(self.motion))
        if self._lidar is not None:
            while self._lidar.due <= until:
                self._lidar.sweep(self.motion)
            for scan in self._lidar.arrived(until):
                queues["scans"].put(scan)

    def _stop(self, queues: Mapping[str, EventQueue[Any]]) -> None:
        if self._commanded != Twist():
            queues["commands"].put(Command(self._deadline, Twist()))
        self.command(Twist())
        self._deadline = math.inf

    def _make_lidar(self, spec: LidarSpec, realism: Realism, seed: int, rays: str) -> Lidar:
        rng = _stream(seed, "scans")
        if rays == "bullet":
            return Lidar(spec, realism, BulletRays(self.client), (), rng)
        return Lidar(spec, realism, EmbreeRays(static_triangles(self.world)), moving_bodies(self.world), rng)


def _stream(seed: int, device: str) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAMS[device],)))


def _steps_until(t: float) -> int:
    """Physics steps that reach `t`; a millionth of a step is rounding."""
    return math.ceil(t / STEP - 1e-6)
