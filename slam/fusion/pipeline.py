"""The `fusion` pipeline: one fixed-lag estimate of what wheels, gyro, scans, markers and visual odometry say, as many as there are.

`lidar_slam` and `visual_slam` make their maps as ever. What their scans and markers say of the robot's place, and what camera, wheels and
gyro say of its steps, are the factors of one smoother. The map is the lidar's; where the marker map lies in it is an unknown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from slam.errors import require_not_negative, require_positive
from slam.fusion.places import LidarPlaces, Place, marker_place
from slam.fusion.smoother import Smoother, library
from slam.landmarks.marker_map import MarkerMap
from slam.mapping.grid_mapper import FULL
from slam.mapping.lidar_slam import LidarSlam
from slam.mapping.submap_path import SubmapPath
from slam.mapping.visual_slam import VisualSlam
from slam.messages import Estimate, SensorFrame, Status, Trajectory
from slam.motion.ego_motion import EgoMotion
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3
from slam.snapshot import Snapshot

RECENT = 0.5
"""So long what has told of the pose counts [s]."""
UNKNOWN = np.array([0.5, 0.2, 1.0])
"""Standard deviation of (v_x, v_y, omega) from node to node where nothing tells of the step [m/s, rad/s]."""
SCALE = 0.03
"""Error of a step of a few hundredths of a second, as a share of it: it is not random."""
LEAST = 1e-8
"""Variance of any step [m^2, rad^2]."""


@dataclass(frozen=True, slots=True)
class Fusion:
    """All sensors in one estimate."""

    lidar: LidarSlam = field(default_factory=LidarSlam)
    visual: VisualSlam = field(default_factory=VisualSlam)
    noise: MotionNoise = field(default_factory=MotionNoise)
    lag: float = 2.0
    """Length of the window [s]."""
    spacing: float = 0.05
    """Least time between two poses in it [s]."""
    loss: float = 3.0
    """Deviations at which a place that a sensor reports counts half."""
    map_error: tuple[float, float, float] = (0.003, 0.003, 0.002)
    """Standard deviation of what the lidar's map is wrong by at any one place: x, y [m], yaw [rad]; markers know that of their own."""
    drift: float = 1e-4
    """Standard deviation by which the marker map drifts in the lidar's for a metre and a radian [m, rad]."""

    def __post_init__(self) -> None:
        require_positive(self, "lag", "spacing", "loss")
        require_not_negative(self, "drift")

    def build(self, T_map_base: SE2 | None = None) -> FusionPipeline:
        """Make the pipeline; the robot starts at `T_map_base`, the origin by default.

        Raises:
            FusionLibraryError: GTSAM is not installed.
            MarkerMapError: the marker map of `visual` cannot be read, or is of another dictionary.
        """
        library()
        return FusionPipeline(self, T_map_base or SE2())


class FusionPipeline:
    """Holds the smoother in a frame of its own, which moves in the map when the lidar's map is put right."""

    def __init__(self, settings: Fusion, T_map_base: SE2) -> None:
        self._settings = settings
        self.lidar = settings.lidar.build(T_map_base)
        self.visual = settings.visual.build(T_map_base)
        self._places = LidarPlaces(self.lidar)
        self._ego = EgoMotion(settings.lidar.tracking.unveil, T_map_base)
        self._watch = SensorWatch(images=True)
        self._smoother: Smoother | None = None
        self._start = T_map_base
        self._covariance: FloatArray = np.zeros((3, 3))  # of the newest pose
        self._heard = {"lidar": -math.inf, "markers": -math.inf}
        self._imaged = -math.inf
        self._marked = -math.inf  # time of the pose from which on the camera is asked for the next step
        self._markers = 0
        self._scan_path, self._image_path = SubmapPath(), ScanTrajectory()
        self._finished = False

    def update(self, frame: SensorFrame) -> Estimate:
        """Hear all sensors, smooth what they say, and answer with the pose at the frame's time."""
        self._ego.hear(frame)
        self.lidar_estimate = self.lidar.update(replace(frame, images=(), available=frame.available - {"images"}))
        self.visual_estimate = self.visual.update(replace(frame, scans=(), available=frame.available - {"scans"}))
        if frame.images or frame.scans:
            self._finished = False
            self._fuse(frame)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The lidar's map, without a lidar a blank one, and the poses at scans, else at images."""
        shown = self.lidar.snapshot()
        if self._finished and self._markers == 0 and len(self._scan_path):
            return shown  # polished: it knows more where the lidar alone told of places
        return replace(shown, trajectory=self._trajectory())

    def marker_map(self) -> MarkerMap | None:
        """The markers so far in the pipeline's map; None before the first image."""
        found, smoother = self.visual.marker_map(), self._smoother
        if found is None or smoother is None:
            return None
        return found.moved(SE3.from_se2(self._places.T_map_frame @ smoother.T_map_other))

    def finish(self) -> None:
        """Polish the maps."""
        self.lidar.finish()
        self.visual.finish()
        self._finished = True

    def _trajectory(self) -> Trajectory:
        return self._scan_path.trajectory(self.lidar.submaps.all) if len(self._scan_path) else self._image_path.trajectory()

    def _fuse(self, frame: SensorFrame) -> None:
        image = max((image.stamp for image in frame.images), default=-math.inf)
        scan = max((scan.stamp for scan in frame.scans), default=-math.inf)
        smoother = self._smoother or self._begun(max(image, scan))
        self._imaged = max(self._imaged, image)
        newest = smoother.stamps[smoother.newest]
        if image > newest + self._settings.spacing:
            self._advance(smoother, image, by_camera=True)
        elif scan > max(newest + self._settings.spacing, self._imaged + RECENT):
            self._advance(smoother, scan, by_camera=False)
        self._take(smoother, scan)
        smoother.solve()
        self._covariance = smoother.covariance()
        self._ego.settle(smoother.stamps[smoother.newest], smoother.pose(smoother.newest))
        self._remember(smoother, scan, image)

    def _begun(self, stamp: float) -> Smoother:
        T = self._ego.at(stamp)
        self._smoother = Smoother(self._settings.lag, self._settings.loss, T, stamp)
        self._ego.settle(stamp, T)
        return self._smoother

    def _advance(self, smoother: Smoother, stamp: float, *, by_camera: bool) -> None:
        """Add a pose at a time [s], one step on."""
        newest, motion = smoother.stamps[smoother.newest], self.visual.motion
        step, covariance = self._onward(stamp)
        if by_camera and motion.stamp == stamp:
            told, marked, self._marked = motion.told("fusion"), self._marked, stamp
            if told is not None and marked == newest:
                step, covariance = told.step, np.asarray(np.linalg.inv(told.information), np.float64)
        smoother.step(stamp, step, covariance)

    def _onward(self, stamp: float) -> tuple[SE2, FloatArray]:
        """The step from the newest pose to a time [s], however long ago that was, and its covariance (3, 3)."""
        if not self._ego.wheels_cover(stamp):
            return self._ego.step(stamp), np.diag((UNKNOWN * max(self._ego.since(stamp), 0.0)) ** 2 + LEAST)
        step = self.visual.motion.scales.corrected(self._ego.step(stamp))
        return step, self._settings.noise.covariance(step) + np.eye(3) * LEAST

    def _stepped(self, start: float, end: float) -> tuple[SE2, FloatArray]:
        """The step between two times [s] by wheels and gyro, without them at the last velocity, and its covariance (3, 3)."""
        if self._ego.wheels_cover(end):
            step = self._ego.motion.pose_at(start).inverse() @ self._ego.motion.pose_at(end)
            corrected = self.visual.motion.scales.corrected(step)
            return corrected, self._settings.noise.covariance(corrected) + np.eye(3) * LEAST
        step = SE2.exp(self._ego.twist(end) * (end - start))
        return step, np.diag((UNKNOWN * (end - start)) ** 2 + LEAST)

    def _take(self, smoother: Smoother, scan: float) -> None:
        """Take in what scans and markers say of the robot's place."""
        shared = self._settings.lag / self._settings.spacing  # places of one window are found in one map, whose errors they share
        lidar = self._places.newest(scan, lambda stamp: self._predicted(smoother, stamp), self._stepped)
        if lidar is not None:
            self._heard["lidar"] = lidar.stamp
            node, at = self._at_node(smoother, lidar)
            smoother.place(node, at.T_map_base, (at.covariance + np.diag(np.square(self._settings.map_error))) * shared)
        markers = marker_place(self.visual, self._heard["markers"])
        if markers is not None:
            self._heard["markers"], self._markers = markers.stamp, self._markers + 1
            if self._heard["lidar"] > markers.stamp - RECENT:
                smoother.drift(self._settings.drift**2, 0.5)
            node, at = self._at_node(smoother, markers)
            smoother.place_in_other(node, at.T_map_base, at.covariance * shared)

    def _at_node(self, smoother: Smoother, place: Place) -> tuple[int, Place]:
        """The pose in the window that is nearest in time, and the place carried there."""
        node = min(smoother.stamps, key=lambda n: abs(smoother.stamps[n] - place.stamp))
        stamp = smoother.stamps[node]
        step = self._stepped(place.stamp, stamp)[0] if stamp >= place.stamp else self._stepped(stamp, place.stamp)[0].inverse()
        return node, place.carried(stamp, step, np.diag((SCALE * np.array([step.x, step.x, step.yaw])) ** 2))

    def _predicted(self, smoother: Smoother, stamp: float) -> SE2:
        """Where the smoother has the robot at a time [s]."""
        node = min(smoother.stamps, key=lambda n: abs(smoother.stamps[n] - stamp))
        at, pose = smoother.stamps[node], smoother.pose(node)
        return pose @ self._stepped(at, stamp)[0] if stamp >= at else pose @ self._stepped(stamp, at)[0].inverse()

    def _remember(self, smoother: Smoother, scan: float, image: float) -> None:
        if scan > -math.inf and len(self.lidar.submaps):
            T_map_base = self._places.T_map_frame @ self._predicted(smoother, scan)
            submap = self.lidar.submaps[self._places.submap]
            self._scan_path.append(scan, self._places.submap, submap.T_map_submap.inverse() @ T_map_base)
        if image > -math.inf:
            self._image_path.append(image, self._places.T_map_frame @ self._predicted(smoother, image))

    def _estimate(self, frame: SensorFrame) -> Estimate:
        pose = self._smoother.pose(self._smoother.newest) if self._smoother else self._start
        place = Place(frame.stamp, pose, self._covariance).carried(frame.stamp, *self._onward(frame.stamp)).moved(self._places.T_map_frame)
        pose, covariance = place.T_map_base, place.covariance
        sources, reason = self._sources(frame), self._reason(frame)
        lost = not sources and self._smoother is not None
        reason = reason or ("nothing tells of the pose" if lost else "")
        status = Status.LOST if lost else Status.DEGRADED if reason else Status.TRACKING
        return Estimate(
            frame.stamp, pose, pose @ self._ego.motion.wheels.inverse(), covariance, status, 0.0 if lost else 1.0, reason, sources
        )

    def _sources(self, frame: SensorFrame) -> tuple[str, ...]:
        told = {"lidar": self._heard["lidar"] > frame.stamp - RECENT}
        return (*(name for name, tells in told.items() if tells), *self.visual_estimate.sources)

    def _reason(self, frame: SensorFrame) -> str:
        if silent := self._watch.silent(frame):
            return silent
        lidar, visual = self.lidar_estimate.reason, self.visual_estimate.reason
        if "scans" in frame.available and lidar:
            return lidar
        return visual if "images" in frame.available else "" if lidar != FULL else FULL
