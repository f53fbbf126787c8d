"""The sensor vocabulary: what a robot reports and what an estimator answers. Frozen, SI, framed, arrays read-only."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slam.se2 import SE2, FloatArray
from slam.se3 import SE3


def read_only(values: ArrayLike) -> FloatArray:
    """Copy to a float64 array that cannot be written."""
    frozen = np.array(values, dtype=np.float64)
    frozen.setflags(write=False)
    return frozen


@dataclass(frozen=True, slots=True)
class Twist:
    """Planar velocity of `base`, in `base`: forward speed [m/s], yaw rate [rad/s]."""

    v: float = 0.0
    omega: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class LaserScan:
    """One sweep of a lidar. Beam i was measured at `stamp + i * time_increment`; the index grows with the angle.

    After REP 117: +inf is "nothing within range", -inf "nearer than range_min", nan "invalid".
    """

    stamp: float
    """Time of the first delivered beam [s]."""
    ranges: FloatArray
    """(N,) [m]"""
    angles: FloatArray
    """(N,) direction of each beam in `laser`, counter-clockwise [rad]."""
    time_increment: float
    """Time from beam to beam [s]; 0 for a snapshot."""
    range_min: float
    range_max: float
    T_base_laser: SE3 = field(default_factory=SE3)

    def __post_init__(self) -> None:
        object.__setattr__(self, "ranges", read_only(self.ranges))
        object.__setattr__(self, "angles", read_only(self.angles))

    @property
    def end(self) -> float:
        """Time of the last beam [s]."""
        return self.stamp + self.time_increment * max(len(self.ranges) - 1, 0)


@dataclass(frozen=True, slots=True)
class WheelOdometry:
    """One encoder reading, integrated. `T_odom_base` is continuous and cumulative (REP 105)."""

    stamp: float
    T_odom_base: SE2
    twist: Twist = Twist()
    wheel_angles: tuple[float, float] | None = None
    """Cumulative (left, right) wheel angles [rad], where the body has encoders."""


@dataclass(frozen=True, slots=True)
class Imu:
    """One gyro reading."""

    stamp: float
    yaw_rate: float
    """About the z axis of `base`, counter-clockwise [rad/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraInfo:
    """One imager, its lens and its place. The centre of pixel (column i, row j) is at (i, j)."""

    width: int
    height: int
    K: FloatArray
    """(3, 3) pinhole matrix [px]."""
    D: FloatArray
    """(5,) Brown-Conrady distortion k1 k2 p1 p2 k3, in OpenCV's order."""
    row_time: float = 0.0
    """Time from row to row [s]; 0 for a global shutter."""
    T_base_camera: SE3 = field(default_factory=SE3)
    """Optical frame: z forward, x right, y down."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", read_only(self.K))
        object.__setattr__(self, "D", read_only(self.D))


@dataclass(frozen=True, slots=True, eq=False)
class RgbdImage:
    """A colour and a depth image of one moment, each as its own imager sees it. `slam.depth_images` lays one over the other.

    Row j of the colour image was exposed about `stamp + (j - (height - 1) / 2) * row_time`; the depth image, all of it, at `stamp`.
    """

    stamp: float
    """Middle of the exposure of the colour image's middle row [s]."""
    colour: NDArray[np.uint8]
    """(H, W, 3) red, green, blue."""
    depth: NDArray[np.float32]
    """(H, W) along the optical axis of the depth camera [m]; nan where nothing was measured."""
    colour_info: CameraInfo
    depth_info: CameraInfo

    def __post_init__(self) -> None:
        for name, kind in (("colour", np.uint8), ("depth", np.float32)):
            frozen = np.array(getattr(self, name), dtype=kind)
            frozen.setflags(write=False)
            object.__setattr__(self, name, frozen)

    @property
    def end(self) -> float:
        """Time of the colour image's last row [s]."""
        return self.stamp + 0.5 * (self.colour_info.height - 1) * self.colour_info.row_time


@dataclass(frozen=True, slots=True)
class SensorFrame:
    """Everything that arrived since the last read, oldest first in each field."""

    stamp: float
    """The robot's clock at the read [s]."""
    odometry: tuple[WheelOdometry, ...] = ()
    imu: tuple[Imu, ...] = ()
    scans: tuple[LaserScan, ...] = ()
    available: frozenset[str] = frozenset()
    """Names of the sensors that this body has: `odometry`, `imu`, `scans`, `images`."""
    images: tuple[RgbdImage, ...] = ()


class Status(StrEnum):
    """How far an estimate can be trusted."""

    TRACKING = "tracking"
    DEGRADED = "degraded"
    LOST = "lost"
    AMBIGUOUS = "ambiguous"


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """The answer to one frame. `T_map_base = T_map_odom @ T_odom_base(stamp)`."""

    stamp: float
    T_map_base: SE2
    T_map_odom: SE2
    covariance: FloatArray
    """(3, 3) of (x, y, yaw) of `T_map_base`, in the map frame [m, rad]."""
    status: Status = Status.TRACKING
    health: float = 1.0
    """0..1: is the pose supported by what is seen?"""
    reason: str = ""
    """Why the status is not `tracking`: the sensor that is silent, the axis that is weak."""
    sources: tuple[str, ...] = ()
    """What the pose goes by at this moment, where the pipeline has a choice: `markers`, `visual odometry`, `wheels`, `gyro`, `lidar`."""
    T_map_camera: SE3 | None = None
    """Pose of the colour camera in space, from pipelines that locate it."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", read_only(self.covariance))


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Stamped planar poses of one body in one frame."""

    stamps: FloatArray
    """(N,) [s], increasing."""
    poses: FloatArray
    """(N, 3) of x, y [m], yaw [rad]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "stamps", read_only(self.stamps).reshape(-1))
        object.__setattr__(self, "poses", read_only(self.poses).reshape(-1, 3))

    def __len__(self) -> int:
        return len(self.stamps)
