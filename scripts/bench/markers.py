"""`twin bench markers`: corners, marker maps and localisation in them, against OpenCV's corners and the report's chain."""

from __future__ import annotations

import time

import cv2
import numpy as np

from scripts.bench.marker_corners import corner_rows
from scripts.bench.marker_lap import Lap
from scripts.bench.marker_photographs import photograph_rows
from scripts.bench.marker_scenes import MOUNT, MarkerScene, map_errors, true_map
from scripts.bench.marker_trials import trial_rows
from scripts.bench.row import Row
from scripts.experiments.arena import rmse
from scripts.runs.metrics import aligned_errors
from slam.landmarks.marker_graph import MarkerGraph, MarkerGraphSettings
from slam.landmarks.marker_map import MarkerMap
from slam.motion.motion_noise import MotionNoise
from slam.se2 import SE2

WORLD, SPARSE = "aruco_room", "aruco_room:spacing=1.5"


def run(smoke: bool) -> list[Row]:
    """All rows; without `smoke` an hour, most of it drives of 60 s shared among the processors."""
    seconds = 3.0 if smoke else 60.0
    cv2.setNumThreads(1)
    mapping = Lap.driven(WORLD, (seconds, 1))
    found = mapping.pipeline.marker_map()
    assert found is not None
    return [
        *corner_rows(seconds / 3.0, smoke),
        *_map_rows(mapping, found),
        *_place_rows(mapping, found, (seconds, smoke)),
        *_sparse_rows(seconds),
        *trial_rows(seconds, smoke),
        *_keyframe_rows(60 if smoke else 1000),
        *photograph_rows(),
    ]


def _map_rows(lap: Lap, found: MarkerMap) -> list[Row]:
    true = true_map(WORLD)
    off, turned = map_errors(found, true)
    chained, _ = map_errors(lap.chain.map("chain"), true)
    errors = aligned_errors(lap.truth, lap.estimate).errors
    best, worst, name = rmse(off), rmse(chained), f"marker map after 60 s, RMS of {len(off)} markers"
    return [
        Row(
            "markers",
            name,
            1e3 * best,
            "mm",
            "≤ 2",
            "chain",
            1e3 * worst,
            worst / best,
        ),
        Row("markers", "marker map, worst", 1e3 * float(off.max()), "mm", "≤ 6"),
        Row("markers", "marker map, rotation, median", float(np.degrees(np.median(turned))), "deg", "≤ 0.15"),
        Row("markers", "marker map, flipped", float((turned > 0.2).sum()), "", "0"),
        Row("markers", "position while mapping, RMS", 1e3 * rmse(errors.translation), "mm", "≤ 3"),
        Row("markers", "heading while mapping, RMS", float(np.degrees(rmse(errors.heading))), "deg", "≤ 0.1"),
    ]


def _place_rows(mapping: Lap, own: MarkerMap, length: tuple[float, bool]) -> list[Row]:
    (seconds, smoke), rows = length, list[Row]()
    T_world_own = aligned_errors(mapping.truth, mapping.estimate).T_truth_estimate
    for name, given, place, reach in (
        ("the true map", true_map(WORLD), SE2(), ("≤ 1", "≤ 3")),
        ("its own map of another run", own, T_world_own, ("≤ 2", "≤ 5")),
    ):
        lap = Lap.driven(WORLD, (seconds, 3), given)
        seen = np.array(lap.markers) >= 5
        errors = aligned_errors(lap.truth, lap.estimate, place).errors.translation[seen]
        middle, far = (1e3 * float(value) for value in np.percentile(errors, [50, 95])) if seen.any() else (np.nan, np.nan)
        rows += [
            Row("markers", f"localisation in {name}, 5 markers and more in view, median", middle, "mm", reach[0]),
            Row("markers", f"localisation in {name}, 5 markers and more in view, p95", far, "mm", reach[1]),
        ]
        if smoke:
            break
    return rows


def _sparse_rows(seconds: float) -> list[Row]:
    lap = Lap.driven(SPARSE, (seconds, 2))
    errors = aligned_errors(lap.truth, lap.estimate).errors.translation
    steps = np.diff(lap.estimate.poses[:, :2], axis=0) - np.diff(lap.truth.poses[:, :2], axis=0)
    return [
        Row("markers", "sparse room, markers every 1.5 m, position while mapping, RMS", 1e3 * rmse(errors), "mm", "≤ 20"),
        Row("markers", "sparse room, farthest jump", 1e3 * float(np.hypot(*steps.T).max()), "mm", "≤ 30"),
    ]


def _keyframe_rows(count: int) -> list[Row]:
    """Update times with as many keyframes, five laps round 40 markers."""
    scene, rng = MarkerScene(), np.random.default_rng(0)
    path = scene.path(count, 5.0)
    steps = [SE2(), *scene.steps(path, rng)]
    graph, times = MarkerGraph(MarkerGraphSettings(), MOUNT, MotionNoise()), []
    for pose, step in zip(path, steps, strict=True):
        sightings = scene.sightings(pose, rng)
        began = time.thread_time()
        graph.add(pose, np.eye(3) * 1e-7, step, sightings)
        times.append(1e3 * (time.thread_time() - began))
    late = np.array(times[len(times) // 2 :])
    began = time.thread_time()
    graph.batch(30)
    name = f"keyframe update, the second half of {count} keyframes x 40 markers"
    return [
        Row("markers", f"{name}, median", float(np.median(late)), "ms", "≤ 2"),
        Row("markers", f"{name}, p95", float(np.percentile(late, 95)), "ms", "≤ 10"),
        Row("markers", f"{name}, longest (a batch)", float(late.max()), "ms"),
        Row("markers", f"last batch of {count} keyframes", time.thread_time() - began, "s"),
    ]
