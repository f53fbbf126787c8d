"""`twin bench localizability`: whether the dynamic localizability matrix is right, and what document C's steps cost.

The geometry of D is judged against the spread of the best match: scans of true walls with range noise, each matched by maximum likelihood
to the true walls. D comes from the map that `lidar_slam` made of the same world, 20 deg off the axes of its grid.
"""

from __future__ import annotations

import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scripts.bench.row import Row
from scripts.experiments.arena import GivenMap, map_of
from scripts.experiments.drive import Course
from slam.localization.influence import Influence, localizability_matrix
from slam.localization.map_faces import MapFaces
from slam.matching.localizability import Localizability
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray
from worlds.parts import Wall
from worlds.toml_file import dump_world
from worlds.world import World

TURN = math.radians(20.0)
"""Of the worlds, away from the axes of the map's grid."""
REACH, BEAMS = 5.6, 341
DRAWS = 400
WITHIN = "0.9 to 1.1"
BOUNDLESS = 100.0
"""A standard deviation that stands for none in the table [m]."""


@dataclass(frozen=True, slots=True)
class Place:
    """A world and where D is asked."""

    name: str
    size: tuple[float, float]
    """Length and width of the room [m]."""
    waypoints: tuple[tuple[float, float], ...]
    """Of the drive that maps it, along the room's own axes from its middle [m]."""
    pose: SE2
    """Where D is asked, along the same axes."""

    def world(self) -> World:
        """Four walls, turned; the robot starts in the middle."""
        a, b = 0.5 * self.size[0], 0.5 * self.size[1]
        corners = SE2(0.0, 0.0, TURN).transform(np.array([[-a, -b], [a, -b], [a, b], [-a, b]])).round(4).tolist()
        ends = [(x, y) for x, y in corners]
        walls = tuple(Wall(ends[i], ends[(i + 1) % 4], 0.1, 1.0) for i in range(4))
        tour = SE2(0.0, 0.0, TURN).transform(np.array(self.waypoints)).round(4).tolist()
        return World(name=self.name, walls=walls, start=(0.0, 0.0, round(TURN, 4)), tour=tuple((x, y) for x, y in tour))


PLACES = (
    Place("room", (5.2, 4.1), ((1.5, 0.0), (1.5, 1.2), (-1.5, 1.2), (-1.5, -1.2), (1.2, -1.2)), SE2(0.4, -0.3, 0.5)),
    Place("corridor", (26.0, 1.6), ((2.5, 0.0), (-2.5, 0.0), (1.0, 0.0)), SE2(0.3, 0.1, 0.2)),
)
"""The corridor's ends are more than 12 m away from where D is asked, which no beam reaches."""


def run(smoke: bool) -> list[Row]:
    """Rows of the geometry of D and of the time that it takes."""
    rows: list[Row] = []
    for place in PLACES:
        given, walls = _mapped(place)
        rows += _geometry(place, given, walls, 20 if smoke else DRAWS)
    return rows


def _mapped(place: Place) -> tuple[GivenMap, FloatArray]:
    """The map of a place from a drive of its own, and the true walls (N, 4) [m]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.toml"
        path.write_text(dump_world(place.world()))
        drive = Course(str(path), 45.0).drive()
        return map_of(drive), drive.walls


def _geometry(place: Place, given: GivenMap, walls: FloatArray, draws: int) -> list[Row]:
    T_world_base = SE2(0.0, 0.0, TURN) @ place.pose
    bearings = np.linspace(-2.0, 2.0, BEAMS)
    ranges, _ = look(T_world_base, bearings, walls)
    bearings, ranges = bearings[ranges < REACH], ranges[ranges < REACH]
    sigma = np.maximum(0.01, 0.01 * ranges)
    spread = _in_frame(np.cov(matches(T_world_base, (bearings, ranges, sigma), walls, draws).T), T_world_base)
    D, milliseconds = _matrix(given, T_world_base, (bearings, ranges, sigma))
    known = Localizability.from_information(D)
    bound = np.linalg.pinv(D, hermitian=True, rcond=1e-9)
    along = np.array([math.cos(known.axis), math.sin(known.axis), 0.0])
    axes = {"across": np.array([-along[1], along[0], 0.0]), "heading": np.array([0.0, 0.0, 1.0])}
    axes |= {"along the weakest axis": along} if known.weakest < BOUNDLESS else {}
    what = f"{place.name}, deviation by D"
    rows = [
        Row(
            "localizability",
            f"{what} / of {draws} best matches, {name}",
            math.sqrt(axis @ bound @ axis / (axis @ spread @ axis)),
            "",
            WITHIN,
        )
        for name, axis in axes.items()
    ]
    reach = "none" if place.name == "corridor" else ""
    rows.append(Row("localizability", f"{what} along the weakest axis", known.weakest, "m", reach))
    cost = f"{place.name}, expected ranges, influence factors and D of {len(ranges)} beams"
    return [*rows, Row("localizability", cost, milliseconds, "ms")]


def _matrix(given: GivenMap, T_world_base: SE2, beams: tuple[FloatArray, FloatArray, FloatArray]) -> tuple[FloatArray, float]:
    """D along the axes of base by the map, and the CPU time that it took [ms]."""
    bearings, ranges, sigma = beams
    ends = np.column_stack([np.cos(bearings), np.sin(bearings)]) * ranges[:, None]
    cloud, faces = PointScan(0.0, ends, np.zeros_like(ends)), MapFaces(given.known)
    T_map_base = given.T_world_map.inverse() @ T_world_base
    D, milliseconds = np.zeros((3, 3)), math.inf
    for _ in range(5):
        began = time.thread_time()
        sight = faces.look(T_map_base, cloud, REACH)
        Influence().factors(ranges, sight, 1e-4 * np.eye(3), np.zeros(len(ranges)), REACH)
        D = localizability_matrix(sight, 1.0 / sigma**2)
        milliseconds = min(milliseconds, 1e3 * (time.thread_time() - began))
    return _in_frame(D, T_map_base), milliseconds


def _in_frame(D: FloatArray, pose: SE2) -> FloatArray:
    """A matrix (3, 3) of (x, y, yaw) along the axes of base."""
    R = np.eye(3)
    R[:2, :2] = pose.rotation()
    return R.T @ D @ R


def look(pose: SE2, bearings: FloatArray, walls: FloatArray) -> tuple[FloatArray, FloatArray]:
    """True ranges (M,) [m] of beams from base, and their gradients (M, 3) by the pose."""
    headings = pose.yaw + bearings
    u = np.column_stack([np.cos(headings), np.sin(headings)])[:, None]  # (M, 1, 2)
    a, along = walls[:, :2], walls[:, 2:] - walls[:, :2]
    off = a - np.array([pose.x, pose.y])
    cross = u[..., 0] * along[:, 1] - u[..., 1] * along[:, 0]  # (M, N)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]) / cross
        share = (off[:, 0] * u[..., 1] - off[:, 1] * u[..., 0]) / cross
    t = np.where((t > 1e-9) & (share >= 0.0) & (share <= 1.0), t, np.inf)
    hit = np.argmin(t, axis=1)
    ranges = t[np.arange(len(t)), hit]
    n = np.column_stack([-along[hit, 1], along[hit, 0]]) / np.hypot(along[hit, 0], along[hit, 1])[:, None]
    cosine = np.einsum("mi,mi->m", n, u[:, 0])
    turn = np.where(np.isfinite(ranges), ranges, 0.0) * (n[:, 0] * u[:, 0, 1] - n[:, 1] * u[:, 0, 0]) / cosine
    return ranges, np.column_stack([-n / cosine[:, None], turn])


def matches(pose: SE2, beams: tuple[FloatArray, FloatArray, FloatArray], walls: FloatArray, draws: int) -> FloatArray:
    """(draws, 3) poses of maximum likelihood of scans with range noise, by Gauss-Newton on the true walls."""
    bearings, ranges, sigma = beams
    rng = np.random.default_rng(0)
    found = np.empty((draws, 3))
    for k in range(draws):
        measured = ranges + sigma * rng.standard_normal(len(ranges))
        best = pose.as_array()
        for _ in range(8):
            expected, g = look(SE2.from_array(best), bearings, walls)
            kept = np.abs(measured - expected) < 6.0 * sigma
            step = np.linalg.lstsq(g[kept] / sigma[kept, None], (measured - expected)[kept] / sigma[kept], rcond=1e-6)[0]
            best = best + step
        found[k] = best
    return found
