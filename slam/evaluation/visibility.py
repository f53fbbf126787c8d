"""Which parts of the true walls a lidar could see from where it was."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.evaluation.poses import wrap_angles
from slam.kernels.sight import screened
from slam.se2 import FloatArray

SPACING = 0.01
"""Distance between samples of a wall [m]."""
TOLERANCE = 1e-3
"""A wall hides what lies more than this behind it [m]."""
STEP, TURN = 0.1, math.radians(10.0)
"""Views closer than this [m] and [rad] to the one before count as the same."""


@dataclass(frozen=True, slots=True)
class View:
    """What a lidar covers; the defaults are the URG-04LX's."""

    range_max: float = 5.6
    """[m]"""
    angle_min: float = (44 - 384) * math.tau / 1024
    """First direction, from the lidar's x axis [rad]."""
    angle_max: float = (725 - 384) * math.tau / 1024
    """Last direction [rad]."""


def sample_walls(segments: FloatArray) -> FloatArray:
    """Points (K, 2) along segments (M, 4) of x1, y1, x2, y2 [m]: the middles of equal pieces of 1 cm or little less."""
    ends = segments.reshape(-1, 2, 2)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    counts = np.ceil(lengths / SPACING - 1e-9).astype(np.int64)
    owner = np.repeat(np.arange(len(ends)), counts)
    first = np.concatenate([[0], np.cumsum(counts)])[owner]
    fraction = (np.arange(len(owner)) - first + 0.5) / counts[owner]
    return ends[owner, 0] + fraction[:, None] * (ends[owner, 1] - ends[owner, 0])


def visible_walls(segments: FloatArray, laser_poses: FloatArray, view: View) -> FloatArray:
    """Samples (K, 2) of the walls (M, 4) that lie in view of any of the lidar's poses (N, 3), hidden by no other wall; all in one frame."""
    samples = sample_walls(segments)
    seen, screens = np.zeros(len(samples), np.bool_), np.zeros(len(samples), np.int64)
    for pose in _thin(laser_poses):
        candidates = np.flatnonzero(~seen)
        candidates = candidates[_in_view(samples[candidates], pose, view)]
        tried_first = screens[candidates]
        seen[candidates] = ~screened(pose[:2], samples[candidates], segments, tried_first, TOLERANCE)
        screens[candidates] = tried_first
    return samples[seen]


def _thin(poses: FloatArray) -> FloatArray:
    moves = np.diff(poses, axis=0, prepend=poses[:1])
    travel = np.linalg.norm(moves[:, :2], axis=1) / STEP + np.abs(wrap_angles(moves[:, 2])) / TURN
    _, first = np.unique(np.floor(np.cumsum(travel)), return_index=True)
    return poses[first]


def _in_view(points: FloatArray, pose: FloatArray, view: View) -> NDArray[np.bool_]:
    offset = points - pose[:2]
    bearing = wrap_angles(np.arctan2(offset[:, 1], offset[:, 0]) - pose[2])
    within = np.linalg.norm(offset, axis=1) <= view.range_max
    return within & (bearing >= view.angle_min) & (bearing <= view.angle_max)
