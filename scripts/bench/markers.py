"""`twin bench markers`: corners, marker maps and localisation in them, against OpenCV's corners and the report's chain."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import cv2
import numpy as np

from scripts.bench.marker_photographs import photograph_rows
from scripts.bench.marker_scenes import MOUNT, MarkerScene, map_errors
from scripts.bench.row import Row
from scripts.experiments.drive import Course
from scripts.runs.metrics import aligned_errors
from sim.ground_truth import ground_truth
from slam.kernels.corner_fit import fit_corners
from slam.landmarks.marker_chain import MarkerChain
from slam.landmarks.marker_corners import CornerMethod, lens_of
from slam.landmarks.marker_graph import MarkerGraph, MarkerGraphSettings
from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.landmarks.markers import MarkerDetector, Markers
from slam.mapping.visual_slam import VisualSlam, VisualSlamPipeline
from slam.messages import RgbdImage, SensorFrame, Trajectory
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.motion_noise import MotionNoise
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3
from worlds.loader import load_world

WORLD, SPARSE = "aruco_room", "aruco_room:spacing=1.5"
LARGE = 30.0
"""Mean side of the markers whose corners are judged [px]."""
PEERS: tuple[CornerMethod, ...] = ("subpix", "apriltag")


def run(smoke: bool) -> list[Row]:
    """Rows: two laps in the aruco_room, one in a sparse one."""
    seconds = 3.0 if smoke else 60.0
    cv2.setNumThreads(1)
    shots = _Shots.taken(seconds / 3.0)
    mapping = _Lap.driven(WORLD, seconds, 1)
    found = mapping.pipeline.marker_map()
    assert found is not None
    return [
        *_corner_rows(shots),
        *_speed_rows(shots, 5 if smoke else 40),
        *_map_rows(mapping, found),
        *_place_rows(mapping, found, (seconds, smoke)),
        *_sparse_rows(seconds),
        *_keyframe_rows(60 if smoke else 1000),
        *photograph_rows(),
    ]


@dataclass(eq=False)
class _Shots:
    """Images with the true corners."""

    images: list[RgbdImage] = field(default_factory=list[RgbdImage])
    twists: list[FloatArray] = field(default_factory=list[FloatArray])
    corners: list[dict[int, FloatArray]] = field(default_factory=list[dict[int, FloatArray]])

    @classmethod
    def taken(cls, seconds: float) -> _Shots:
        """Every third image of a drive with the errors of the data sheet."""
        shots, motion, course, count = cls(), DeadReckoning(), Course(WORLD, seconds, 5, camera="raster"), 0
        with course.body() as robot:
            truth = ground_truth(robot)
            for frame in course.follow(robot, truth):
                motion.add(frame.odometry, frame.imu)
                for image in frame.images:
                    count += 1
                    if count % 3 == 0:
                        shots.images.append(image)
                        shots.twists.append((motion.pose_at(image.stamp - 0.02).inverse() @ motion.pose_at(image.stamp)).log() / 0.02)
                        shots.corners.append(truth.camera().markers(image.stamp))
        return shots

    def errors(self, detector: MarkerDetector) -> FloatArray:
        """Found less true corners (N, 4, 2) [px] of the markers that are large enough."""
        errors: list[FloatArray] = []
        for image, twist, corners in zip(self.images, self.twists, self.corners, strict=True):
            sightings = detector.detect(image.colour, image.colour_info, twist).sightings
            errors += [s.pixels - corners[s.id] for s in sightings if s.side >= LARGE and s.id in corners]
        return np.array(errors).reshape(-1, 4, 2)


def _corner_rows(shots: _Shots) -> list[Row]:
    errors = shots.errors(Markers().build())
    rms, name = _rms(errors), f"corner RMS, data sheet's errors, driving, {len(errors)} markers of {LARGE:g} px and more"
    rows = [Row("markers", "corner bias", float(np.abs(errors.mean(axis=(0, 1))).max()), "px", "<= 0.01")]
    for method in PEERS:
        peer = _rms(shots.errors(Markers(corners=method).build()))
        rows.append(Row("markers", name, rms, "px", "<= 0.12", f"OpenCV {method}", peer, peer / rms))
    return rows


def _speed_rows(shots: _Shots, most: int) -> list[Row]:
    chosen = [k for k, corners in enumerate(shots.corners) if 6 <= len(corners) <= 10][:most]
    detector = Markers(quick=True).build()
    whole, fit, count = [], [], []
    for k in [*chosen[:1], *chosen]:
        image = shots.images[k]
        began = time.thread_time()
        sightings = detector.detect(image.colour, image.colour_info, shots.twists[k]).sightings
        whole.append(time.thread_time() - began)
        grey, corners = cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY), np.array([s.pixels for s in sightings]).reshape(-1, 4, 2)
        began = time.thread_time()
        fit_corners(grey, corners, np.full(len(corners), 8.0), lens_of(image.colour_info))
        fit.append((time.thread_time() - began) / max(len(corners), 1))
        count.append(len(sightings))
    name = f"detect, fit and both poses, 848 x 480, {np.mean(count or [0]):.1f} markers, one core"
    return [
        Row("markers", name, 1e3 * float(np.median(whole[1:] or [np.nan])), "ms", "<= 4"),
        Row("markers", "line fit of one marker", 1e6 * float(np.median(fit[1:] or [np.nan])), "us", "<= 80"),
    ]


@dataclass(eq=False)
class _Lap:
    """A drive that `visual_slam` followed, with the chain beside it; images are not kept."""

    pipeline: VisualSlamPipeline
    chain: MarkerChain
    truth: Trajectory
    estimate: Trajectory
    markers: list[int]
    """Seen in the newest image, at every frame."""

    @classmethod
    def driven(cls, world: str, seconds: float, seed: int, given: MarkerMap | None = None) -> _Lap:
        """Map a world, or localise in a map of it from an unknown start."""
        pipeline = VisualSlamPipeline(VisualSlam(), None if given else SE2(*load_world(world).start), given)
        lap = cls(pipeline, MarkerChain(), *[Trajectory(np.empty(0), np.empty((0, 3)))] * 2, [])
        course = Course(world, seconds, seed, camera="raster")
        stamps: list[float] = []
        found: list[FloatArray] = []
        true: list[FloatArray] = []
        with course.body() as robot:
            truth = ground_truth(robot)
            for frame in course.follow(robot, truth):
                lap._take(frame)
                stamps.append(frame.stamp)
                found.append(lap._last.as_array())
                true.append(truth.pose(frame.stamp).as_array())
        pipeline.finish()
        lap.truth, lap.estimate = Trajectory(np.array(stamps), np.array(true)), Trajectory(np.array(stamps), np.array(found))
        return lap

    def _take(self, frame: SensorFrame) -> None:
        self._last = self.pipeline.update(frame).T_map_base
        detection = self.pipeline.detection
        self.markers.append(len(detection.sightings) if detection else -1)
        if frame.images and detection is not None:
            self.chain.update(detection.sightings)


def _map_rows(lap: _Lap, found: MarkerMap) -> list[Row]:
    true = true_map(WORLD)
    off, turned = map_errors(found, true)
    chained, _ = map_errors(lap.chain.map("chain"), true)
    errors = aligned_errors(lap.truth, lap.estimate).errors
    best, worst, name = _rms(off), _rms(chained), f"marker map after 60 s, RMS of {len(off)} markers"
    return [
        Row(
            "markers",
            name,
            1e3 * best,
            "mm",
            "<= 2",
            "chain",
            1e3 * worst,
            worst / best,
        ),
        Row("markers", "marker map, worst", 1e3 * float(off.max()), "mm", "<= 6"),
        Row("markers", "marker map, rotation, median", float(np.degrees(np.median(turned))), "deg", "<= 0.15"),
        Row("markers", "marker map, flipped", float((turned > 0.2).sum()), "", "0"),
        Row("markers", "position while mapping, RMS", 1e3 * _rms(errors.translation), "mm", "<= 3"),
        Row("markers", "heading while mapping, RMS", float(np.degrees(_rms(errors.heading))), "deg", "<= 0.1"),
    ]


def _place_rows(mapping: _Lap, own: MarkerMap, length: tuple[float, bool]) -> list[Row]:
    (seconds, smoke), rows = length, list[Row]()
    T_world_own = aligned_errors(mapping.truth, mapping.estimate).T_truth_estimate
    for name, given, place, reach in (
        ("the true map", true_map(WORLD), SE2(), ("<= 1", "<= 3")),
        ("its own map of another run", own, T_world_own, ("<= 2", "<= 5")),
    ):
        lap = _Lap.driven(WORLD, seconds, 3, given)
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
    lap = _Lap.driven(SPARSE, seconds, 2)
    errors = aligned_errors(lap.truth, lap.estimate).errors.translation
    steps = np.diff(lap.estimate.poses[:, :2], axis=0) - np.diff(lap.truth.poses[:, :2], axis=0)
    return [
        Row("markers", "sparse room, markers every 1.5 m, position while mapping, RMS", 1e3 * _rms(errors), "mm", "<= 20"),
        Row("markers", "sparse room, farthest jump", 1e3 * float(np.hypot(*steps.T).max()), "mm", "<= 30"),
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
        Row("markers", f"{name}, median", float(np.median(late)), "ms", "<= 2"),
        Row("markers", f"{name}, p95", float(np.percentile(late, 95)), "ms", "<= 10"),
        Row("markers", f"{name}, longest (a batch)", float(late.max()), "ms"),
        Row("markers", f"last batch of {count} keyframes", time.thread_time() - began, "s"),
    ]


def true_map(world: str) -> MarkerMap:
    """The markers of a world, where they are."""
    known = load_world(world)
    markers: list[MappedMarker] = []
    for marker in known.markers:
        a, b, _, d = marker.corners()
        x, y = (b - a) / marker.size, (a - d) / marker.size
        markers.append(MappedMarker(marker.id, marker.size, SE3(np.column_stack([x, y, np.cross(x, y)]), np.array(marker.position))))
    return MarkerMap.of(markers, known.dictionary)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else float("nan")
