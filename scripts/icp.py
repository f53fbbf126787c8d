"""The verb `twin icp`: how ICP lays one scan over another, step by step.

Without a recording it repeats the check of the source report: the points of a scan, moved by (1 m, 2 m, 30 deg), are
brought back without a guess. With `--log PATH --scans TARGET SOURCE` it registers two scans of a recording.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from rich.console import Console
from tyro.conf import arg

from scripts.errors import UsageError
from scripts.icp_animation import write_icp_gif, write_icp_png
from scripts.icp_table import answer_lines, steps_table
from scripts.options import OptionalFile, parse
from scripts.scan_pairs import ScanPair, displaced_room, recorded_pair
from slam.matching.icp import Icp, IcpStep
from slam.matching.match import Match
from slam.matching.matchers import matcher_settings
from slam.se2 import SE2

HELP = "lay one scan over another by ICP, step by step: the source report's check or two scans of a recording, with GIF"

CHECK_TOLERANCE = 1e-6
"""[m] and [rad]"""
DEFAULT = Icp()
PAIRED = 0.3
"""Longest correspondence drawn for matchers that have none of their own [m]."""


@dataclass(frozen=True)
class IcpOptions:
    """Lay one scan over another by ICP and show every step.

    Without --log: the check of the source report, a scan moved by (1 m, 2 m, 30 deg) and brought back without a guess;
    exits with 1 unless the answer is right to 1e-6 m and rad. With --log: two scans of a recording, from what the wheels say.
    The options from --iterations on are icp's; other matchers show their start and their end.
    """

    log: Annotated[Path | None, arg(metavar="RECORDING", help_behavior_hint="")] = None
    """Recording to take two scans from: a run folder, a rosbag2 (.mcap), a CARMEN log or a CoreSLAM .dat."""
    scans: tuple[int, int] = (0, 3)
    """With --log: number of the target scan, and of the source scan that is laid over it; the first is 0."""
    guess: Literal["wheels", "none"] = "wheels"
    """With --log: start from the wheels' motion between the scans, or from no motion as the source report does."""
    matcher: str = "icp"
    """With --log: what lays the scans over each other: icp, plicp, gauss_newton, correlative or ndt."""
    gif: OptionalFile = None
    """Animation of the steps to write."""
    png: OptionalFile = None
    """Picture of the start and the end to write."""
    iterations: int = DEFAULT.iterations
    """Most steps."""
    trim: Annotated[float | None, arg(metavar="SHARE", help_behavior_hint="")] = None
    """Share of the correspondences that is kept, nearest first; 1 for the check, where all overlaps, 0.9 for recordings."""
    one_to_one: bool = DEFAULT.one_to_one
    """A target point is the counterpart of one source point only, the nearest."""
    max_distance: float = DEFAULT.max_distance
    """Longest correspondence [m]."""


def main(argv: list[str]) -> int:
    """Register, print, draw; returns the exit code.

    Raises:
        UsageError, ParameterError: options that cannot be.
        RecordingError: the recording cannot be used.
        OutputError: an output cannot be written.
    """
    options = parse(IcpOptions, argv, "icp")
    icp, kind = _matcher(options), matcher_settings(options.matcher)
    if kind is not Icp and options.log is None:
        raise UsageError(f"--matcher {options.matcher} needs --log; only icp does the check, 2.2 m and 30 deg without a guess")
    outputs = _outputs(options)
    pair = displaced_room() if options.log is None else recorded_pair(options.log, *options.scans)
    guess = pair.wheels if pair.wheels is not None and options.guess == "wheels" else SE2()
    if kind is Icp:
        steps, match = list(icp.steps(pair.source, pair.target, guess)), icp.match(pair.source, pair.target, guess)
    else:
        match = kind().register(pair.source, pair.target, guess)
        steps = [_pairs_at(pair, pose) for pose in (guess, match.T_target_source)]
    Console().print(steps_table(pair.title, steps))
    print("\n".join(answer_lines(pair, match, options.matcher)))
    for path, write in outputs:
        write(path, pair, steps)
        print(f"wrote {path}")
    return 0 if options.log is not None or _passes(pair, match) else 1


def _pairs_at(pair: ScanPair, pose: SE2) -> IcpStep:
    """What ICP would pair at a pose."""
    return next(Icp(trim=1.0, one_to_one=False, max_distance=PAIRED).steps(pair.source, pair.target, pose))


def _outputs(options: IcpOptions) -> list[tuple[Path, Callable[[Path, ScanPair, Sequence[IcpStep]], None]]]:
    """What to write, and with what."""
    asked = (("--gif", ".gif", options.gif, write_icp_gif), ("--png", ".png", options.png, write_icp_png))
    for name, suffix, path, _ in asked:
        if path is not None and path.suffix != suffix:
            raise UsageError(f"{name} {path}: must end in {suffix}")
    return [(path, write) for _, _, path, write in asked if path is not None]


def _matcher(options: IcpOptions) -> Icp:
    trim = options.trim if options.trim is not None else (1.0 if options.log is None else DEFAULT.trim)
    return Icp(iterations=options.iterations, trim=trim, one_to_one=options.one_to_one, max_distance=options.max_distance)


def _passes(pair: ScanPair, match: Match) -> bool:
    """Whether it converged to the truth; says so."""
    error = (pair.truth or SE2()).inverse() @ match.T_target_source
    passed = match.converged and float(np.abs(error.as_array()).max()) <= CHECK_TOLERANCE
    print(f"check {'passed: converged to' if passed else 'failed: did not converge to'} the truth within {CHECK_TOLERANCE:g} m and rad")
    return passed
