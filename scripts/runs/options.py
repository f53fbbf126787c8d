"""What a run is made of."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg


@dataclass(frozen=True)
class RunOptions:
    """Drive a robot or replay a recording, estimate where it is and what is around it, and leave a folder with the answer.

    $ twin run --duration 20 --record                   the simulated robot in aruco_room, recorded
    $ twin run --world corridor --seed 7                another world, other noise
    $ twin run --robot replay:runs/aruco_room-lidar     the same run again, from its recording
    $ twin run --robot replay:exp1.dat                  a recording of a real robot

    Ctrl-C ends a run early and writes what there is until then; a second Ctrl-C leaves at once.
    """

    robot: Annotated[str, arg(metavar="BODY")] = "sim"
    """`sim`, the simulated robot; `kinematic`, the same without PyBullet, on wheels that never slip; `ev3`, the real robot, or the
    devices of `twin emulate`; or `replay:PATH` with a run
    folder, a rosbag2 (.mcap) of bricktwin, a CARMEN log or a CoreSLAM .dat."""
    world: Annotated[str, arg(metavar="NAME")] = "aruco_room"
    """World of the simulation: NAME, NAME:option=value,... or a .toml file; `twin worlds` lists them."""
    pipeline: Annotated[str, arg(metavar="NAME")] = "lidar"
    """Estimator: `lidar` matches every scan to the map, `odometry` goes by wheels and gyro only,
    `icp_odometry` lays each scan over the one before, the baseline; `lidar_slam` also closes loops,
    `rbpf` is a particle filter over maps; `visual_slam` goes by markers, feature points, wheels and gyro and needs --camera
    or a recording with images; `fusion` puts `lidar_slam` and `visual_slam` together.
    In a --map: `mcl` localises with particles, the baseline; `amcl` recovers, and is exact;
    `perfect_match` lays scans on wall segments; `localizability` leaves out the beams that people spoil."""
    params: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(default: those built in)")] = None
    """TOML file with parameters of the pipeline; config.toml of any run shows them all under [parameters] and can be given here.
    For `amcl` also the .yaml of a ROS node, with the parameters of nav2's amcl."""
    map: Annotated[Path | None, arg(metavar="PATH", help_behavior_hint="(default: none)")] = None
    """Map to localise in: the folder of a run, whose map.yaml is taken, or the .yaml of any map_server map."""
    marker_map: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(default: none, a new one)")] = None
    """Marker map to localise in with `visual_slam`, or in a --map with `amcl`: markers.yaml of the run that made it, or an ArUco
    MarkerMap."""
    camera_info: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(default: what comes with the images)")] = None
    """CameraInfo YAML whose K and distortion markers are measured with; `twin calibrate camera` writes one."""
    session: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="(default: none, a new map)")] = None
    """Folder of a session of `lidar_slam`: an earlier one is gone on with, and what the run has mapped is kept in it at the end.
    With `mapping = false` in --params the robot is only localised in it."""
    policy: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="(default: tour; none on a recording)")] = None
    """What drives: `tour` follows the route of the world; `explore` maps all that can be reached and comes home; `goal` drives to
    --goal; `wander` drives about at random; `spin` turns once round in the middle; `perimeter` keeps along the walls; `none` stands still.
    A recording cannot be driven."""
    goal: Annotated[tuple[float, float] | None, arg(metavar="X Y", help_behavior_hint="(default: none)")] = None
    """Place in the map to which `--policy goal` drives [m]; its origin is where the robot starts, unless --start or --map say else."""
    explorer: Literal["nearest", "utility", "gain"] = "nearest"
    """Which frontier `--policy explore` goes to next: the nearest, one with a long border nearby, or one that shows much."""
    start: Annotated[
        tuple[float, float, float] | None, arg(metavar="X Y YAW", help_behavior_hint="(default: the origin; in a --map: unknown)")
    ] = None
    """Pose in the map at which the robot starts: x, y [m], yaw [deg]. A localizer that is not told finds it."""
    duration: Annotated[float | None, arg(metavar="S", help_behavior_hint="(default: 60; the whole of a recording)")] = None
    """Length of the run [s], in the robot's time."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Seed of all noise in the simulation, 0 or above: the same seed gives the same run, bit for bit."""
    realism: Annotated[str, arg(metavar="NAME")] = "datasheet"
    """How imperfect the simulated robot is: `ideal` not at all, `datasheet` as its data sheets say, `harsh` twice as much; single
    numbers as in datasheet:lidar.range_sigma=0.02,commands.drop=0.1, see docs/realism.md."""
    rays: Literal["grid", "embree", "bullet"] = "grid"
    """Ray caster of the simulated lidar: grid is fast and needs no Embree, embree is its reference; bullet, of `sim` only, is slow."""
    camera: Annotated[str, arg(metavar="NAME|WHERE")] = "none"
    """What draws the images of the simulated RealSense D435: raster is fast, embree its slow reference, tiny and egl, of `sim` only,
    are PyBullet's own; none: it is off, which is faster: only `visual_slam` and `fusion` look at images. Of `ev3`: where the camera
    is, `usb`, `usb:SERIAL`, or `tcp:HOST[:PORT]` for the one of `twin emulate`."""
    ev3: Annotated[str, arg(metavar="WHERE")] = "usb"
    """Where the real robot's brick is: `usb`, `usb:SERIAL`, `tcp:HOST[:PORT]`, `wifi`, `wifi:SERIAL`, the path of a serial port, or with
    ev3dev on it `ev3dev:HOST[:PORT]`."""
    lidar: Annotated[str, arg(metavar="WHERE")] = "/dev/ttyACM0"
    """Where its lidar is: the path of a serial port, or `tcp:HOST[:PORT]`."""
    truth: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(default: none)")] = None
    """Trajectory (TUM) on this computer's clock that an `ev3` is scored with: `twin emulate --truth` writes one when it ends."""
    spec: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(default: the robot of docs/robot.md; what a recording says)")] = (
        None
    )
    """TOML file that describes the robot: of a recording, see docs/recordings.md, the real one, see docs/hardware.md, or what a twin is
    believed to be."""
    out: Annotated[Path | None, arg(metavar="FOLDER", help_behavior_hint="(default: runs/WORLD-PIPELINE, runs/RECORDING-PIPELINE)")] = None
    """Folder for the results, made if missing; results of an earlier run in it are replaced."""
    record: bool = False
    """Also write recording.mcap, a rosbag2 of everything the robot said."""
