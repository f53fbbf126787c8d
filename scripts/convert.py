"""The verb `twin convert`: a recording of any format as a rosbag2, a rosbag1 or a CARMEN log."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from rosbags.convert import ConverterError
from rosbags.convert import convert as convert_bag
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from tyro.conf import Positional, arg

from hardware.errors import RecordingError
from hardware.logs.carmen_writing import carmen_lines
from hardware.logs.log import Log
from hardware.logs.registry import open_log
from hardware.logs.spec_file import read_spec
from hardware.recorder import Recorder
from hardware.replay import ReplayRobot
from hardware.urdf import urdf
from scripts.errors import UsageError
from scripts.options import OptionalFile, parse
from scripts.runs.files import write_text, write_via

HELP = "make a rosbag2, a rosbag1 (.bag) or a CARMEN log (.log) of a recording of any format"

CARMEN = (".log", ".clf", ".carmen")
PERIOD = 0.1
"""Steps through the recording [s]."""


@dataclass(frozen=True)
class ConvertOptions:
    """Read a recording and write it in another format, whose name says which it is to be.

    $ twin convert intel.log intel              a CARMEN log as a rosbag2 folder, for ROS 2, Foxglove and twin
    $ twin convert runs/demo demo.bag           a run as a rosbag1
    $ twin convert field.bag field.log          anybody's rosbag as a CARMEN log
    """

    source: Annotated[Positional[Path], arg(metavar="A")]
    """A run folder, any rosbag1 or rosbag2 with laser scans, a CARMEN log or a CoreSLAM .dat."""
    target: Annotated[Positional[Path], arg(metavar="B")]
    """NAME.bag: rosbag1; NAME.log, .clf or .carmen: CARMEN; without a suffix: a rosbag2 folder (MCAP)."""
    spec: OptionalFile = None
    """TOML file that describes the robot of the recording."""


def main(argv: list[str]) -> int:
    """Convert; returns the exit code.

    Raises:
        UsageError: a target of an unknown kind, or one that is there already.
        HardwareError: the recording cannot be read, or not be written so.
        OutputError: the target cannot be written.
    """
    options = parse(ConvertOptions, argv, "convert")
    kind, target = options.target.suffix, options.target
    if kind not in ("", ".bag", *CARMEN):
        raise UsageError(f"cannot write '{kind}' recordings: name B without a suffix for a rosbag2, or with .bag or .log")
    if target.exists():
        raise UsageError(f"{target} is there already; name another target or remove it")
    log = open_log(options.source, None if options.spec is None else read_spec(options.spec))
    if kind in CARMEN:
        write_text(target, "\n".join(carmen_lines(log)) + "\n")
    elif kind == ".bag":
        write_via(target, lambda partial: write_rosbag1(log, partial))
    else:
        write_rosbag2(log, target)
    print(f"wrote {target}")
    return 0


def write_rosbag2(log: Log, folder: Path) -> None:
    """Play the recording once into a recorder of its own.

    Raises:
        HardwareError: it cannot be read on, or not be written.
    """
    robot, truth = ReplayRobot(log), log.truth()
    with robot, Recorder(robot, folder, log.description() or (urdf(robot.spec) if robot.spec.drive else "")) as recorder:
        for stamp, pose in [] if truth is None else zip(truth.stamps.tolist(), np.asarray(truth.poses).tolist(), strict=True):
            recorder.add_truth(stamp, *pose)
        while robot.clock.sleep_until(robot.clock.now() + PERIOD):
            recorder.flush()


def write_rosbag1(log: Log, path: Path) -> None:
    """The same as a rosbag1: a rosbag2 first, converted by `rosbags`.

    Raises:
        RecordingError: it cannot be written.
    """
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    with tempfile.TemporaryDirectory() as folder:
        write_rosbag2(log, Path(folder) / "bag")
        bag = Path(folder) / "bag.bag"
        try:
            convert_bag([Path(folder) / "bag"], bag, "", 0, None, "", None, store, [], [], [], [])
        except ConverterError as error:
            raise RecordingError(path, f"cannot be written as a rosbag1: {error}") from error
        path.write_bytes(bag.read_bytes())
