"""The verb `twin doctor`: what of the real robot is there, how well it works, and what to fix."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from tyro.conf import arg

from hardware.bricks import make_brick
from hardware.drivers.hokuyo import HokuyoDriver
from hardware.drivers.orders import Orders
from hardware.errors import HardwareError
from hardware.queues import EventQueue
from hardware.robot_file import RobotFile, read_robot_file
from hardware.spec import DriveSpec, LidarSpec
from scripts.options import OptionalFile, parse
from slam.messages import Imu, LaserScan, Twist, WheelOdometry

HELP = "look for the real robot's devices, measure rates, clocks and battery, and say what to fix"
WATCHED = 2.0
"""How long each device is listened to [s]."""
WARNING_VOLTS = 7.1
"""The rechargeable pack is nearly empty below this [V]."""
TEST_SPEED = 0.05
"""[m/s]"""
SICK = 1


@dataclass(frozen=True)
class DoctorOptions:
    """Look for the devices of the real robot, one after the other, and say what is wrong and what helps. Nothing moves without --wheels.

    $ twin doctor                                                   brick on USB, lidar at /dev/ttyACM0
    $ twin doctor --ev3 tcp:127.0.0.1 --lidar tcp:127.0.0.1         the devices of `twin emulate`
    """

    ev3: Annotated[str, arg(metavar="WHERE")] = "usb"
    """Where the brick is, as in `twin run`."""
    lidar: Annotated[str, arg(metavar="WHERE")] = "/dev/ttyACM0"
    """Where the lidar is, as in `twin run`."""
    spec: OptionalFile = None
    """The robot's file, robot.toml, as in `twin run`."""
    wheels: bool = False
    """Drive 10 cm forward and turn to the left, to see that both wheels turn the right way. Put the robot on the floor first."""


def main(argv: list[str]) -> int:
    """Examine; returns 0 when everything works."""
    options = parse(DoctorOptions, argv, "doctor")
    _list_ports()
    well = [_examined("brick", lambda: _brick(options)), _examined("lidar", lambda: _lidar(options))]
    return 0 if all(well) else SICK


def _examined(name: str, examine: Callable[[], list[str]]) -> bool:
    try:
        lines = examine()
    except HardwareError as error:
        print(f"{name}: NOT THERE. {error}")
        return False
    for line in lines:
        print(f"{name}: {line}")
    return not any(line.startswith("FIX") for line in lines)


def _brick(options: DoctorOptions) -> list[str]:
    odometry, imu = EventQueue[WheelOdometry](), EventQueue[Imu]()
    robot = read_robot_file(options.spec) if options.spec is not None else RobotFile()
    driver = make_brick(options.ev3, robot.ports, robot.spec, EventQueue(), (odometry, imu))
    readings, rates, drive, ports = odometry.subscribe(), imu.subscribe(), robot.spec.drive or DriveSpec(), robot.ports
    driver.open()
    try:
        time.sleep(WATCHED)
        found, turning = readings.take(), rates.take()
        lines = [f"found at {options.ev3}, motors at {ports.left} and {ports.right}, gyro at {ports.gyro}"]
        lines += _rate([reading.stamp for reading in found], drive.period)
        lines.append(_battery(driver.state.volts))
        drift = float(np.degrees(np.mean([reading.yaw_rate for reading in turning]))) if turning else 0.0
        lines.append(_finding(abs(drift) < 1.0, f"the gyro shows {drift:+.2f} deg/s at rest", "unplug and plug it in, robot still"))
        if options.wheels:
            lines += _wheels(driver.orders, odometry, imu)
    finally:
        driver.close()
    return lines


def _wheels(orders: Orders, odometry: EventQueue[WheelOdometry], imu: EventQueue[Imu]) -> list[str]:
    """What encoders and gyro say of a way forward and a turn to the left."""
    start = odometry.latest
    _command(orders, Twist(TEST_SPEED, 0.0), 2.0)
    forward = odometry.latest
    turning = imu.subscribe()
    _command(orders, Twist(0.0, 0.5), 1.5)
    rate = float(np.mean([reading.yaw_rate for reading in turning.take()] or [0.0]))
    if start is None or forward is None:
        return ["FIX no encoder readings"]
    moved = (start.T_odom_base.inverse() @ forward.T_odom_base).x
    same = rate > 0.1
    return [
        _finding(moved > 0.05, f"the encoders say {moved:+.3f} m after 2 s forward", "check both motor cables"),
        _finding(
            same, f"the gyro says {np.degrees(rate):+.1f} deg/s in a turn to the left", "swap the motor cables, or mount the gyro arrow up"
        ),
    ]


def _command(orders: Orders, twist: Twist, seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        orders.give(twist, time.monotonic())
        time.sleep(0.05)
    orders.give(Twist(), time.monotonic())
    time.sleep(0.3)


def _lidar(options: DoctorOptions) -> list[str]:
    scans = EventQueue[LaserScan]()
    spec = (read_robot_file(options.spec).spec.lidar if options.spec is not None else None) or LidarSpec()
    driver, inbox = HokuyoDriver(options.lidar, spec, scans), scans.subscribe()
    driver.open()
    try:
        time.sleep(WATCHED)
        found, now = inbox.take(), time.monotonic()
    finally:
        driver.close()
    lines = [f"found at {options.lidar}, {spec.beams} beams", *_rate([scan.stamp for scan in found], spec.period)]
    if found:
        share = float(np.mean(np.isfinite(found[-1].ranges)))
        lines.append(_finding(share > 0.3, f"{share:.0%} of the beams have a range", "clean the window, or it stands in the open"))
        lines.append(f"the last scan was {now - found[-1].stamp:.3f} s old when it was looked at")
    return lines


def _rate(stamps: list[float], period: float) -> list[str]:
    if len(stamps) < 3:
        return ["FIX there are no readings: unplug it and plug it in again"]
    gaps = np.diff(stamps)
    median, worst = float(np.median(gaps)), float(gaps.max())
    good = median < 1.5 * period
    return [_finding(good, f"{1.0 / median:.1f} readings a second, longest gap {worst * 1e3:.0f} ms", "use USB, close other programs")]


def _battery(volts: float | None) -> str:
    if volts is None:
        return "FIX the battery does not say its voltage: restart the brick"
    return _finding(volts > WARNING_VOLTS, f"battery at {volts:.2f} V", "charge it")


def _finding(good: bool, what: str, remedy: str) -> str:
    """A line, with what to do when it is not good."""
    return what if good else f"FIX {what}: {remedy}"


def _list_ports() -> None:
    """Serial ports that are there."""
    found = sorted(str(path) for pattern in ("ttyACM*", "ttyUSB*", "rfcomm*", "hokuyo*") for path in Path("/dev").glob(pattern))
    print(f"serial ports: {', '.join(found) or 'none'}")
