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


@dataclass(frozen=True, slots=True, eq=False)
class _Errors:
    """What one name is off by, at stamps since the first frame (N,) [s]: (N,) [m], (N,) [rad]."""

    name: str
    colour: str
    stamps: FloatArray
    distance: FloatArray
    angle: FloatArray


def curves(run: RunRecord) -> tuple[Curve, Curve]:
    """Position and heading panels: errors after alignment where the truth is known, else how far the estimate left the odometry.

    Raises:
        TrajectoryError: truth and estimate do not overlap in time.
    """
    if len(run.estimate) == 0:
        return Curve("Position", "mm", ()), Curve("Heading", "deg", ())
    errors = _differences(run) if run.truth is None else _errors(run, run.truth)
    what = "correction" if run.truth is None else "error"
    large = any(Statistics.of(error.distance).rmse >= 1.0 for error in errors)
    unit, scale = ("m", 1.0) if large else ("mm", 1e3)
    position = [_line(error, scale * error.distance, f" {unit}") for error in errors]
    heading = [_line(error, np.rad2deg(error.angle), "°") for error in errors]
    return Curve(f"Position {what}", unit, tuple(position)), Curve(f"Heading {what}", "deg", tuple(heading))


def belief_curves(run: RunRecord) -> tuple[Curve, Curve, Curve]:
    """Panels of a particle filter: how many particles there are and how many of them count, their weights, and their spread."""
    beliefs, since = run.beliefs, float(run.estimate.stamps[0]) if len(run.estimate) else 0.0
    stamps = beliefs.stamps - since

    def line(label: str, colour: str, values: FloatArray) -> Line:
        return Line(label, colour, stamps, values)

    count, effective = line("particles", palette.TRUTH, beliefs.count), line("effective, N_eff", palette.PARTICLES, beliefs.effective)
    return (
        Curve("Particles", "", (count, effective)),
        Curve("Largest weight against the mean", "", (line("largest / mean", palette.PARTICLES, beliefs.largest),)),
        Curve("Spread of the positions", "mm", (line("standard deviation", palette.PARTICLES, 1e3 * beliefs.spread),)),
    )


def _errors(run: RunRecord, truth: Trajectory) -> list[_Errors]:
    errors: list[_Errors] = []
    lines = (("odometry", palette.ODOMETRY, run.odometry, None), ("estimate", palette.ESTIMATE, run.estimate, run.T_world_map))
    for name, colour, trajectory, place in lines:
        if len(trajectory) > 0:
            scored = aligned_errors(truth, trajectory, place)
            errors.append(_Errors(name, colour, scored.stamps - run.estimate.stamps[0], scored.errors.translation, scored.errors.heading))
    return errors


def _differences(run: RunRecord) -> list[_Errors]:
    if len(run.odometry) == 0:
        return []
    odometry = transform(start_of_odometry(run), sample(run.odometry, run.estimate.stamps))
    difference = run.estimate.poses - odometry
    stamps = run.estimate.stamps - run.estimate.stamps[0]
    distance, angle = np.linalg.norm(difference[:, :2], axis=1), np.abs(wrap_angles(difference[:, 2]))
    return [_Errors("estimate against odometry", palette.ESTIMATE, stamps, distance, angle)]


def _line(error: _Errors, values: FloatArray, unit: str) -> Line:
    return Line(f"{error.name}, RMS {_short(Statistics.of(values).rmse)}{unit}", error.colour, error.stamps, values)


def _short(value: float) -> str:
    """Three digits that count, never an exponent."""
    digits = 3 if value < 1.0 else 2 if value < 10.0 else 1 if value < 100.0 else 0
    return f"{value:.{digits}f}"
