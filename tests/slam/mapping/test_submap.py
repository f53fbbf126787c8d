"""Submaps, and when a scan is believed to lie in one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slam.mapping.grid_mapper import MapSettings
from slam.mapping.recognition import LoopClosing, recognise
from slam.mapping.submap import Keyframe, Submap
from slam.motion.keyframes import KeyframeGate
from slam.scans import PointScan
from slam.se2 import SE2, FloatArray

ANGLES = np.linspace(-np.pi, np.pi, 360, endpoint=False)
NEXT_DOOR = SE2(1.6, 0.0)
"""From one lane to the other, through the wall between."""


@pytest.fixture(scope="module")
def lanes(room: Any) -> Any:
    """Two like lanes, 1.5 m wide, with a wall of 10 cm between."""
    sides = [(-0.75, 0.75), (0.85, 2.35)]
    walls = [[x, -2.0, x, 2.0] for pair in sides for x in pair] + [[a, y, b, y] for a, b in sides for y in (-2.0, 2.0)]
    return type(room)(np.array(walls, dtype=np.float64))


def scan(walls: Any, pose: SE2, seed: int = 0) -> PointScan:
    ranges = walls.ranges(pose, ANGLES) + np.random.default_rng(seed).normal(0.0, 0.005, len(ANGLES))
    points: FloatArray = np.column_stack([ranges * np.cos(ANGLES), ranges * np.sin(ANGLES)])
    return PointScan(float(seed), points, np.zeros_like(points))


@pytest.fixture
def submap(lanes: Any) -> Submap:
    """Of the left lane."""
    submap = Submap(0, 0.0, SE2(), MapSettings())
    for k in range(11):
        pose = SE2(0.0, 0.1 * k - 0.5)
        cloud = scan(lanes, pose, k)
        submap.insert(pose, cloud)
        submap.keep(Keyframe(cloud.stamp, pose, cloud.points.astype(np.float32), cloud.origins.astype(np.float32)))
    return submap


def test_packing_keeps_the_side_from_which_walls_were_seen(submap: Submap) -> None:
    before = submap.surfaces
    corner = np.array([[before.T_map_grid.x, before.T_map_grid.y]])
    sides = before.surfaces[..., 4] == 2.0
    rows, cols = np.nonzero(sides & (before.squares == 0))
    places = corner + (np.column_stack([cols, rows]) + 0.5) * before.resolution
    normals = before.surfaces[rows, cols, 2:4]
    submap.pack()
    after = submap.surfaces
    cells = after.T_grid_map.transform(places) / after.resolution
    col, row = cells.astype(np.int64).T
    assert len(places) > 100
    assert np.mean(after.surfaces[row, col, 4] == 2.0) > 0.98
    assert np.mean(np.sum(after.surfaces[row, col, 2:4] * normals, axis=1) > 0.98) > 0.98


def test_a_place_behind_a_wall_is_not_in_sight(submap: Submap) -> None:
    assert submap.in_sight(SE2(0.4, 0.3), 1.0)
    assert not submap.in_sight(NEXT_DOOR, 2.0)
    assert not submap.in_sight(SE2(0.4, 0.3), 0.1)


def test_a_scan_of_the_lane_next_door_sees_the_wall_from_behind(submap: Submap, lanes: Any) -> None:
    assert submap.agreement(SE2(0.1, 0.2), scan(lanes, SE2(0.1, 0.2))).behind < 0.02
    assert submap.agreement(NEXT_DOOR, scan(lanes, NEXT_DOOR)).behind > 0.3


@pytest.mark.parametrize(("true", "recognised"), [(SE2(0.2, 0.25, 0.3), True), (NEXT_DOOR, False)])
def test_only_what_the_submap_has_seen_is_recognised(submap: Submap, lanes: Any, true: SE2, recognised: bool) -> None:
    covariance = np.diag([0.05, 0.05, 0.02]) ** 2
    found = recognise(LoopClosing(near=2.0), submap, None, scan(lanes, true, 9), (true @ SE2(0.03, -0.02, 0.01), covariance))
    assert (found is not None) == recognised
    if found is not None:
        error = true.inverse() @ found.T_submap_base
        assert np.hypot(error.x, error.y) < 0.02
        assert abs(error.yaw) < 0.01


def test_a_scan_that_only_shows_what_is_seen_does_not_widen_the_submap(lanes: Any, submap: Submap) -> None:
    travelled, pose = submap.travelled, SE2(0.0, 1.5)
    cloud = scan(lanes, pose, 20)
    points, origins = cloud.points.astype(np.float32), cloud.origins.astype(np.float32)
    submap.keep(Keyframe(cloud.stamp, pose, points, origins, widens=False))
    assert submap.travelled == travelled
    assert submap.outside(pose) == pytest.approx(1.0)
    assert not submap.is_new(pose, KeyframeGate(0.1, 0.1))
