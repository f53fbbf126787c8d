"""What a robot is, readable before it is opened: wheels, limits, sensors and their mounts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hardware.camera_spec import CameraSpec, camera_mount
from hardware.errors import SpecError
from slam.messages import CameraInfo, Twist
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3


@dataclass(frozen=True, slots=True)
class DriveSpec:
    """A differential drive as its owner believes it to be (the real one differs by its calibration error)."""

    wheel_radii: tuple[float, float] = (0.028, 0.028)
    """Left, right [m]."""
    track: float = 0.120
    """Distance between the wheels' contact points [m]."""
    counts_per_turn: int = 360
    """Encoder counts per wheel turn."""
    max_wheel_rate: float = 14.0
    """Fastest regulated wheel rate [rad/s]; about 800 deg/s on a 7.4 V pack."""
    max_speed: float = 0.35
    """Limit of the forward speed [m/s]."""
    max_yaw_rate: float = 3.0
    """Limit of the yaw rate [rad/s]."""
    period: float = 0.02
    """Time between encoder readings [s]."""

    def __post_init__(self) -> None:
        positive = (
            *self.wheel_radii,
            self.track,
            self.counts_per_turn,
            self.max_wheel_rate,
            self.max_speed,
            self.max_yaw_rate,
            self.period,
        )
        if not all(math.isfinite(value) and value > 0 for value in positive):
            raise SpecError(f"every number of the drive must be finite and positive, got {self}")

    def increment(self, left: float, right: float) -> SE2:
        """Motion of `base` while the wheels turn by (left, right) [rad]: exact along the arc."""
        d_left, d_right = left * self.wheel_radii[0], right * self.wheel_radii[1]
        return SE2.exp(np.array([0.5 * (d_left + d_right), 0.0, (d_right - d_left) / self.track]))

    def wheel_rates(self, twist: Twist) -> tuple[float, float]:
        """Wheel rates (left, right) [rad/s] that give this twist."""
        half = 0.5 * self.track * twist.omega
        return (twist.v - half) / self.wheel_radii[0], (twist.v + half) / self.wheel_radii[1]

    def twist(self, left: float, right: float) -> Twist:
        """Twist of `base` at wheel rates (left, right) [rad/s]."""
        v_left, v_right = left * self.wheel_radii[0], right * self.wheel_radii[1]
        return Twist(0.5 * (v_left + v_right), (v_right - v_left) / self.track)

    def limit(self, twist: Twist) -> Twist:
        """Clip a twist to the limits. A turn keeps its curvature when a wheel would be too fast; a command that is not finite stops."""
        if not (math.isfinite(twist.v) and math.isfinite(twist.omega)):
            return Twist()
        v = min(max(twist.v, -self.max_speed), self.max_speed)
        omega = min(max(twist.omega, -self.max_yaw_rate), self.max_yaw_rate)
        fastest = max(abs(rate) for rate in self.wheel_rates(Twist(v, omega)))
        scale = min(1.0, self.max_wheel_rate / fastest) if fastest > 0.0 else 1.0
        return Twist(v * scale, omega * scale)

    def possible(self, twist: Twist, step: float) -> Twist:
        """The twist that wheel rates in whole multiples of `step` [rad/s] give for one within the limits; 0: any rate.

        Rates are rounded to the nearest multiple, or towards zero where that would break a limit.
        """
        if step == 0.0:
            return twist
        left, right = (round(rate / step) for rate in self.wheel_rates(twist))
        rounded = self.twist(left * step, right * step)
        if self._within_limits(rounded):
            return rounded
        left, right = (math.trunc(rate / step) for rate in self.wheel_rates(twist))
        return self.twist(left * step, right * step)

    def _within_limits(self, twist: Twist) -> bool:
        fastest = max(abs(rate) for rate in self.wheel_rates(twist))
        return abs(twist.v) <= self.max_speed and abs(twist.omega) <= self.max_yaw_rate and fastest <= self.max_wheel_rate


@dataclass(frozen=True, slots=True)
class LidarSpec:
    """A planar lidar; the defaults are the Hokuyo URG-04LX-UG01 (steps 44..725 of 1024, 10 Hz, counter-clockwise)."""

    model: str = "URG-04LX-UG01"
    beams: int = 682
    angle_min: float = (44 - 384) * math.tau / 1024
    """Direction of the first beam in `laser` [rad]."""
    angle_increment: float = math.tau / 1024
    """[rad]"""
    time_increment: float = 0.1 / 1024
    """Time from beam to beam [s]."""
    period: float = 0.1
    """Time from sweep to sweep [s]."""
    range_min: float = 0.02
    range_max: float = 5.6
    T_base_laser: SE3 = field(default_factory=lambda: SE3.from_xyz_rpy((0.03, 0.0, 0.18)))

    @property
    def angles(self) -> FloatArray:
        """Direction of every beam (N,) [rad]."""
        return self.angle_min + self.angle_increment * np.arange(self.beams, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class ImuSpec:
    """A yaw gyro."""

    model: str = "LEGO EV3 gyro"
    period: float = 0.01
    """Time between readings [s]."""
    max_rate: float = math.radians(440.0)
    """Largest rate it can report [rad/s]."""
    T_base_imu: SE3 = field(default_factory=lambda: SE3.from_xyz_rpy((-0.08, 0.0, 0.115)))


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """The whole robot. A missing sensor is None."""

    name: str = "bricktwin"
    drive: DriveSpec | None = field(default_factory=DriveSpec)
    lidar: LidarSpec | None = field(default_factory=LidarSpec)
    imu: ImuSpec | None = field(default_factory=ImuSpec)
    camera: CameraSpec | None = field(default_factory=CameraSpec)
    T_base_camera: SE3 = field(default_factory=lambda: camera_mount((0.075, 0.0, 0.20), math.radians(15.0)))
    """Mount of the colour camera's optical frame (z forward, x right, y down); the camera's body is there even where `camera` is None."""
    radius: float = 0.13
    """Radius about `base` of the circle that holds the whole robot [m]."""

    def require_camera(self) -> CameraSpec:
        """The camera of a robot that must have one.

        Raises:
            SpecError: it has none.
        """
        if self.camera is None:
            raise SpecError("this robot has no camera; give the spec a `camera`")
        return self.camera

    def camera_infos(self) -> tuple[CameraInfo, CameraInfo]:
        """Of the colour and the depth imager, as images carry them.

        Raises:
            SpecError: the robot has no camera.
        """
        camera = self.require_camera()
        return camera.colour.info(self.T_base_camera), camera.depth.info(self.T_base_camera @ camera.T_colour_depth)

    @property
    def available(self) -> frozenset[str]:
        """Names of the sensors, as in `SensorFrame.available`."""
        sensors = {"odometry": self.drive, "scans": self.lidar, "imu": self.imu, "images": self.camera}
        return frozenset(name for name, spec in sensors.items() if spec is not None)
