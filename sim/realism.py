"""How far the twin's body and devices are from what their specification says: every number of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace

from hardware.errors import SpecError
from hardware.spec import RobotSpec
from sim import camera_errors, drive_errors, gyro_errors, lidar_errors
from sim.camera_errors import CameraErrors
from sim.channels import ChannelErrors
from sim.drive_errors import DriveErrors
from sim.errors import RealismError
from sim.gyro_errors import GyroErrors
from sim.lidar_errors import LidarErrors

Errors = LidarErrors | DriveErrors | GyroErrors | CameraErrors | ChannelErrors


@dataclass(frozen=True, slots=True)
class Realism:
    """All errors; the defaults are none."""

    lidar: LidarErrors = field(default_factory=LidarErrors)
    drive: DriveErrors = field(default_factory=DriveErrors)
    gyro: GyroErrors = field(default_factory=GyroErrors)
    camera: CameraErrors = field(default_factory=CameraErrors)
    odometry: ChannelErrors = field(default_factory=ChannelErrors)
    imu: ChannelErrors = field(default_factory=ChannelErrors)
    scans: ChannelErrors = field(default_factory=ChannelErrors)
    images: ChannelErrors = field(default_factory=ChannelErrors)
    commands: ChannelErrors = field(default_factory=ChannelErrors)

    def true_spec(self, spec: RobotSpec) -> RobotSpec:
        """The body as it really is.

        Raises:
            SpecError: the robot has no drive.
        """
        if spec.drive is None:
            raise SpecError("the twin drives on wheels; give the spec a `drive`")
        left, right = spec.drive.wheel_radii
        radii = left * (1.0 + self.drive.radius_left), right * (1.0 + self.drive.radius_right)
        return replace(spec, drive=replace(spec.drive, wheel_radii=radii, track=spec.drive.track * (1.0 + self.drive.track)))


def read_realism(text: str) -> Realism:
    """The realism of `NAME` or `NAME:GROUP.FIELD=VALUE,...`, such as `datasheet:lidar.range_sigma=0.02,commands.drop=0.1`.

    Raises:
        RealismError: a name or a number that does not exist or cannot be read.
    """
    name, _, changes = text.partition(":")
    if name not in REALISMS:
        raise RealismError(f"no realism '{name}'; available: {', '.join(REALISMS)}")
    realism = REALISMS[name]
    for change in filter(None, changes.split(",")):
        realism = _changed(realism, change)
    return realism


def _changed(realism: Realism, change: str) -> Realism:
    path, _, value = change.partition("=")
    group, _, name = path.strip().partition(".")
    errors: Errors = getattr(realism, _known(group, realism, "group of errors"))
    number = _number(value, _known(name, errors, f"number '{group}.'"))
    return replace(realism, **{group: replace(errors, **{name: number})})


def _known(name: str, errors: Realism | Errors, what: str) -> str:
    names = [field.name for field in fields(errors)]
    if name not in names:
        raise RealismError(f"no {what} '{name}'; available: {', '.join(names)}")
    return name


def _number(text: str, name: str) -> float:
    try:
        number = float(text)
    except ValueError as error:
        raise RealismError(f"{name} must be a number, got '{text}'") from error
    if math.isnan(number):
        raise RealismError(f"{name} must be a number, got '{text}'")
    if name in DIVISORS and number <= 0.0:
        raise RealismError(f"{name} must be above 0, got {text}")
    if name in SHARES and not 0.0 <= number <= 1.0:
        raise RealismError(f"{name} is a share, it must be between 0 and 1, got {text}")
    return number


DIVISORS = frozenset({"cyclic_length", "warm_up_time", "ramp", "resistance", "rotor_inertia", "battery_capacity"})
"""Numbers that must be above 0."""
SHARES = frozenset(
    {"edge_reject", "dropout", "glare_blinds", "gloss_silent", "pane_seen", "pane_seen_aslant", "battery_charge", "tail_share", "drop"}
    | {"occlusion", "lost_matte", "lost_dark", "lost_glossy", "lost_glass"}
)
"""Numbers that are shares of a whole."""

LATE = ChannelErrors(latency=0.004, jitter=0.001, tail_share=0.02, tail=0.005)
"""Half of 8.4 ms, the median of a USB round trip to the brick."""
LATER = ChannelErrors(latency=0.010, jitter=0.004, tail_share=0.05, tail=0.010, drop=0.01)

REALISMS: dict[str, Realism] = {
    "ideal": Realism(),
    "datasheet": Realism(
        lidar_errors.DATASHEET,
        drive_errors.DATASHEET,
        gyro_errors.DATASHEET,
        camera_errors.DATASHEET,
        odometry=LATE,
        imu=LATE,
        scans=ChannelErrors(jitter=0.001),
        images=ChannelErrors(latency=0.020, jitter=0.002),
        commands=ChannelErrors(latency=0.040, jitter=0.015, tail_share=0.05, tail=0.050),
    ),
    "harsh": Realism(
        lidar_errors.HARSH,
        drive_errors.HARSH,
        gyro_errors.HARSH,
        camera_errors.HARSH,
        odometry=LATER,
        imu=LATER,
        scans=ChannelErrors(0.010, 0.004, 0.05, 0.020, 0.02),
        images=ChannelErrors(0.050, 0.010, 0.05, 0.050, 0.02),
        commands=ChannelErrors(0.080, 0.030, 0.10, 0.100, 0.02),
    ),
}
"""name -> errors. `datasheet` is the default robot."""
