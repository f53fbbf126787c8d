"""The figures of a run that a person wants to read, in their order."""

from __future__ import annotations

from collections.abc import Mapping

MOST = 9
HEADLINES = (
    ("position_rmse_m", "position RMSE", 1e3, "{:.1f} mm"),
    ("heading_rmse_deg", "heading RMSE", 1.0, "{:.2f}°"),
    ("odometry_ratio", "better than odometry", 1.0, "{:.1f} ×"),
    ("wall_rms_m", "wall error, RMS", 1e3, "{:.1f} mm"),
    ("wall_recall", "walls found", 1e2, "{:.1f} %"),
    ("coverage", "of the reachable area", 1e2, "{:.1f} %"),
    ("iou", "map IoU", 1e2, "{:.1f} %"),
    ("real_time_factor", "real time", 1.0, "{:.1f} ×"),
    ("update_ms_median", "update, median", 1.0, "{:.2f} ms"),
    ("update_ms_p99", "update, slowest 1 %", 1.0, "{:.2f} ms"),
    ("frames", "frames", 1.0, "{:.0f}"),
    ("frames_degraded", "frames degraded", 1.0, "{:.0f}"),
    ("frames_lost", "frames lost", 1.0, "{:.0f}"),
)
"""Key, label, factor to the unit shown, format."""


def headlines(metrics: Mapping[str, float]) -> list[tuple[str, str]]:
    """(label, value) of up to nine figures that are known."""
    known = [(label, form.format(metrics[key] * factor)) for key, label, factor, form in HEADLINES if key in metrics]
    return known[:MOST]
