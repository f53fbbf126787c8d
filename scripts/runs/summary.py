"""The lines that a person wants to read at the end of a run."""

from __future__ import annotations

import sys

from scripts.errors import FAILED, INTERRUPTED
from scripts.runs.execute import Finished, execute
from scripts.runs.options import RunOptions

PICTURES = ("report.png", "run.gif", "report.html")


def conclude(options: RunOptions) -> int:
    """Run, write everything and say what came out; returns the exit code."""
    run = execute(options)
    print("\n".join(summary(run)))
    outcome = run.record.outcome
    if outcome is not None and not outcome.reached:
        print(f"twin: {outcome.reason}", file=sys.stderr)
        return FAILED
    if run.interrupted:
        print(f"twin: interrupted; {run.folder} holds what there is until then", file=sys.stderr)
    return INTERRUPTED if run.interrupted else 0


def summary(run: Finished) -> list[str]:
    """What came out, and where the pictures are."""
    m, grid = run.record.metrics, run.record.map
    lines: list[str] = []
    if "position_rmse_m" in m:
        lines.append(
            f"Position was right to {1e3 * m['position_rmse_m']:.1f} mm RMS ({1e3 * m['position_max_m']:.1f} mm at worst), "
            f"heading to {m['heading_rmse_deg']:.2f} deg."
        )
    if "odometry_ratio" in m:
        times = f", {m['odometry_ratio']:.1f} times as much" if m["odometry_ratio"] > 1.0 else ""
        lines.append(f"Wheel odometry alone was off by {1e3 * m['odometry_position_rmse_m']:.1f} mm RMS{times}.")
    if "wall_rms_m" in m:
        lines.append(
            f"The map's walls are right to {1e3 * m['wall_rms_m']:.1f} mm; {100 * m['wall_recall']:.1f} % of those seen are in it."
        )
    else:
        lines.append(f"The map has {int(grid.occupied().sum())} occupied cells of {100 * grid.geometry.resolution:g} cm.")
    if "real_time_factor" in m:
        lines.append(
            f"It ran at {m['real_time_factor']:.1f} x real time; one update of the estimate took {m['update_ms_median']:.2f} ms "
            f"(99 %: {m['update_ms_p99']:.2f} ms)."
        )
    lines += _of_the_drive(run)
    if amiss := int(m["frames_degraded"] + m["frames_lost"]):
        lines.append(f"{amiss} of {int(m['frames'])} frames were degraded or lost.")
    return [*lines, "", *(str(run.folder / name) for name in PICTURES)]


def _of_the_drive(run: Finished) -> list[str]:
    """How a drive ended that had an end, and what the robot ran into."""
    m, lines = run.record.metrics, list[str]()
    if run.record.outcome is not None:
        lines.append(f"The drive ended: {run.record.outcome.reason}.")
    if "coverage" in m:
        lines.append(
            f"{100 * m['coverage']:.1f} % of what could be seen from where the robot can get is mapped, on a way of {m['path_m']:.1f} m."
        )
    if m.get("collisions"):
        lines.append(f"It ran into something {int(m['collisions'])} times.")
    return lines
