"""The last touch, offline: poses and map are refined together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from slam.errors import MapTooLargeError, require_not_negative, require_positive
from slam.evaluation.poses import compose
from slam.grid import OccupancyGrid
from slam.mapping.grid_mapper import GridMapper, MapSettings
from slam.mapping.submap import Keyframe, Submap
from slam.mapping.submap_path import SubmapPath
from slam.matching.gauss_newton import GaussNewton
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray


@dataclass(frozen=True, slots=True)
class Polish:
    """Joint refinement by turns: one map from all kept scans, then every scan against the map of all, then again."""

    rounds: int = 0
    """How often; 0 leaves the poses as the graph has them and only makes the map anew."""
    matcher: GaussNewton = field(default_factory=GaussNewton)
    stiffness: float = 0.02
    """Standard deviation by which a scan may move in one round [m]; a third of it in the heading [rad]."""

    def __post_init__(self) -> None:
        require_not_negative(self, "rounds")
        require_positive(self, "stiffness")


@dataclass(frozen=True, slots=True, eq=False)
class Polished:
    """One map, and the poses that made it."""

    map: OccupancyGrid
    trajectory: Trajectory


def polish(settings: Polish, map_settings: MapSettings, submaps: Sequence[Submap], path: SubmapPath) -> Polished | None:
    """The refined map and trajectory; None where the map would be too large."""
    widening = {keyframe.stamp for submap in submaps for keyframe in submap.keyframes if keyframe.widens}
    kept = [(submap, keyframe) for submap in submaps for keyframe in submap.keyframes]
    scans = [(submap, keyframe) for submap, keyframe in kept if keyframe.widens or keyframe.stamp not in widening]
    scans.sort(key=lambda scan: scan[1].stamp)
    before = [submap.T_map_submap @ keyframe.T_submap_base for submap, keyframe in scans]
    poses, keyframes = before, [keyframe for _, keyframe in scans]
    variance = settings.stiffness**2
    prior = np.diag([variance, variance, variance / 9.0])
    try:
        mapper = _mapped(map_settings, keyframes, poses)
        for _ in range(settings.rounds):
            poses = [_matched(settings, mapper, keyframe, pose, prior) for keyframe, pose in zip(keyframes, poses, strict=True)]
            mapper = _mapped(map_settings, keyframes, poses)
    except MapTooLargeError:
        return None
    numbers = [submap.number for submap, _ in scans]
    return Polished(mapper.snapshot(), _moved(path, submaps, (numbers, before, poses)))


def _mapped(settings: MapSettings, keyframes: Sequence[Keyframe], poses: Sequence[SE2]) -> GridMapper:
    mapper = GridMapper(settings)
    for keyframe, pose in zip(keyframes, poses, strict=True):
        mapper.insert(pose, keyframe.points.astype(np.float64), keyframe.origins.astype(np.float64))
    return mapper


def _matched(settings: Polish, mapper: GridMapper, keyframe: Keyframe, pose: SE2, prior: FloatArray) -> SE2:
    match = settings.matcher.match(mapper.field, keyframe.points.astype(np.float64), pose, prior, settings.matcher.kernel_min)
    return match.T_target_source if match.converged else pose


def _moved(path: SubmapPath, submaps: Sequence[Submap], moves: tuple[list[int], list[SE2], list[SE2]]) -> Trajectory:
    """Every scan moves with the kept scan that is nearest to it in its submap."""
    numbers, before, after = np.array(moves[0]), moves[1], moves[2]
    places = np.array([pose.as_array() for pose in before]).reshape(-1, 3)
    corrections = np.array([(new @ old.inverse()).as_array() for old, new in zip(before, after, strict=True)]).reshape(-1, 3)
    trajectory = path.trajectory(submaps)
    poses = trajectory.poses.copy()
    for number in np.unique(path.submaps):
        rows, kept = np.flatnonzero(path.submaps == number), np.flatnonzero(numbers == number)
        if len(kept) > 0:
            poses[rows] = compose(corrections[kept[_nearest(poses[rows], places[kept])]], poses[rows])
    return Trajectory(trajectory.stamps, poses)


def _nearest(poses: FloatArray, places: FloatArray) -> NDArray[np.int64]:
    """For each pose (N, 3) the index (N,) of the nearest place (M, 3); a radian counts as a metre."""
    nearest: NDArray[np.int64] = np.empty(len(poses), np.int64)
    for i, pose in enumerate(poses):
        turn = np.abs(np.remainder(places[:, 2] - pose[2] + np.pi, 2.0 * np.pi) - np.pi)
        nearest[i] = np.argmin(np.hypot(places[:, 0] - pose[0], places[:, 1] - pose[1]) + turn)
    return nearest
