"""What `twin icp` prints: the steps and the answer."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from rich.markup import escape
from rich.table import Table

from scripts.scan_pairs import ScanPair
from slam.matching.icp import IcpStep
from slam.matching.localizability import Localizability
from slam.matching.match import Match
from slam.se2 import SE2

MOST_ROWS = 12


def steps_table(title: str, steps: Sequence[IcpStep]) -> Table:
    """At most 12 of the steps: pairs, rms, pose."""
    table = Table(title=escape(f"ICP: {title}"), title_justify="left")
    for heading in ("step", "pairs", "rms [mm]", "x [m]", "y [m]", "yaw [deg]"):
        table.add_column(escape(heading), justify="right")
    for number in np.unique(np.linspace(0, len(steps) - 1, MOST_ROWS).round().astype(np.int64)):
        step = steps[int(number)]
        table.add_row(str(number), str(len(step.p)), f"{1000.0 * step.rms:.3f}", *_numbers(step.T_target_source))
    return table


def answer_lines(pair: ScanPair, match: Match, matcher: str = "icp") -> list[str]:
    """The result beside what else is known of the motion, and how far the scan can be trusted."""
    name = "ICP" if matcher == "icp" else matcher
    lines = [_line(name, match.T_target_source) + f"  {'converged' if match.converged else 'not converged'}, {match.iterations} steps"]
    for other, pose in (("truth", pair.truth), ("wheels", pair.wheels)):
        if pose is not None:
            error = pose.inverse() @ match.T_target_source
            apart = f"  {name} is {1000.0 * math.hypot(error.x, error.y):.3g} mm, {math.degrees(abs(error.yaw)):.3g} deg away"
            lines.append(_line(other, pose) + apart)
    return [*lines, _trust(pair, match)]


def _trust(pair: ScanPair, match: Match) -> str:
    """The match's deviations, and the bounds that the scan's geometry sets to any matcher."""
    x, y, yaw = np.sqrt(np.diag(match.covariance))
    bound = Localizability.of(pair.source, match.T_target_source)
    return (
        f"deviations x {1000.0 * x:.3g} mm  y {1000.0 * y:.3g} mm  yaw {math.degrees(yaw):.3g} deg\n"
        f"the scan allows {1000.0 * bound.weakest:.3g} mm along {math.degrees(bound.axis):.0f} deg, "
        f"{1000.0 * bound.strongest:.3g} mm across, {math.degrees(bound.heading):.3g} deg"
    )


def _line(name: str, pose: SE2) -> str:
    x, y, yaw = _numbers(pose)
    return f"{name:7}x {x} m  y {y} m  yaw {yaw} deg"


def _numbers(pose: SE2) -> tuple[str, str, str]:
    return f"{pose.x:.6f}", f"{pose.y:.6f}", f"{math.degrees(pose.yaw):.5f}"
