"""The robot of a run, and the truth about it where there is one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomllib

from hardware.errors import RecordingError
from hardware.hal import Recorded, Robot
from hardware.logs.registry import open_log
from hardware.registry import backend_class
from scripts.errors import UsageError
from scripts.runs.options import RunOptions
from slam.grid import OccupancyGrid
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray
from worlds.loader import load_world


@dataclass(frozen=True)
class Truth:
    """What is really so: known after the run, never to the pipeline."""

    trajectory: Trajectory
    """`T_world_base`."""
    walls: FloatArray | None
    """(M, 4) true walls at the lidar's height [m]."""
    grid: OccupancyGrid | None
    """The true map, from a twin."""


def make_robot(options: RunOptions) -> Robot:
    """The body that `--robot` names; nothing is opened yet.

    Raises:
        UsageError: options that this body does not have.
        HardwareError, WorldError, SimError: it cannot be built.
    """
    name, _, path = options.robot.partition(":")
    backend = backend_class(name)
    if name == "replay":
        if not path:
            raise UsageError("--robot replay needs a recording: --robot replay:FOLDER-OR-FILE")
        return backend(path=Path(path), spec=options.spec).build()  # pyright: ignore[reportCallIssue]
    if path:
        raise UsageError(f"--robot {name} takes no '{path}'; a world is chosen by --world")
    if options.spec is not None:
        raise UsageError(f"--spec describes the robot of a recording; --robot {name} has its own")
    load_world(options.world)
    parameters = {"world": options.world, "seed": options.seed, "realism": options.realism, "rays": options.rays}
    return backend(**parameters).build()  # pyright: ignore[reportCallIssue]


def policy_name(options: RunOptions, robot: Robot) -> str:
    """The policy to run.

    Raises:
        UsageError: a policy that drives, on a recording.
    """
    recorded = isinstance(robot, Recorded)
    name = options.policy or ("none" if recorded else "tour")
    if recorded and name != "none":
        raise UsageError(f"a recording cannot be driven: --policy {name} needs a live robot; leave it out or use --policy none")
    return name


def route(options: RunOptions, T_map_base: SE2) -> FloatArray:
    """The world's waypoints (N, 2) [m], seen from a map in which the robot starts at `T_map_base`."""
    if options.robot != "sim":
        return np.empty((0, 2))
    world = load_world(options.world)
    return (T_map_base @ SE2(*world.start).inverse()).transform(np.array(world.tour, dtype=np.float64).reshape(-1, 2))


def known_truth(options: RunOptions, robot: Robot, stamps: FloatArray) -> Truth | None:
    """The truth at the stamps (N,) [s]: from the twin, or from a recording that holds it."""
    name, _, path = options.robot.partition(":")
    if name == "sim":
        from sim.ground_truth import ground_truth

        truth = ground_truth(robot)
        return Truth(truth.trajectory(stamps), truth.segments(), truth.grid())
    trajectory = open_log(Path(path)).truth() if name == "replay" and options.spec is None else None
    return None if trajectory is None else Truth(trajectory, _walls_beside(Path(path), robot), None)


def _walls_beside(recording: Path, robot: Robot) -> FloatArray | None:
    """True walls of the world that the recording's folder names in its config.toml."""
    config = (recording if recording.is_dir() else recording.parent) / "config.toml"
    if not config.is_file() or robot.spec.lidar is None:
        return None
    try:
        run = tomllib.loads(config.read_text(encoding="utf-8")).get("run", {})
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RecordingError(config, f"is not TOML: {error}") from error
    return load_world(run["world"]).outlines(float(robot.spec.lidar.T_base_laser.t[2])) if "world" in run else None
