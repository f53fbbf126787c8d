"""Which of the poses that a square may have is the one: all views of a marker vote.

A square seen from afar looks the same in two poses (IPPE's branches). Only one of them stays in place while the robot moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slam.kernels.marker_bundle import chi_squares
from slam.landmarks.marker_bundle import views_of
from slam.landmarks.sighting import Sighting
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

VOTERS = 3
"""Views that must agree."""
SHARE = 0.6
"""Of all views."""
AGREES = 0.003
"""RMS of the corners' rays with which a view agrees; odometry alone carried the robot so far [rad]."""
CAP = 2.0 * AGREES
"""A view that does not agree counts so much."""
OTHER = np.deg2rad(12.0)
"""Poses that are turned so far against each other are different ones."""
CLEAR = 1.5, 0.0002
"""A rival must be worse by this factor and by this [rad]."""
EVIDENCE = 30.0
"""Or the views' own errors must differ by so much in sum [chi-square]; no single view gives more than half of it."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A marker as seen from a pose that is known."""

    T_map_base: SE2
    sighting: Sighting


@dataclass(frozen=True, slots=True, eq=False)
class Vote:
    """The outcome."""

    T_map_marker: SE3
    agreeing: tuple[int, ...]
    """Numbers of the views that agree."""
    elected: int
    """The view whose branch it is."""


def vote(views: Sequence[View], T_base_camera: SE3) -> Vote | None:
    """The pose that the views agree on; None while it is not clear."""
    if len(views) < VOTERS:
        return None
    candidates = [(k, _placed(view, branch, T_base_camera)) for k, view in enumerate(views) for branch in view.sighting.branches]
    off = _disagreement(views, [T for _, T in candidates], T_base_camera)  # (candidates, views)
    scores = np.minimum(off, CAP).mean(axis=1)
    best = int(scores.argmin())
    agreeing = [k for k in range(len(views)) if off[best, k] < AGREES]
    elected, T = candidates[best]
    if len(agreeing) < VOTERS or len(agreeing) < SHARE * len(views):
        return None
    rivals = [score for score, (_, other) in zip(scores.tolist(), candidates, strict=True) if _turned(T, other) > OTHER]
    clear = not rivals or min(rivals) > max(CLEAR[0] * scores[best], scores[best] + CLEAR[1])
    if not clear and _evidence([views[k] for k in agreeing], T, T_base_camera) < EVIDENCE:
        return None
    return Vote(T, tuple(agreeing), elected)


def _placed(view: View, branch: SE3, T_base_camera: SE3) -> SE3:
    return SE3.from_se2(view.T_map_base) @ T_base_camera @ branch


def _disagreement(views: Sequence[View], candidates: Sequence[SE3], mount: SE3) -> FloatArray:
    """RMS of the corners' rays (candidates, views) [rad]."""
    rows = [row for row in range(len(candidates)) for _ in views]
    columns = list(range(len(views))) * len(candidates)
    pose, marker, rays, weights, half = views_of([views[k].sighting for k in columns], columns, rows)
    weights = np.broadcast_to(np.eye(2), weights.shape).copy()
    poses = np.array([view.T_map_base.as_array() for view in views])
    R, t = np.array([T.R for T in candidates]), np.array([T.t for T in candidates])
    chi = chi_squares((poses, R, t, np.array(mount.R), np.array(mount.t)), (pose, marker, rays, weights, half))
    return np.sqrt(chi / 8.0).reshape(len(candidates), len(views))


def _turned(T: SE3, other: SE3) -> float:
    """Angle between two rotations [rad]."""
    return float(np.arccos(np.clip(0.5 * (np.trace(T.R.T @ other.R) - 1.0), -1.0, 1.0)))


def _evidence(views: Sequence[View], T: SE3, mount: SE3) -> float:
    """How much better the branches near a pose explain their images than the others do [chi-square]."""
    total = 0.0
    for view in views:
        near = min((0, 1), key=lambda k: _turned(T, _placed(view, view.sighting.branches[k], mount)))
        chi2 = view.sighting.chi2
        total += float(np.clip(chi2[1 - near] - chi2[near], -0.5 * EVIDENCE, 0.5 * EVIDENCE))
    return total
