"""Document C's parts of the office: inside the corridor, region A and all that is outside the corridor; and where they lie in a map.

A map that was made with wheels and lidar may be a little too long along a corridor, and then no localizer can be right at both of its
ends. `PlacedMap` therefore also knows where each part of the map lies, by the run that made it: `Run`s scored by that show what is the
localizer's own error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scripts.experiments.arena import WorldErrors, follow
from scripts.experiments.contest import Run
from scripts.experiments.drive import Course, Drive
from scripts.runs.known_map import GivenMap
from scripts.runs.metrics import aligned_errors
from slam.evaluation.poses import sample, transform, wrap_angles
from slam.evaluation.trajectory import interpolate_truth
from slam.localization.known_map import KnownMap
from slam.mapping.lidar_slam import LidarSlam
from slam.messages import Trajectory
from slam.se2 import SE2, FloatArray
from worlds.floor_plan import Room
from worlds.office import AREA_A, ROOMS

CORRIDOR = ROOMS[0]
MARGIN = 0.05
"""How far a part reaches into the wall beside it [m]."""
EMPTY_OFFICE = "office:people=0"
MAPPING_TIME, MAPPING_SEED = 210.0, 100
"""Of the run that makes the map: once round the tour."""


def _within(room: Room) -> Callable[[FloatArray], NDArray[np.bool_]]:
    def inside(places: FloatArray) -> NDArray[np.bool_]:
        x, y = places[:, 0], places[:, 1]
        return (x > room.x0) & (x < room.x1) & (y > room.y0) & (y < room.y1 + MARGIN)

    return inside


in_corridor = _within(CORRIDOR)
in_region_a = _within(AREA_A)


def in_meeting_room(places: FloatArray) -> NDArray[np.bool_]:
    """Which places (N, 2 or more) of the world are neither in the corridor nor in region A."""
    return ~in_corridor(places) & ~in_region_a(places)


def outside(places: FloatArray) -> NDArray[np.bool_]:
    """Which places (N, 2 or more) of the world are not in the corridor."""
    return ~in_corridor(places)


PARTS: dict[str, Callable[[FloatArray], NDArray[np.bool_]]] = {
    "outside": outside,
    "region A": in_region_a,
    "corridor": in_corridor,
}
"""name -> which places (N, 2 or more) of the world belong to it."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedMap:
    """A map of the office, where it lies, and where each of its parts does."""

    given: GivenMap
    truth: Trajectory
    """`T_world_base` of the run that made it."""
    final: Trajectory
    """`T_map_base` of the same moments, after all corrections."""

    @classmethod
    def made(cls, world: str = EMPTY_OFFICE, duration: float = MAPPING_TIME, seed: int = MAPPING_SEED) -> PlacedMap:
        """By `lidar_slam` on a drive of its own."""
        drive = Course(world, duration, seed).drive()
        mapper = LidarSlam().build()
        truth, final = interpolate_truth(drive.truth, follow(mapper, drive).final)
        given = GivenMap(KnownMap(mapper.snapshot().map), aligned_errors(truth, final).T_truth_estimate)
        return cls(given, truth, final)

    def in_place(self, run: Run) -> Run:
        """A run with its errors against where each room lies in the map."""
        believed = run.places + np.column_stack([run.errors.x, run.errors.y, run.errors.yaw])
        for room in (in_corridor, in_region_a, in_meeting_room):
            mapped, now = room(self.truth.poses), room(run.places)
            if mapped.any() and now.any():
                truth, final = (Trajectory(t.stamps[mapped], t.poses[mapped]) for t in (self.truth, self.final))
                T_room = aligned_errors(truth, final).T_truth_estimate
                believed[now] = transform(T_room @ self.given.T_world_map.inverse(), believed[now])
        off = believed - run.places
        return replace(run, errors=WorldErrors(run.errors.stamps, off[:, 0], off[:, 1], wrap_angles(off[:, 2])))


def by_parts(runs: Sequence[Run]) -> list[Run]:
    """The runs in each part of the office."""
    parts: list[Run] = []
    for name, part in PARTS.items():
        for run in runs:
            inside = run.where(part(run.places))
            if len(inside.errors.stamps):
                parts.append(replace(inside, condition=f"{run.condition} {name}".strip()))
    return parts


def drift_along_corridor(run: Run, drive: Drive) -> FloatArray:
    """(K,) largest error along the corridor [m] that came up within each stretch of it, over that stretch alone."""
    inside = in_corridor(run.places)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]])))
    drifts: list[float] = []
    believed = run.places + np.column_stack([run.errors.x, run.errors.y, run.errors.yaw])
    for first, end in edges.reshape(-1, 2).tolist():
        start, claimed = SE2.from_array(run.places[first]), SE2.from_array(believed[first])
        ways = transform(start @ claimed.inverse(), believed[first:end])
        drifts.append(float(np.max(np.abs(ways[:, 0] - sample(drive.truth, run.errors.stamps[first:end])[:, 0]))))
    return np.array(drifts)
