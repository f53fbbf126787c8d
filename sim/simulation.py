"""One episode of a twin: body, motors and devices from time zero on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from hardware.hal import WATCHDOG, Command
from hardware.queues import EventQueue
from hardware.spec import DriveSpec, RobotSpec
from sim.camera import Camera
from sim.channels import Channel
from sim.drive import Odometer
from sim.imu import Gyro
from sim.lidar import Lidar
from sim.living import until_tick
from sim.motion import STEP
from sim.realism import Realism
from sim.stage import Stage
from slam.messages import Twist
from worlds.world import World

CHUNK = 10
"""Physics steps between two looks at the devices; they read at their own times whatever it is."""
STREAMS = ("scans", "imu", "images", "late commands", "late odometry", "late imu", "late scans", "late images")
"""Random stream of each device and channel: switching one off leaves the others' noise as it was."""


class Simulation:
    """A robot in a world. `advance` fills the queues; `motion` and `world` are the truth."""

    def __init__(self, world: World, spec: RobotSpec, realism: Realism, seed: int, stage: Stage) -> None:
        self.world = world
        self.spec = spec
        self.now = 0.0
        self._drive = spec.drive or DriveSpec()
        self._deadline = math.inf
        self._obeyed = Twist()
        self._motors = stage.drive
        self._odometer = Odometer(self._drive)
        self._gyro = Gyro(spec.imu, realism, _stream(seed, "imu")) if spec.imu else None
        self._lidar = (
            Lidar(spec.lidar, realism, stage.rays, stage.moving, _stream(seed, "scans"), stage.through_glass) if spec.lidar else None
        )
        self._camera = (
            Camera(spec, realism.camera, stage.scenery, stage.painter, _stream(seed, "images")) if stage.scenery and stage.painter else None
        )
        self._orders = Channel[Twist](realism.commands, _stream(seed, "late commands"))
        channels = {"odometry": realism.odometry, "imu": realism.imu, "scans": realism.scans, "images": realism.images}
        self._readings: dict[str, Channel[Any]] = {
            name: Channel(errors, _stream(seed, f"late {name}")) for name, errors in channels.items()
        }
        self._body = stage.body
        self.living = stage.living
        self.scenery = stage.scenery
        self.motion = stage.body.motion

    @property
    def stalled(self) -> bool:
        """Whether a wheel should turn and does not."""
        return self._odometer.stalled

    @property
    def collisions(self) -> int:
        """How often the robot has begun to touch something that stands in its way."""
        return self._body.collisions

    @property
    def battery_volts(self) -> float | None:
        """At the battery's terminals; None: a body without one."""
        return self._motors.volts

    def close(self) -> None:
        """Let go of the body; the truth stays."""
        self._body.close()

    def command(self, twist: Twist) -> Twist:
        """Send a twist within the limits to the body, which obeys when it arrives, until the watchdog stops it.

        Returns:
            The twist that the body will really be told.
        """
        commanded = self._drive.possible(twist, self._motors.step)
        self._orders.send(self.now, commanded)
        return commanded

    def turn_wheels(self, rates: tuple[float, float]) -> None:
        """Give (left, right) wheel rates [rad/s] to the motors at once, beside commands and their watchdog: the emulated brick does."""
        self._motors.command(rates)

    def advance(self, t: float, queues: Mapping[str, EventQueue[Any]]) -> None:
        """Let time pass until `t` [s]; readings and the watchdog's stop go to the queues."""
        target = _steps_until(t)
        while (done := self.motion.steps - 1) < target:
            event = _steps_until(min(self._deadline, self._orders.due, t + 1.0))
            if done >= event:
                self._obey(queues)
                continue
            self.living.tick(done, *self.motion.track[-1, :2].tolist())
            self._body.advance(min(CHUNK, target - done, event - done, until_tick(done)), self._motors)
            self._sense(min(t, self.motion.end), queues)
        self._sense(t, queues)
        self.now = max(self.now, t)

    def _sense(self, until: float, queues: Mapping[str, EventQueue[Any]]) -> None:
        self._read(until)
        self._look(until)
        for name, channel in self._readings.items():
            for reading in channel.arrived(until):
                queues[name].put(reading)

    def _read(self, until: float) -> None:
        """Encoders and gyro."""
        while self._odometer.due <= until:
            odometry = self._odometer.read(self.motion, self._motors.goals)
            self._readings["odometry"].send(odometry.stamp, odometry)
        while self._gyro is not None and self._gyro.due <= until:
            imu = self._gyro.read(self.motion)
            self._readings["imu"].send(imu.stamp, imu)

    def _look(self, until: float) -> None:
        """Lidar and camera: what they see arrives some time after it was measured."""
        if self._lidar is not None:
            while self._lidar.due <= until:
                self._lidar.sweep(self.motion)
            for arrival, scan in self._lidar.arrived(until):
                self._readings["scans"].send(arrival, scan)
        if self._camera is not None:
            while self._camera.due <= until:
                self._camera.shoot(self.motion)
            for arrival, image in self._camera.arrived(until):
                self._readings["images"].send(arrival, image)

    def _obey(self, queues: Mapping[str, EventQueue[Any]]) -> None:
        """Carry out the watchdog's stop or the next command, whichever comes first."""
        if self._deadline < self._orders.due:
            if self._obeyed != Twist():
                queues["commands"].put(Command(self._deadline, Twist()))
            self._obeyed, self._deadline = Twist(), math.inf
        else:
            self._deadline = self._orders.due + WATCHDOG
            self._obeyed = self._orders.next()
        self._motors.command(self._drive.wheel_rates(self._obeyed))


def _stream(seed: int, device: str) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAMS.index(device),)))


def _steps_until(t: float) -> int:
    """Physics steps that reach `t`; a millionth of a step is rounding."""
    return math.ceil(t / STEP - 1e-6)
