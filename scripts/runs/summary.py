"""The lines that a person wants to read at the end of a run."""

from __future__ import annotations

from scripts.runs.execute import Finished


def summary(run: Finished) -> list[str]:
    """What came out, and where the pictures are."""
    m = dict(run.record.metrics)
    lines: list[str] = []
    if "position_rmse_m" in m:
        lines.append(
            f"Position was right to {1e3 * m['position_rmse_m']:.1f} mm RMS ({1e3 * m['position_max_m']:.1f} mm at worst), "
            f"heading to {m['heading_rmse_deg']:.2f} deg."
        )
    if "odometry_ratio" in m:
        lines.append(f"Wheel odometry alone drifted to {1e3 * m['odometry_position_rmse_m']:.0f} mm: {m['odometry_ratio']:.0f} times worse.")
    if "wall_rms_m" in m:
        lines.append(f"The map's walls are right to {1e3 * m['wall_rms_m']:.1f} mm; {100 * m['wall_recall']:.1f} % of those seen are in it.")
    occupied = int(run.record.map.occupied().sum())
    if "wall_rms_m" not in m:
        lines.append(f"The map has {occupied} occupied cells of {100 * run.record.map.geometry.resolution:g} cm.")
    lines.append(
        f"It ran {m.get('real_time_factor', 0.0):.1f} times faster than real time; "
        f"one update took {m.get('update_ms_median', 0.0):.2f} ms (99 %: {m.get('update_ms_p99', 0.0):.2f} ms)."
    )
    degraded = int(m["frames_degraded"] + m["frames_lost"])
    if degraded:
        lines.append(f"{degraded} of {int(m['frames'])} frames were degraded or lost.")
    names = ("report.png", "run.gif", "report.html")
    return [*lines, "", *(str(run.folder / name) for name in names)]
