"""The verb `twin icp`: how ICP lays one scan over another, step by step.

Without a recording it repeats the check of the source report: the points of a scan, moved by (1 m, 2 m, 30 deg), are
brought back without a guess. With `--log PATH --scans TARGET SOURCE` it registers two scans of a recording.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from scripts.errors import UsageError
from scripts.icp_animation import write_icp_gif, write_icp_png
from scripts.options import parse
from scripts.scan_pairs import ScanPair, displaced_room, recorded_pair
from slam.matching.icp import Icp, IcpStep
from slam.matching.match import Match
from slam.se2 import SE2

HELP = "lay one scan over another by ICP, step by step: the source report's check or two scans of a recording, with GIF"

MOST_ROWS = 12
CHECK_TOLERANCE = 1e-6
"""[m] and [rad]"""
DEFAULT = Icp()


@dataclass(frozen=True)
class IcpOptions:
    """Lay one scan over another by ICP and show every step.

    Without --log: the check of the source report, a scan moved by (1 m, 2 m, 30 deg) and brought back without a guess;
    exits with 1 unless the answer is right to 1e-6 m and rad. With --log: two scans of a recording, from what the wheels say.
    """

    log: Path | None = None
    """Recording to take two scans from: a run folder, a rosbag2 (.mcap), a CARMEN log or a CoreSLAM .dat."""
    scans: tuple[int, int] = (0, 3)
    """With --log: number of the target scan, and of the source scan that is laid over it; the first is 0."""
    guess: Literal["wheels", "none"] = "wheels"
    """With --log: start from the wheels' motion between the scans, or from no motion as the source report does."""
    gif: Path | None = None
    """Animation of the steps to write."""
    png: Path | None = None
    """Picture of the start and the end to write."""
    iterations: int = DEFAULT.iterations
    """Most steps."""
    trim: float | None = None
    """Share of the correspondences that is kept, nearest first; 1 for the check, where all overlaps, 0.9 for recordings."""
    one_to_one: bool = DEFAULT.one_to_one
    """A target point is the counterpart of one source point only, the nearest."""
    max_distance: float = DEFAULT.max_distance
    """Longest correspondence [m]."""


def main(argv: list[str]) -> int:
    """Register, print, draw; returns the exit code.

    Raises:
        UsageError, RecordingError, OutputError: wrong options, a recording that cannot be used, an output that cannot be written.
    """
    options = parse(IcpOptions, argv, "icp")
    matcher = _matcher(options)
    pair = displaced_room() if options.log is None else recorded_pair(options.log, *options.scans)
    guess = pair.wheels if pair.wheels is not None and options.guess == "wheels" else SE2()
    steps = list(matcher.steps(pair.source, pair.target, guess))
    match = matcher.match(pair.source, pair.target, guess)
    Console().print(_table(pair.title, steps))
    print("\n".join(_answer(pair, match)))
    for path, write in ((options.gif, write_icp_gif), (options.png, write_icp_png)):
        if path is not None:
            write(path, pair, steps)
            print(f"wrote {path}")
    return 0 if options.log is not None or _passes(pair, match) else 1


def _matcher(options: IcpOptions) -> Icp:
    trim = options.trim if options.trim is not None else (1.0 if options.log is None else DEFAULT.trim)
    if not 0.0 < trim <= 1.0:
        raise UsageError(f"--trim {trim:g}: must be above 0 and at most 1")
    if options.iterations < 1:
        raise UsageError(f"--iterations {options.iterations}: must be at least 1")
    if not options.max_distance > 0.0:
        raise UsageError(f"--max-distance {options.max_distance:g}: must be above 0")
    return Icp(iterations=options.iterations, trim=trim, one_to_one=options.one_to_one, max_distance=options.max_distance)


def _table(title: str, steps: Sequence[IcpStep]) -> Table:
    table = Table(title=escape(f"ICP: {title}"), title_justify="left")
    for heading in ("step", "pairs", "rms [mm]", "x [m]", "y [m]", "yaw [deg]"):
        table.add_column(escape(heading), justify="right")
    for number in np.unique(np.linspace(0, len(steps) - 1, MOST_ROWS).round().astype(int)).tolist():
        step = steps[number]
        table.add_row(str(number), str(len(step.p)), f"{1000.0 * step.rms:.3f}", *_numbers(step.T_target_source))
    return table


def _answer(pair: ScanPair, match: Match) -> list[str]:
    """The result beside what else is known of the motion."""
    lines = [_line("ICP", match.T_target_source) + f"  {'converged' if match.converged else 'not converged'}, {match.iterations} steps"]
    for name, pose in (("truth", pair.truth), ("wheels", pair.wheels)):
        if pose is not None:
            error = pose.inverse() @ match.T_target_source
            apart = f"  ICP is {1000.0 * math.hypot(error.x, error.y):.3g} mm, {math.degrees(abs(error.yaw)):.3g} deg away"
            lines.append(_line(name, pose) + apart)
    return lines


def _line(name: str, pose: SE2) -> str:
    x, y, yaw = _numbers(pose)
    return f"{name:7}x {x} m  y {y} m  yaw {yaw} deg"


def _numbers(pose: SE2) -> tuple[str, str, str]:
    return f"{pose.x:.6f}", f"{pose.y:.6f}", f"{math.degrees(pose.yaw):.5f}"


def _passes(pair: ScanPair, match: Match) -> bool:
    """Converged to the truth."""
    truth = pair.truth or SE2()
    error = truth.inverse() @ match.T_target_source
    return match.converged and float(np.abs(error.as_array()).max()) <= CHECK_TOLERANCE
