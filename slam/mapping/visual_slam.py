"""The `visual_slam` pipeline: markers, wheels and gyro. It makes a marker map while it drives, or localises in one that is given."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slam.landmarks.marker_bundle import Prior, inverse
from slam.landmarks.marker_graph import MarkerGraph, MarkerGraphSettings
from slam.landmarks.marker_location import Location
from slam.landmarks.marker_map import MarkerMap
from slam.landmarks.marker_map_file import read_marker_map
from slam.landmarks.markers import Detection, MarkerImageError, Markers
from slam.landmarks.sighting import Sighting
from slam.mapping.grid_mapper import FULL, GridMapper, MapSettings
from slam.messages import Estimate, RgbdImage, SensorFrame, Status
from slam.motion.dead_reckoning import DeadReckoning
from slam.motion.keyframes import KeyframeGate
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import Unveil, deskew
from slam.se2 import SE2
from slam.snapshot import Snapshot

SPAN = 0.02
"""Over which the twist at an image is taken [s]."""
EXACT = np.eye(3) * 1e-10
"""Added to a covariance, so that a start that is known has an information [m^2, rad^2]."""
SHOWN = 1.0
"""How long an alarm degrades the estimate [s]."""
MOVED = 0.02
"""Way [m] and turn [rad] after which an image cannot be the same as before."""
BLIND = 5.0
"""Mean grey level below which an image is called black."""


@dataclass(frozen=True, slots=True)
class VisualSlam:
    """Marker SLAM on a floor."""

    markers: Markers = field(default_factory=lambda: Markers(quick=True))
    graph: MarkerGraphSettings = field(default_factory=MarkerGraphSettings)
    marker_map: str = ""
    """File of a marker map to localise in; none: the map is made."""
    noise: MotionNoise = field(default_factory=MotionNoise)
    keyframes: KeyframeGate = field(default_factory=lambda: KeyframeGate(0.08, 0.1))
    """Images that enter the marker map."""
    unveil: Unveil = field(default_factory=Unveil)
    map: MapSettings = field(default_factory=MapSettings)
    scans: KeyframeGate = field(default_factory=KeyframeGate)
    """Scans that enter the grid."""

    def build(self, T_map_base: SE2 | None = None) -> VisualSlamPipeline:
        """Make the pipeline; the robot starts at `T_map_base`: by default at the origin, in a given map where the first image says.

        Raises:
            MarkerMapError: the marker map cannot be read, or is of another dictionary.
        """
        given = read_marker_map(Path(self.marker_map)) if self.marker_map else None
        if given is not None:
            given.require_dictionary([family.dictionary for family in self.markers.families])
        return VisualSlamPipeline(self, T_map_base, given)


class VisualSlamPipeline:
    """`T_map_odom` is set by every image that shows known markers; wheels and gyro carry it on in between."""

    def __init__(self, settings: VisualSlam, T_map_base: SE2 | None, given: MarkerMap | None) -> None:
        self._settings = settings
        self._detector = settings.markers.build()
        self._given = given
        self._graph: MarkerGraph | None = None
        self._motion = DeadReckoning()
        self._watch = SensorWatch()
        self._mapper = GridMapper(settings.map)
        self._path = ScanTrajectory()
        self._start = T_map_base or SE2()
        self._lost = given is not None and T_map_base is None
        self._T_map_base, self._covariance = self._start, np.zeros((3, 3))  # at _T_odom_base
        self._T_odom_base = SE2()
        self._keyframe: tuple[SE2, SE2] | None = None  # T_map_base and T_odom_base
        self._scan: SE2 | None = None
        self._image: RgbdImage | None = None
        self._complaint = ""
        self._alarmed: dict[int, float] = {}
        self.detection: Detection | None = None
        """Of the newest image."""

    @property
    def graph(self) -> MarkerGraph | None:
        """The marker map in the making; None before the first image."""
        return self._graph

    def marker_map(self) -> MarkerMap | None:
        """The markers so far, None before the first image."""
        if self._given is not None:
            return self._given
        return self._graph.map(self._settings.markers.families[0].dictionary) if self._graph else None

    def update(self, frame: SensorFrame) -> Estimate:
        """Locate the frame's images in the markers, draw its scans, and answer with the pose at the frame's time."""
        first = self._motion.empty
        self._motion.add(frame.odometry, frame.imu)
        if first and not self._motion.empty:
            self._T_odom_base = self._motion.pose_at(-np.inf)
        for image in frame.images:
            self._see(image)
        for scan in frame.scans:
            T_map_base = self._pose_at(scan.stamp)
            self._path.append(scan.stamp, T_map_base)
            cloud = deskew(self._settings.unveil.clean(scan), self._motion.window(scan.stamp))
            if len(cloud.points) > 0 and not self._lost and self._settings.scans.passes(self._scan, T_map_base):
                self._mapper.insert(T_map_base, cloud.points, cloud.origins)
                self._scan = self._scan if self._mapper.full else T_map_base
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The grid and the poses at scans so far."""
        return Snapshot(self._mapper.snapshot(), self._path.trajectory())

    def finish(self) -> None:
        """Polish the marker map."""
        if self._graph is not None and self._given is None and self._graph.known.places:
            self._graph.batch(self._settings.graph.polish)

    def _pose_at(self, t: float) -> SE2:
        return self._T_map_base @ self._step_to(t)

    def _step_to(self, t: float) -> SE2:
        """What the robot has moved since the newest image, as wheels and gyro say, put right by what the markers taught."""
        step = self._T_odom_base.inverse() @ self._motion.pose_at(t)
        return self._graph.scales.corrected(step) if self._graph else step

    def _see(self, image: RgbdImage) -> None:
        """Locate an image."""
        if self._image is not None and image.stamp <= self._image.stamp:
            return
        T_odom_base, step = self._motion.pose_at(image.stamp), self._step_to(image.stamp)
        again = self._image is not None and np.array_equal(self._image.colour, image.colour)
        self._complaint = _fault(image, step, again)
        self._image = image
        if self._complaint or again:
            return
        twist = (self._motion.pose_at(image.stamp - SPAN).inverse() @ self._motion.pose_at(image.stamp)).log() / SPAN
        try:
            self.detection = self._detector.detect(image.colour, image.colour_info, twist)
        except MarkerImageError as error:
            self._complaint = str(error)
            return
        self._covariance = self._settings.noise.propagate(self._covariance, self._T_map_base, step)
        self._T_map_base, self._T_odom_base = self._T_map_base @ step, T_odom_base
        graph = self._graph or self._begun(image)
        fitting = self._located(graph, self.detection.sightings, image.stamp)
        if self._given is None and self._settings.keyframes.passes(self._keyframe[0] if self._keyframe else None, self._T_map_base):
            self._add(graph, fitting)

    def _located(self, graph: MarkerGraph, sightings: tuple[Sighting, ...], stamp: float) -> list[Sighting]:
        """Take the pose that the known markers give; returns the sightings that fit, or are not known."""
        known = graph.known.known(sightings)
        if not known:
            return list(sightings)
        found = None if self._lost else graph.known.locate(known, Prior(self._T_map_base.as_array(), inverse(self._covariance + EXACT)))
        if found is None or not found.believable:
            found = self._relocated(graph, known) or found
        if found is None:
            return list(sightings)
        if found.believable:
            self._T_map_base, self._covariance, self._lost = found.T_map_base, found.covariance, False
        if self._given is None:
            for marker in graph.watch(known, found):
                self._alarmed[marker] = stamp
        misfits = {s.id for s, fits in zip(known, found.fits.tolist(), strict=True) if not fits}
        return [s for s in sightings if s.id not in misfits]

    def _relocated(self, graph: MarkerGraph, known: list[Sighting]) -> Location | None:
        found = graph.known.relocate(known)
        enough = found is not None and (self._lost or int(found.fits.sum()) > 1)
        return found if enough else None

    def _add(self, graph: MarkerGraph, sightings: list[Sighting]) -> None:
        before = self._keyframe[1] if self._keyframe else self._T_odom_base
        if graph.add(self._T_map_base, self._covariance, before.inverse() @ self._T_odom_base, sightings):
            self._T_map_base, self._covariance = graph.keyframes[-1].T_map_base, graph.keyframes[-1].covariance
        self._keyframe = self._T_map_base, self._T_odom_base

    def _begun(self, image: RgbdImage) -> MarkerGraph:
        """A graph for this camera, with the given map's markers."""
        graph = MarkerGraph(self._settings.graph, image.colour_info.T_base_camera, self._settings.noise)
        if self._given is not None:
            graph.known.mount = self._given.T_base_camera or graph.known.mount
            for marker in self._given.markers.values():
                graph.known.put(marker.id, marker.T_map_marker, marker.covariance)
        self._graph = graph
        return graph

    def _estimate(self, frame: SensorFrame) -> Estimate:
        pose = self._pose_at(frame.stamp)
        covariance = self._settings.noise.propagate(self._covariance, self._T_map_base, self._step_to(frame.stamp))
        reason = self._reason(frame)
        status = Status.LOST if self._lost else Status.DEGRADED if reason else Status.TRACKING
        reason = "no known marker seen yet" if self._lost else reason
        return Estimate(frame.stamp, pose, pose @ self._motion.wheels.inverse(), covariance, status, 0.0 if self._lost else 1.0, reason)

    def _reason(self, frame: SensorFrame) -> str:
        if self._mapper.full:
            return FULL
        if silent := self._watch.silent(frame):
            return silent
        if self._complaint:
            return self._complaint
        if self._graph is not None and self._graph.suspicion:
            return self._graph.suspicion
        alarms = self._graph.alarms if self._graph else {}
        return "; ".join(alarms[marker] for marker, stamp in self._alarmed.items() if frame.stamp < stamp + SHOWN and marker in alarms)


def _fault(image: RgbdImage, step: SE2, again: bool) -> str:
    """What is wrong with an image as a whole, after a step since the last one that was used; empty when nothing is."""
    if image.colour.size == 0 or image.colour[::8, ::8].mean() < BLIND:
        return "the image is black"
    if again and np.hypot(step.x, step.y) + abs(step.yaw) > MOVED:
        return "the camera is frozen: the robot moves and the image does not change"
    return ""
