"""Markers round a room, seen without pictures: corners projected, noise added. For back ends, which never see a picture."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hardware.camera_spec import camera_mount, d435
from slam.kernels.planar_pose import square_poses
from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.landmarks.sighting import Sighting, square
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3
from worlds.loader import load_world

DICTIONARY = "DICT_ARUCO_MIP_36h12"
MOUNT = camera_mount((0.075, 0.0, 0.20), math.radians(15.0))
LEAST_SIDE = 15.0
"""[px]"""


@dataclass(frozen=True, eq=False)
class MarkerScene:
    """A round room and its markers."""

    count: int = 40
    radius: float = 2.5
    """[m]"""
    size: float = 0.12
    """[m]"""
    noise: float = 0.05
    """Standard deviation of a corner [px]."""

    def truth(self) -> MarkerMap:
        """The true map."""
        return MarkerMap.of([MappedMarker(k, self.size, self.pose_of(k)) for k in range(self.count)], DICTIONARY)

    def pose_of(self, marker: int) -> SE3:
        """`T_map_marker`: upright, towards the middle."""
        angle = math.tau * marker / self.count
        x, y, z = (
            np.array([-math.sin(angle), math.cos(angle), 0.0]),
            np.array([0.0, 0.0, 1.0]),
            -np.array([math.cos(angle), math.sin(angle), 0.0]),
        )
        return SE3(np.column_stack([-x, y, z]), -self.radius * z + (0.25 + 0.1 * (marker % 4)) * y)

    def path(self, poses: int, laps: float = 1.0) -> list[SE2]:
        """Poses round the room's middle, along the way."""
        angles = math.tau * laps * np.arange(poses) / poses
        return [SE2(0.4 * self.radius * math.cos(a), 0.4 * self.radius * math.sin(a), a + 0.5 * math.pi) for a in angles.tolist()]

    def sightings(self, T_map_base: SE2, rng: np.random.Generator, markers: MarkerMap | None = None) -> list[Sighting]:
        """What a D435 at 848 x 480 sees from a pose; `markers` in place of the scene's."""
        shown = [s for m in (markers or self.truth()).markers.values() if (s := self._seen(T_map_base, m, rng)) is not None]
        if not shown:
            return []
        focal = d435().colour.focal[0]
        sigma = self.noise / focal
        rays = np.array([r for _, r in shown])
        R, t, chi = square_poses(rays, np.tile(np.eye(2) / sigma**2, (len(rays), 4, 1, 1)), np.array([m.size for m, _ in shown]))
        return [
            Sighting(
                m.id,
                m.size,
                rays[k] * focal,
                rays[k],
                np.tile(sigma**2 * np.eye(2), (4, 1, 1)),
                (SE3(R[k, 0], t[k, 0]), SE3(R[k, 1], t[k, 1])),
                (float(chi[k, 0]), float(chi[k, 1])),
                float(focal * np.linalg.norm(np.roll(rays[k], -1, axis=0) - rays[k], axis=1).mean()),
                0.5,
            )
            for k, (m, _) in enumerate(shown)
            if np.isfinite(chi[k]).all()
        ]

    def steps(self, path: list[SE2], rng: np.random.Generator) -> Iterator[SE2]:
        """What odometry says from each pose to the next: 3 mm and 0.17 deg of noise."""
        for before, after in pairwise(path):
            yield SE2.from_array((before.inverse() @ after).as_array() + rng.normal(0.0, [0.003, 0.001, 0.003]))

    def _seen(self, T_map_base: SE2, marker: MappedMarker, rng: np.random.Generator) -> tuple[MappedMarker, FloatArray] | None:
        """A marker's rays (4, 2), if it is in the picture and not too small or too slanting."""
        colour = d435().colour
        T_camera_marker = (SE3.from_se2(T_map_base) @ MOUNT).inverse() @ marker.T_map_marker
        corners = T_camera_marker.transform(square(marker.size))
        if corners[:, 2].min() < 0.1 or -(T_camera_marker.R[:, 2] @ T_camera_marker.t) < 0.35 * np.linalg.norm(T_camera_marker.t):
            return None
        rays = corners[:, :2] / corners[:, 2:]
        pixels = rays * colour.focal + colour.centre
        if not ((pixels > 3.0) & (pixels < (colour.width - 4, colour.height - 4))).all():
            return None
        if colour.focal[0] * marker.size / float(corners[:, 2].mean()) < LEAST_SIDE:
            return None
        return marker, rays + rng.normal(0.0, self.noise / colour.focal[0], (4, 2))


def true_map(world: str) -> MarkerMap:
    """The markers of a world, where they are."""
    known = load_world(world)
    markers: list[MappedMarker] = []
    for marker in known.markers:
        a, b, _, d = marker.corners()
        x, y = (b - a) / marker.size, (a - d) / marker.size
        markers.append(MappedMarker(marker.id, marker.size, SE3(np.column_stack([x, y, np.cross(x, y)]), np.array(marker.position))))
    return MarkerMap.of(markers, known.dictionary)


def map_errors(found: MarkerMap, truth: MarkerMap) -> tuple[FloatArray, FloatArray]:
    """Distances (N,) [m] and angles (N,) [rad] of a map's markers from the true ones, after the best rigid motion."""
    T_true_found = map_alignment(found, truth)
    laid = [(truth.markers[k].T_map_marker, T_true_found @ found.markers[k].T_map_marker) for k in _shared(found, truth)]
    off = np.array([theirs.t - true.t for true, theirs in laid])
    turns = [SE3(true.R.T @ theirs.R).log()[3:] for true, theirs in laid]
    return np.linalg.norm(off, axis=1), np.linalg.norm(turns, axis=1)


def map_alignment(found: MarkerMap, truth: MarkerMap) -> SE3:
    """The rigid motion `T_true_found` that lays a map's markers best over the true ones; none where they share no marker."""
    ids = _shared(found, truth)
    if not ids:
        return SE3()
    a = np.array([found.markers[k].T_map_marker.t for k in ids])
    b = np.array([truth.markers[k].T_map_marker.t for k in ids])
    U, _, Vh = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)))
    R = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vh)]) @ Vh
    return SE3(R, b.mean(axis=0) - R @ a.mean(axis=0))


def _shared(found: MarkerMap, truth: MarkerMap) -> list[int]:
    return [marker for marker in found.markers if marker in truth.markers]
