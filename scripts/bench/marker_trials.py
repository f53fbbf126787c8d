"""Rows of `twin bench markers` about many seeds, blur, darkness, and markers that deceive."""

from __future__ import annotations

import dataclasses
import math
import statistics
from dataclasses import dataclass

import cv2
import numpy as np

from scripts.bench.marker_lap import Lap
from scripts.bench.marker_scenes import MOUNT, MarkerScene, map_errors, true_map
from scripts.bench.row import Row
from scripts.experiments.arena import rmse
from scripts.processes import spread
from slam.landmarks.marker_bundle import Prior
from slam.landmarks.marker_graph import MarkerGraph, MarkerGraphSettings
from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.landmarks.sighting import Sighting
from slam.messages import SensorFrame
from slam.motion.motion_noise import MotionNoise
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

WORLD = "aruco_room"
SEEDS = 20
STREAK = 5
"""Length of the motion blur [px]."""
DARK = 15.0, 23.0
"""While nothing is seen: from, to [s]; the tour is driven at 0.25 m/s."""
LOCKED = 0.01
"""Error with which the robot is found again [m]."""
WRONG_IDS = 0.2


@dataclass(frozen=True)
class Mapping:
    """A drive in which a map is made."""

    seconds: float
    seed: int


@dataclass(frozen=True)
class Mapped:
    """How good the map is."""

    rms: float
    """[m]"""
    worst: float
    """[m]"""
    rotation: float
    """Median [rad]."""
    flipped: int
    chain: float
    """RMS of the chain's map [m]."""
    wrong: float
    """Share of the frames with a wrong branch."""
    alarms: int


def trial_rows(seconds: float, smoke: bool) -> list[Row]:
    """All rows."""
    work = [Mapping(seconds, seed) for seed in range(1, 2 if smoke else SEEDS + 1)]
    return [
        *_seed_rows(list(spread(mapped, work, 1 if smoke else 0))),
        *_blur_rows(seconds),
        *_dark_rows(seconds),
        *_liar_rows(30 if smoke else 180),
    ]


def mapped(mapping: Mapping) -> Mapped:
    """Make a map, by `visual_slam` and by the chain from the same sightings."""
    cv2.setNumThreads(1)
    lap, true = Lap.driven(WORLD, (mapping.seconds, mapping.seed)), true_map(WORLD)
    off, turned = map_errors(_map_of(lap), true)
    alarms = len(lap.pipeline.graph.alarms) if lap.pipeline.graph else 0
    chain = rmse(map_errors(lap.chain.map("chain"), true)[0])
    return Mapped(rmse(off), float(off.max()), float(np.median(turned)), int((turned > 0.2).sum()), chain, lap.wrong(), alarms)


def _seed_rows(found: list[Mapped]) -> list[Row]:
    best, chain = statistics.median(m.rms for m in found), statistics.median(m.chain for m in found)
    what = f"marker map, {len(found)} seeds"
    return [
        Row("markers", f"{what}: RMS, median", 1e3 * best, "mm", "≤ 2", "chain", 1e3 * chain, chain / best),
        Row("markers", f"{what}: worst marker, median", 1e3 * statistics.median(m.worst for m in found), "mm", "≤ 6"),
        Row("markers", f"{what}: worst marker of all", 1e3 * max(m.worst for m in found), "mm"),
        Row("markers", f"{what}: rotation, median", float(np.degrees(statistics.median(m.rotation for m in found))), "deg", "≤ 0.15"),
        Row("markers", f"{what}: flipped markers", sum(m.flipped for m in found), "", "0"),
        Row("markers", f"{what}: false alarms", sum(m.alarms for m in found), "", "0"),
        Row("markers", f"{what}: frames with a wrong branch", 100.0 * statistics.mean(m.wrong for m in found), "%", "≤ 0.01"),
    ]


def streaked(frame: SensorFrame) -> SensorFrame:
    """The frame with images smeared along their rows."""
    kernel = np.full((1, STREAK), 1.0 / STREAK)
    images = [dataclasses.replace(image, colour=cv2.filter2D(image.colour, -1, kernel).astype(np.uint8)) for image in frame.images]
    return dataclasses.replace(frame, images=tuple(images))


def darkened(frame: SensorFrame) -> SensorFrame:
    """The frame, for a while with black images."""
    if not DARK[0] <= frame.stamp < DARK[1]:
        return frame
    return dataclasses.replace(frame, images=tuple(dataclasses.replace(i, colour=np.zeros_like(i.colour)) for i in frame.images))


def _blur_rows(seconds: float) -> list[Row]:
    off, _ = map_errors(_map_of(Lap.driven(WORLD, (seconds, 4), keep=streaked)), true_map(WORLD))
    return [Row("markers", f"motion blur of {STREAK} px, marker map, RMS", 1e3 * rmse(off), "mm", "≤ 6")]


def _dark_rows(seconds: float) -> list[Row]:
    """No marker for 2 m, in a known map."""
    lap = Lap.driven(WORLD, (max(min(seconds, 30.0), 3.0), 6), true_map(WORLD), darkened)
    stamps, off = lap.truth.stamps, lap.errors(SE2())[0]
    dark = (stamps >= DARK[0]) & (stamps < DARK[1])
    if not dark.any():
        return []
    first, last = np.flatnonzero(dark)[[0, -1]]
    poses = [[SE2.from_array(path.poses[k]) for k in (first, last)] for path in (lap.truth, lap.estimate, lap.odometry)]
    true, found, wheels = (before.inverse() @ after for before, after in poses)
    ours, theirs = (float(np.hypot(step.x - true.x, step.y - true.y)) for step in (found, wheels))
    again = last + 1 + int(np.argmax(off[last + 1 :] < LOCKED))
    way = float(np.hypot(*np.diff(lap.truth.poses[dark, :2], axis=0).T).sum())
    return [
        Row("markers", f"no marker for {way:.1f} m: error at its end", 1e3 * ours, "mm", "", "odometry", 1e3 * theirs, theirs / ours),
        Row("markers", "images until the robot is found again", sum(lap.images[last + 1 : again + 1]), "", "1"),
    ]


def _liar_rows(poses: int) -> list[Row]:
    """Sightings with wrong ids, and a marker that moves."""
    scene, rng = MarkerScene(count=24), np.random.default_rng(7)
    path = scene.path(poses, poses / 90.0)
    seen = [scene.sightings(pose, rng) for pose in path]
    liars = [[_mistaken(s, scene.count, rng) for s in frame] for frame in seen]
    off = map_errors(driven(scene, path, liars)[0].map("d"), scene.truth())[0]
    marker = scene.truth().markers[3]
    elsewhere = dataclasses.replace(marker, T_map_marker=SE3(np.eye(3), np.array([0.0, 0.15, 0.1])) @ marker.T_map_marker)
    after = MarkerMap.of([*(m for k, m in scene.truth().markers.items() if k != 3), elsewhere], "d")
    moved, alarm = driven(scene, [*path, *path], [*seen, *(scene.sightings(pose, rng, after) for pose in path)], marker, len(path))
    p95, worst = 1e3 * float(np.percentile(off, 95)), 1e3 * float(np.percentile(map_errors(moved.map("d"), after)[0], 95))
    return [
        Row("markers", f"{100 * WRONG_IDS:.0f} % wrong ids: marker map, p95", p95, "mm", "≤ 5"),
        Row("markers", "a marker that moves: marker map, p95", worst, "mm", "≤ 5"),
        Row("markers", "a marker that moves: frames that show it until the alarm", alarm, "", "≤ 5"),
    ]


def driven(
    scene: MarkerScene, path: list[SE2], seen: list[list[Sighting]], watched: MappedMarker | None = None, since: int = 0
) -> tuple[MarkerGraph, float]:
    """The loop of `visual_slam`, every image a keyframe; and how many frames from `since` on show a marker until an alarm names it.

    It is nan if none does.
    """
    graph, noise, shown, alarm = MarkerGraph(MarkerGraphSettings(), MOUNT, MotionNoise()), MotionNoise(), 0, 0
    pose, covariance = path[0], np.eye(3) * 1e-10
    steps = [SE2(), *scene.steps(path, np.random.default_rng(3))]
    for number, (step, frame) in enumerate(zip(steps, seen, strict=True)):
        once = [s for s in frame if [other.id for other in frame].count(s.id) == 1]
        covariance, pose = noise.propagate(covariance, pose, step), pose @ step
        pose, covariance, fitting = _located(graph, once, pose, covariance)
        if graph.add(pose, covariance, step, fitting):
            pose, covariance = graph.keyframes[-1].T_map_base, graph.keyframes[-1].covariance
        if watched is not None and number >= since and not alarm:
            shown += any(s.id == watched.id for s in frame)
            alarm = shown if watched.id in graph.alarms else 0
    graph.batch(30)
    return graph, alarm or math.nan


def _located(graph: MarkerGraph, sightings: list[Sighting], pose: SE2, covariance: FloatArray) -> tuple[SE2, FloatArray, list[Sighting]]:
    known = graph.known.known(sightings)
    if not known:
        return pose, covariance, sightings
    found = graph.known.locate(known, Prior(pose.as_array(), np.linalg.inv(covariance + np.eye(3) * 1e-10)))
    graph.watch(known, found)
    misfits = {s.id for s, fits in zip(known, found.fits.tolist(), strict=True) if not fits}
    place = (found.T_map_base, found.covariance) if found.believable else (pose, covariance)
    return *place, [s for s in sightings if s.id not in misfits]


def _mistaken(sighting: Sighting, count: int, rng: np.random.Generator) -> Sighting:
    return dataclasses.replace(sighting, id=int(rng.integers(count))) if rng.random() < WRONG_IDS else sighting


def _map_of(lap: Lap) -> MarkerMap:
    return lap.pipeline.marker_map() or MarkerMap.of((), "none")
