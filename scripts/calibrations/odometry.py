"""`twin calibrate odometry`: wheel radii and track from a drive, or from the recording of one."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from tyro.conf import arg

from hardware.hal import Recorded, Robot
from hardware.robot_file import update_robot_file
from hardware.spec import DriveSpec, LidarSpec
from scripts.calibrations.square import SquareDrive
from scripts.errors import UsageError
from scripts.options import OptionalFile, parse
from scripts.runs.body import is_twin, make_robot, route
from scripts.runs.interruption import interruptible
from scripts.runs.loop import PERIOD
from scripts.runs.options import RunOptions
from slam.mapping.lidar_slam import LidarSlam
from slam.messages import SensorFrame, Trajectory
from slam.motion.wheel_calibration import WheelCalibration, calibrate_wheels
from slam.navigation.costmap import Inflation
from slam.navigation.policies import Policy, make_policy
from slam.pipelines import Finishing, warm_up
from slam.se2 import SE2

MM = 1e3


@dataclass(frozen=True)
class OdometryOptions:
    """Drive about, or take a recording of a drive, and fit wheel radii, track and the lidar's mount to what the lidar has seen of it.

    $ twin calibrate odometry --robot replay:runs/tour               from what `twin run --record` has left
    $ twin calibrate odometry --robot ev3 --square 1                 on the floor: a square to the left, then to the right
    $ twin run --robot ev3 --spec robot.toml                         with what was found

    The way needs straight parts and turns to both sides, room around the robot and walls that the lidar sees; 90 s are enough.
    """

    robot: Annotated[str, arg(metavar="BODY")] = "sim"
    """As in `twin run`: `ev3`, `replay:PATH`, or a twin, whose errors are then known."""
    world: Annotated[str, arg(metavar="NAME")] = "aruco_room"
    """World of a twin, whose tour is driven."""
    square: Annotated[float | None, arg(metavar="M", help_behavior_hint="(default: the tour of the world)")] = None
    """Side of the square that is driven to the left, then to the right, and so on [m]; the robot looks round first and chooses where it
    lies."""
    duration: Annotated[float, arg(metavar="S")] = 90.0
    """Of the drive [s]."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Of a twin's noise."""
    realism: Annotated[str, arg(metavar="NAME")] = "datasheet"
    """Of a twin."""
    ev3: Annotated[str, arg(metavar="WHERE")] = "usb"
    """Where the brick is, as in `twin run`."""
    lidar: Annotated[str, arg(metavar="WHERE")] = "/dev/ttyACM0"
    """Where the lidar is, as in `twin run`."""
    spec: OptionalFile = None
    """What is known of the robot so far, a robot.toml; of a recording, what it says itself."""
    out: Annotated[Path, arg(metavar="FILE")] = Path("robot.toml")
    """File to write radii and track into; everything else in it stays."""
    mount: bool = False
    """Also write where the lidar is and looks: its x, y and yaw."""


def main(argv: list[str]) -> int:
    """Calibrate; returns the exit code."""
    options = parse(OdometryOptions, argv, "calibrate odometry")
    if options.square is not None and not 0.3 <= options.square <= 20.0:
        raise UsageError(f"--square {options.square:g}: give a side between 0.3 and 20 m")
    if not (math.isfinite(options.duration) and options.duration > 0.0):
        raise UsageError(f"--duration {options.duration:g}: give a positive number of seconds")
    robot = make_robot(_run_options(options))
    drive, lidar = robot.spec.drive, robot.spec.lidar
    if drive is None or lidar is None:
        raise UsageError(f"--robot {options.robot}: it needs wheels and a lidar")
    found = calibrate(_driven(robot, options), drive, lidar)
    _tell(found, drive, lidar)
    update_robot_file(options.out, _changes(found, lidar, options.mount))
    print(f"\n{options.out}")
    return 0


def calibrate(frames: list[SensorFrame], drive: DriveSpec, lidar: LidarSpec) -> WheelCalibration:
    """What fits the frames of a drive, whose map is made from scratch.

    Raises:
        CalibrationError: the drive does not say enough.
    """
    pipeline = LidarSlam().build(None)
    for frame in frames:
        pipeline.update(frame)
    if isinstance(pipeline, Finishing):
        pipeline.finish()
    T_base_laser, path = lidar.T_base_laser.to_se2(), pipeline.snapshot().trajectory
    poses = np.array([(SE2.from_array(pose) @ T_base_laser).as_array() for pose in path.poses]).reshape(-1, 3)
    readings = [reading for frame in frames for reading in frame.odometry if reading.wheel_angles is not None]
    stamps = np.array([reading.stamp for reading in readings])
    angles = np.array([reading.wheel_angles for reading in readings], dtype=np.float64).reshape(-1, 2)
    if not len(stamps):
        raise UsageError("the robot does not tell the angles of its wheels; they cannot be calibrated")
    return calibrate_wheels(stamps, angles, Trajectory(path.stamps, poses), (drive.wheel_radii, drive.track, T_base_laser))


def _run_options(options: OdometryOptions) -> RunOptions:
    shared = {"robot": options.robot, "spec": options.spec}
    if options.robot == "ev3":
        return RunOptions(**shared, ev3=options.ev3, lidar=options.lidar)
    if is_twin(RunOptions(robot=options.robot)):
        return RunOptions(**shared, world=options.world, seed=options.seed, realism=options.realism)
    return RunOptions(**shared)


def _driven(robot: Robot, options: OdometryOptions) -> list[SensorFrame]:
    """Everything that the robot says on its way, without its images."""
    pipeline, frames = LidarSlam().build(None), list[SensorFrame]()
    policy = _policy(robot, options)
    warm_up(LidarSlam().build(None))
    with robot, interruptible() as stopped:
        t = start = robot.clock.now()
        while not stopped() and robot.clock.now() < start + options.duration and robot.clock.sleep_until(t):
            frames.append(replace(robot.read(), images=()))
            if not isinstance(robot, Recorded):
                command = policy(frames[-1], pipeline.update(frames[-1]), pipeline.snapshot())
                robot.drive(command) if command is not None else None
            t = max(t + PERIOD, robot.clock.now())
    return frames


def _policy(robot: Robot, options: OdometryOptions) -> Policy:
    """What drives, in the map that begins where the robot stands."""
    if isinstance(robot, Recorded):
        return make_policy("none", np.empty((0, 2)))
    if options.square is not None:
        return SquareDrive(options.square, Inflation(radius=robot.spec.radius))
    return make_policy("tour", route(RunOptions(robot=options.robot, world=options.world), SE2()))


def _tell(found: WheelCalibration, drive: DriveSpec, lidar: LidarSpec) -> None:
    T, before = found.T_base_laser, lidar.T_base_laser.to_se2()
    names = ("left wheel, radius", "right wheel, radius", "track", "lidar, x", "lidar, y")
    values, old = (*found.wheel_radii, found.track, T.x, T.y), (*drive.wheel_radii, drive.track, before.x, before.y)
    print(f"from {found.windows} stretches of the drive:")
    for name, value, was, deviation in zip(names, values, old, found.deviations.tolist(), strict=False):
        change = f"{100.0 * (value / was - 1.0):+.2f} %" if name not in names[3:] else f"{MM * (value - was):+.1f} mm"
        print(f"  {name:20} {MM * value:8.3f} mm ± {MM * deviation:.3f}   {change} from {MM * was:.3f}")
    yaw_deg, was_deg, deviation_deg = np.degrees([T.yaw, before.yaw, found.deviations[5]]).tolist()
    print(f"  {'lidar, yaw':20} {yaw_deg:8.3f} deg ± {deviation_deg:.3f}   from {was_deg:.3f}")


def _changes(found: WheelCalibration, lidar: LidarSpec, mount: bool) -> dict[str, object]:
    drive = {"wheel_radii": [round(radius, 7) for radius in found.wheel_radii], "track": round(found.track, 6)}
    if not mount:
        return {"drive": drive}
    T = lidar.T_base_laser
    turned = SE2(yaw=found.T_base_laser.yaw - T.to_se2().yaw)
    R = np.eye(3)
    R[:2, :2] = turned.rotation()
    t = [round(found.T_base_laser.x, 5), round(found.T_base_laser.y, 5), float(T.t[2])]
    return {"drive": drive, "lidar": {"T_base_laser": {"R": (R @ T.R).round(9).tolist(), "t": t}}}
