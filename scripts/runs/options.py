"""What a run is made of."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class RunOptions:
    """Drive a robot, estimate where it is and what is around it, and leave a folder with the answer."""

    robot: str = "sim"
    """The body: `sim`, or `replay:PATH` with a run folder, a rosbag2 (.mcap), a CARMEN log or a CoreSLAM .dat."""
    world: str = "aruco_room"
    """World of the simulation: NAME, NAME:option=value,... or a .toml file; `twin worlds` lists them."""
    pipeline: str = "lidar"
    """Estimator: `lidar` (match every scan to the map) or `odometry` (wheels and gyro only)."""
    params: Path | None = None
    """TOML file with parameters of the pipeline; config.toml of a run shows them all under [parameters]."""
    policy: str | None = None
    """What drives: `tour` (the world's route, the default in simulation) or `none` (the default on a recording)."""
    start: tuple[float, float, float] | None = None
    """Pose in the map at which the robot starts: x, y [m], yaw [deg]. The map's origin when not given."""
    duration: float | None = None
    """Length of the run [s]; 60 in simulation, the whole of a recording."""
    seed: int = 0
    """Seed of all noise in the simulation."""
    realism: Literal["ideal", "datasheet"] = "datasheet"
    """How imperfect the simulated robot is."""
    rays: Literal["embree", "bullet"] = "embree"
    """Ray caster of the simulated lidar."""
    spec: Path | None = None
    """TOML file that describes the robot of a recording that does not."""
    out: Path | None = None
    """Folder for the results; runs/ROBOT-PIPELINE when not given."""
    record: bool = False
    """Also write recording.mcap, a rosbag2 of everything the robot said."""
