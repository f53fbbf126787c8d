"""Rows of `twin bench markers` about single images: corners, times, and what one marker tells."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import cv2
import numpy as np

from hardware.camera_spec import d435
from hardware.spec import RobotSpec
from scripts.bench.marker_scenes import true_map
from scripts.bench.row import Row
from scripts.experiments.arena import rmse
from scripts.experiments.drive import Course
from sim.ground_truth import ground_truth
from slam.kernels.corner_fit import fit_corners
from slam.landmarks.marker_bundle import Prior
from slam.landmarks.marker_corners import CornerMethod, lens_of
from slam.landmarks.marker_location import UNKNOWN, MarkerField
from slam.landmarks.markers import MarkerDetector, Markers
from slam.landmarks.sighting import Sighting
from slam.messages import RgbdImage
from slam.motion.dead_reckoning import DeadReckoning
from slam.se2 import SE2, FloatArray

WORLD = "aruco_room"
LARGE = 30.0
"""Mean side of the markers whose corners are judged [px]."""
PEERS: tuple[CornerMethod, ...] = ("subpix", "apriltag")
"""OpenCV's, whose corners are compared; its detector's time is, without and with the best of them."""
SIZES = {(640, 480): "≤ 3", (848, 480): "≤ 4", (1280, 720): "≤ 6"}
"""Of images [px], and what is asked of the time [ms]."""
NEAR = 2.0
"""[m]"""


def corner_rows(seconds: float, smoke: bool) -> list[Row]:
    """All rows."""
    shots = Shots.taken(seconds)
    speeds = [row for size, reach in SIZES.items() for row in _speed_rows(Shots.taken(0.5 * seconds, size=size), 5 if smoke else 40, reach)]
    return [*_clean_rows(Shots.taken(0.5 * seconds, "ideal")), *_corner_rows(shots), *speeds, *_lone_rows(shots)]


@dataclass(eq=False)
class Shots:
    """Images with the truth."""

    images: list[RgbdImage] = field(default_factory=list[RgbdImage])
    twists: list[FloatArray] = field(default_factory=list[FloatArray])
    corners: list[dict[int, FloatArray]] = field(default_factory=list[dict[int, FloatArray]])
    poses: list[SE2] = field(default_factory=list[SE2])

    @classmethod
    def taken(cls, seconds: float, realism: str = "datasheet", size: tuple[int, int] = (848, 480)) -> Shots:
        """Every third image of a drive."""
        spec = RobotSpec(camera=d435(size))
        shots, motion, count = cls(), DeadReckoning(), 0
        course = Course(WORLD, seconds, 5, realism=realism, camera="raster", spec=spec)
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
                        shots.poses.append(truth.pose(image.stamp))
        return shots

    def errors(self, detector: MarkerDetector) -> FloatArray:
        """Found less true corners (N, 4, 2) [px] of the markers that are large enough."""
        errors: list[FloatArray] = []
        for image, twist, corners in zip(self.images, self.twists, self.corners, strict=True):
            sightings = detector.detect(image.colour, image.colour_info, twist).sightings
            errors += [s.pixels - corners[s.id] for s in sightings if s.side >= LARGE and s.id in corners]
        return np.array(errors).reshape(-1, 4, 2)


def _clean_rows(shots: Shots) -> list[Row]:
    errors = shots.errors(Markers().build())
    name = f"corner RMS, no errors of the camera, driving, {len(errors)} markers of {LARGE:g} px and more"
    return [Row("markers", name, rmse(errors), "px", "≤ 0.05")]


def _corner_rows(shots: Shots) -> list[Row]:
    errors = shots.errors(Markers().build())
    rms, name = rmse(errors), f"corner RMS, data sheet's errors, driving, {len(errors)} markers of {LARGE:g} px and more"
    rows = [Row("markers", "corner bias", float(np.abs(errors.mean(axis=(0, 1))).max()), "px", "≤ 0.01")]
    for method in PEERS:
        peer = rmse(shots.errors(Markers(corners=method).build()))
        rows.append(Row("markers", name, rms, "px", "≤ 0.12", f"OpenCV {method}", peer, peer / rms))
    return rows


def _speed_rows(shots: Shots, most: int, reach: str) -> list[Row]:
    chosen = [k for k, corners in enumerate(shots.corners) if 6 <= len(corners) <= 10][:most]
    detector = Markers(quick=True).build()
    theirs: dict[CornerMethod, MarkerDetector] = {"none": Markers(corners="none").build(), "apriltag": Markers(corners="apriltag").build()}
    took: dict[str, list[float]] = {"ours": [], **{method: [] for method in theirs}}
    fit, count = list[float](), list[int]()
    for k in [*chosen[:1], *chosen]:
        image = shots.images[k]
        for method, peer in theirs.items():
            took[method].append(_seconds(peer, shots, k)[0])
        spent, sightings = _seconds(detector, shots, k)
        took["ours"].append(spent)
        grey, corners = cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY), np.array([s.pixels for s in sightings]).reshape(-1, 4, 2)
        began = time.thread_time()
        fit_corners(grey, corners, np.full(len(corners), 8.0), lens_of(image.colour_info))
        fit.append((time.thread_time() - began) / max(len(corners), 1))
        count.append(len(sightings))
    camera = shots.images[0].colour_info
    size = f"{camera.width} x {camera.height}"
    name = f"detect, fit and both poses, {size}, {np.mean(count or [0]):.1f} markers, one core"
    ms = {method: 1e3 * float(np.median(seconds[1:] or [np.nan])) for method, seconds in took.items()}
    return [
        *(Row("markers", name, ms["ours"], "ms", reach, f"OpenCV {peer}", ms[peer], ms[peer] / ms["ours"]) for peer in theirs),
        Row("markers", f"line fit of one marker, {size}", 1e6 * float(np.median(fit[1:] or [np.nan])), "µs", "≤ 80"),
    ]


def _seconds(detector: MarkerDetector, shots: Shots, k: int) -> tuple[float, tuple[Sighting, ...]]:
    """Processor time of an image, and what it shows."""
    image, began = shots.images[k], time.thread_time()
    sightings = detector.detect(image.colour, image.colour_info, shots.twists[k]).sightings
    return time.thread_time() - began, sightings


def _lone_rows(shots: Shots) -> list[Row]:
    """The pose by every near marker alone, in the true map, near the true pose."""
    known, detector, errors = true_map(WORLD), Markers(quick=True).build(), list[float]()
    room = MarkerField.empty(shots.images[0].colour_info.T_base_camera)
    for marker in known.markers.values():
        room.put(marker.id, marker.T_map_marker, np.zeros((6, 6)))
    for image, twist, pose in zip(shots.images, shots.twists, shots.poses, strict=True):
        for sighting in detector.detect(image.colour, image.colour_info, twist).sightings:
            if np.linalg.norm(sighting.branches[0].t) < NEAR:
                found = room.locate([sighting], Prior(pose.as_array(), UNKNOWN)).T_map_base
                errors.append(float(np.hypot(found.x - pose.x, found.y - pose.y)))
    middle = 1e3 * float(np.median(errors or [np.nan]))
    return [Row("markers", f"one marker within {NEAR:g} m alone, {len(errors)} times: position, median", middle, "mm", "≤ 7")]
