"""Errors over time, as the report draws them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scripts.runs import palette
from scripts.runs.metrics import aligned_errors
from scripts.runs.record import RunRecord
from scripts.runs.scene import start_of_odometry
from slam.evaluation.poses import sample, transform, wrap_angles
from slam.evaluation.trajectory import Statistics
from slam.messages import Trajectory
from slam.se2 import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """One line: values over time since the first frame [s]."""

    label: str
    colour: str
    stamps: FloatArray
    values: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One panel."""

    title: str
    unit: str
    lines: tuple[Line, ...]


def curves(run: RunRecord) -> tuple[Curve, Curve]:
    """Position and heading panels: errors after alignment where the truth is known, else how far the estimate left the odometry.

    Raises:
        TrajectoryError: truth and estimate do not overlap in time.
    """
    if len(run.estimate) == 0:
        return Curve("Position", "mm", ()), Curve("Heading", "deg", ())
    lines = _differences(run) if run.truth is None else _errors(run, run.truth)
    what = "correction" if run.truth is None else "error"
    position, heading = zip(*lines, strict=True) if lines else ((), ())
    return Curve(f"Position {what}", "mm", position), Curve(f"Heading {what}", "deg", heading)


def _errors(run: RunRecord, truth: Trajectory) -> list[tuple[Line, Line]]:
    lines: list[tuple[Line, Line]] = []
    for name, colour, trajectory in (("odometry", palette.ODOMETRY, run.odometry), ("estimate", palette.ESTIMATE, run.estimate)):
        if len(trajectory) > 0:
            scored = aligned_errors(truth, trajectory)
            lines.append(_pair(name, colour, scored.stamps - run.estimate.stamps[0], scored.errors.translation, scored.errors.heading))
    return lines


def _differences(run: RunRecord) -> list[tuple[Line, Line]]:
    if len(run.odometry) == 0:
        return []
    odometry = transform(start_of_odometry(run), sample(run.odometry, run.estimate.stamps))
    difference = run.estimate.poses - odometry
    stamps = run.estimate.stamps - run.estimate.stamps[0]
    distance = np.linalg.norm(difference[:, :2], axis=1)
    return [_pair("estimate against odometry", palette.ESTIMATE, stamps, distance, np.abs(wrap_angles(difference[:, 2])))]


def _pair(name: str, colour: str, stamps: FloatArray, distance: FloatArray, angle: FloatArray) -> tuple[Line, Line]:
    distance_mm, angle_deg = distance * 1e3, np.rad2deg(angle)
    return (
        Line(f"{name}, RMS {Statistics.of(distance_mm).rmse:.3g} mm", colour, stamps, distance_mm),
        Line(f"{name}, RMS {Statistics.of(angle_deg).rmse:.2g}°", colour, stamps, angle_deg),
    )
