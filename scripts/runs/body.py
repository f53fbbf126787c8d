"""The robot of a run, and the truth about it where there is one."""

from __future__ import annotations

import logging
import time
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from hardware.faulty_robot import FaultyRobot
from hardware.hal import Recorded, Robot
from hardware.registry import backend_class
from hardware.replay import ReplayRobot
from hardware.robot_file import read_robot_file
from scripts.errors import UsageError
from scripts.runs.options import RunOptions
from slam.grid import OccupancyGrid
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray
from slam.trajectory_file import read_trajectory
from worlds.errors import WorldError
from worlds.loader import load_world

_log = logging.getLogger(__name__)

TWINS = ("sim", "kinematic")
"""Bodies that know the truth about themselves."""
OF_THE_SIMULATION = ("world", "seed", "realism", "rays", "camera")
"""Options that a recording and the real robot do not have."""
OF_THE_HARDWARE = ("ev3", "lidar", "truth")
"""Options that only the real robot has."""
TRUTH_PATIENCE = 5
"""How often it is looked whether the told truth covers the run, once a second."""


@dataclass(frozen=True)
class Truth:
    """What is really so: known after the run, never to the pipeline."""

    trajectory: Trajectory
    """`T_world_base`."""
    walls: FloatArray | None
    """(M, 4) true walls at the lidar's height [m]."""
    grid: OccupancyGrid | None
    """The true map, from a twin."""
    collisions: int | None = None
    """How often a twin has begun to touch something."""


def recording_of(options: RunOptions) -> Path | None:
    """The recording that is replayed, if one is."""
    name, _, path = options.robot.partition(":")
    return Path(path) if name == "replay" else None


def make_robot(options: RunOptions) -> Robot:
    """The body that `--robot` names; nothing is opened yet.

    Raises:
        UsageError: options that this body does not have.
        HardwareError, WorldError, SimError: it cannot be built.
    """
    name, _, path = options.robot.partition(":")
    backend = backend_class(name)
    if name != "ev3":
        _refuse(options, OF_THE_HARDWARE, f"the real robot; --robot {name} has none, leave the option out")
    parameters = {"replay": _replay_parameters, "ev3": _hardware_parameters}.get(name, _twin_parameters)(options, name, path)
    return backend(**parameters).build()


def is_twin(options: RunOptions) -> bool:
    """Whether the body is simulated."""
    return options.robot in TWINS


def policy_name(options: RunOptions, robot: Robot) -> str:
    """The policy to run.

    Raises:
        UsageError: a policy that drives, on a recording.
    """
    recorded = isinstance(robot, Recorded)
    name = options.policy or ("tour" if is_twin(options) else "none")
    if recorded and name != "none":
        raise UsageError(f"a recording cannot be driven: --policy {name} needs a live robot; leave it out or use --policy none")
    return name


def route(options: RunOptions, T_map_base: SE2) -> FloatArray:
    """The world's waypoints (N, 2) [m], seen from a map in which the robot starts at `T_map_base`."""
    if recording_of(options) is not None:
        return np.empty((0, 2))
    world = load_world(options.world)
    return (T_map_base @ SE2(*world.start).inverse()).transform(np.array(world.tour, dtype=np.float64).reshape(-1, 2))


def live_truth(options: RunOptions, robot: Robot) -> Callable[[float], SE2] | None:
    """`T_world_base` at a time of the run, from a twin."""
    if not is_twin(options):
        return None
    from sim.ground_truth import ground_truth

    return ground_truth(_bare(robot)).pose


def known_truth(options: RunOptions, robot: Robot, stamps: FloatArray) -> Truth | None:
    """The truth at the stamps (N,) [s]: from the twin, or from a recording that holds it."""
    body = _bare(robot)
    if isinstance(body, ReplayRobot):
        trajectory, recording = body.log.truth(), recording_of(options)
        return None if trajectory is None or recording is None else Truth(trajectory, _walls_beside(recording, body), None)
    if options.truth is not None:
        return Truth(_told_truth(options.truth, stamps), _walls_around(options, body), None)
    if not is_twin(options):
        return None
    from sim.ground_truth import ground_truth

    truth = ground_truth(body)
    return Truth(truth.trajectory(stamps), truth.segments(), truth.grid(), truth.collisions)


def _bare(robot: Robot) -> Robot:
    """The body without its faults."""
    return robot.body if isinstance(robot, FaultyRobot) else robot


def _told_truth(path: Path, stamps: FloatArray) -> Trajectory:
    """What `twin emulate --truth` writes, once it covers the run; it lags a second behind.

    Raises:
        UsageError: it does not.
    """
    for _ in range(TRUTH_PATIENCE):
        told = read_trajectory(path)
        if len(told) and len(stamps) and told.stamps[0] <= stamps[0] and told.stamps[-1] >= stamps[-1]:
            inside = (told.stamps >= stamps[0] - 1.0) & (told.stamps <= stamps[-1] + 1.0)
            return Trajectory(told.stamps[inside], told.poses[inside])
        time.sleep(1.0)
    raise UsageError(f"--truth {path}: it does not cover the run; is it the file that a running `twin emulate --truth` writes?")


def _walls_around(options: RunOptions, robot: Robot) -> FloatArray | None:
    lidar = robot.spec.lidar
    return None if lidar is None else load_world(options.world).outlines(float(lidar.T_base_laser.t[2]))


def _refuse(options: RunOptions, names: tuple[str, ...], why: str) -> None:
    """No option of another kind of body.

    Raises:
        UsageError: there is one.
    """
    for option in fields(RunOptions):
        if option.name in names and getattr(options, option.name) != option.default:
            raise UsageError(f"--{option.name} belongs to {why}")


def _replay_parameters(options: RunOptions, name: str, path: str) -> dict[str, Any]:
    if not path:
        raise UsageError(f"--robot {name} needs a recording: --robot {name}:FOLDER-OR-FILE")
    _refuse(options, OF_THE_SIMULATION, "the simulation; a recording is what it is, leave the option out")
    return {"path": Path(path), "spec": options.spec}


def _hardware_parameters(options: RunOptions, name: str, path: str) -> dict[str, Any]:
    if path:
        raise UsageError(f"--robot {name} takes no '{path}'; write --ev3 {path} and --lidar for the lidar's port")
    _refuse(
        options, tuple(set(OF_THE_SIMULATION) - {"world", "camera"}), "the simulation; a real robot is what it is, leave the option out"
    )
    described = {} if options.spec is None else _described(options.spec)
    return {"ev3": options.ev3, "lidar": options.lidar, "camera": options.camera, **described}


def _described(path: Path) -> dict[str, Any]:
    robot = read_robot_file(path)
    return {"spec": robot.spec, "ports": robot.ports}


def _twin_parameters(options: RunOptions, name: str, path: str) -> dict[str, Any]:
    if path:
        raise UsageError(f"--robot {name} takes no '{path}'; a world is chosen by --world")
    load_world(options.world)
    described = {} if options.spec is None else {"spec": read_robot_file(options.spec).spec}
    return {option: getattr(options, option) for option in OF_THE_SIMULATION} | described


def _walls_beside(recording: Path, robot: Robot) -> FloatArray | None:
    """True walls of the world in which a recording was made, by the config.toml of its run."""
    config = (recording if recording.is_dir() else recording.parent) / "config.toml"
    if not config.is_file() or robot.spec.lidar is None:
        return None
    try:
        run = tomllib.loads(config.read_text(encoding="utf-8")).get("run", {})
        # a later run without --record leaves the recording alone and its own config beside it
        known = run.get("record") is True and run.get("robot") in TWINS
        return load_world(str(run["world"])).outlines(float(robot.spec.lidar.T_base_laser.t[2])) if known else None
    except (OSError, ValueError, KeyError, AttributeError, WorldError) as error:
        _log.warning("the true walls are not known, %s cannot be used: %s", config, error)
        return None
