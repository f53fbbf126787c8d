"""The `visual_slam` pipeline: markers, visual odometry, wheels and gyro, as many of them as there are.

It makes a marker map while it drives, or localises in one that is given.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slam.errors import ParameterError
from slam.landmarks.camera_location import locate_camera, on_the_floor
from slam.landmarks.marker_bundle import Prior, inverse
from slam.landmarks.marker_graph import MarkerGraph, MarkerGraphSettings, Told
from slam.landmarks.marker_location import Location
from slam.landmarks.marker_map import MarkerMap
from slam.landmarks.marker_map_file import read_marker_map
from slam.landmarks.markers import Detection, MarkerImageError, Markers, require_camera
from slam.landmarks.sighting import Sighting
from slam.landmarks.visual_odometry import VisualOdometry
from slam.mapping.grid_mapper import FULL, GridMapper, MapSettings
from slam.mapping.visual_motion import VisualMotion
from slam.messages import Estimate, LaserScan, RgbdImage, SensorFrame, Status
from slam.motion.keyframes import KeyframeGate
from slam.motion.motion_noise import MotionNoise
from slam.motion.scan_trajectory import ScanTrajectory
from slam.motion.sensor_watch import SensorWatch
from slam.scans import Unveil
from slam.se2 import SE2
from slam.se3 import SE3
from slam.snapshot import Snapshot

EXACT = np.eye(3) * 1e-10
"""Added to a covariance, so that a start that is known has an information [m^2, rad^2]."""
SHOWN = 1.0
"""How long an alarm degrades the estimate [s]."""
MOVED = 0.02
"""Way [m] and turn [rad] after which an image cannot be the same as before."""
BLIND = 5.0
"""Mean grey level below which an image is called black."""


RECENT = 0.5
"""So long something that has told of the pose counts [s]."""
UNTOLD = Told(SE2(), np.diag([1.0, 1.0, 1.0]))
"""A step of which neither wheels nor camera tell."""
PLENTY = 4
"""Known markers in view from which on nothing is gained by visual odometry beside wheels."""
GYRO = 0.05
"""The gyro speaks when it covers so long a time [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Known markers in an image."""

    stamp: float
    T_map_base: SE2
    """By them and by what was known before."""
    sightings: tuple[Sighting, ...]
    """Of those that fit."""


@dataclass(frozen=True, slots=True)
class VisualSlam:
    """Visual SLAM on a floor."""

    markers: Markers = field(default_factory=lambda: Markers(quick=True))
    odometry: VisualOdometry = field(default_factory=VisualOdometry)
    graph: MarkerGraphSettings = field(default_factory=MarkerGraphSettings)
    marker_map: str = ""
    """File of a marker map to localise in; none: the map is made."""
    planar: bool = True
    """Whether the robot stands flat on the floor; if not, the camera is located in space, which only a given marker map allows."""
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
            ParameterError: without a marker map the robot must be flat on the floor.
        """
        if not (self.planar or self.marker_map):
            raise ParameterError(self, "planar", "true while a marker map is made; a marker map to localise in allows false")
        given = read_marker_map(Path(self.marker_map)) if self.marker_map else None
        if given is not None:
            given.require_dictionary([family.dictionary for family in self.markers.families])
        return VisualSlamPipeline(self, T_map_base, given)


class VisualSlamPipeline:
    """`T_map_odom` is set by every image that shows known markers; camera, wheels and gyro carry it on in between."""

    def __init__(self, settings: VisualSlam, T_map_base: SE2 | None, given: MarkerMap | None) -> None:
        self._settings = settings
        self._detector = settings.markers.build()
        self._given = given
        self._graph: MarkerGraph | None = None
        self.motion = VisualMotion(settings.odometry, settings.noise, settings.unveil, T_map_base or SE2())
        self._watch = SensorWatch(images=True)
        self._mapper = GridMapper(settings.map)
        self._path = ScanTrajectory()
        self._lost = given is not None and T_map_base is None
        self._keyframe: SE2 | None = None
        self._T_odom_keyframe = SE2()
        self._mount = SE3()  # T_base_camera, with what base does not know of the camera's height and tilt
        self._scan: SE2 | None = None
        self._image: RgbdImage | None = None
        self._complaint = ""
        self._located_at = self._known_at = -np.inf
        self._fitting = 0  # known markers in the newest image that fit
        self._alarmed: dict[int, float] = {}
        self.detection: Detection | None = None
        """Of the newest image."""
        self.sight: Sight | None = None
        """What the markers said of the newest image in which they said something."""

    @property
    def image(self) -> RgbdImage | None:
        """The newest image that `detection` may be of; None before the first."""
        return self._image

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
        """Locate the frame's images, draw its scans, and answer with the pose at the frame's time."""
        self.motion.ego.hear(frame)
        for image in frame.images:
            self._see(image)
            if "scans" not in frame.available:
                self._path.append(image.stamp, self.motion.T_map_base)
        for scan in frame.scans:
            self._draw(scan)
        return self._estimate(frame)

    def snapshot(self) -> Snapshot:
        """The grid and the poses at scans so far."""
        return Snapshot(self._mapper.snapshot(), self._path.trajectory())

    def finish(self) -> None:
        """Polish the marker map."""
        if self._graph is not None and self._given is None and self._graph.known.places:
            self._graph.batch(self._settings.graph.polish)

    def _draw(self, scan: LaserScan) -> None:
        """Draw a scan into the grid."""
        T_map_base, cloud = self.motion.at(scan.stamp)[0], self.motion.ego.points(scan)
        self._path.append(scan.stamp, T_map_base)
        if len(cloud.points) > 0 and not self._lost and self._settings.scans.passes(self._scan, T_map_base):
            self._mapper.insert(T_map_base, cloud.points, cloud.origins)
            self._scan = self._scan if self._mapper.full else T_map_base

    def _see(self, image: RgbdImage) -> None:
        """Locate an image."""
        if self._image is not None and image.stamp <= self._image.stamp:
            return
        again = self._image is not None and np.array_equal(self._image.colour, image.colour)
        self._complaint = _fault(image, self.motion.step_to(image.stamp), again)
        self._image = image
        if self._complaint or again:
            return
        try:
            require_camera(image.colour, image.colour_info)
        except MarkerImageError as error:
            self._complaint = str(error)
            return
        graph, wheels = self._graph or self._begun(image), self.motion.ego.wheels_cover(image.stamp)
        self.motion.scales = graph.scales
        self.motion.see(image, graph.known.mount, rest=wheels and self._fitting >= PLENTY)
        self.detection = self._detector.detect(image.colour, image.colour_info, self.motion.ego.twist(image.stamp))
        if self.motion.seeing or wheels:
            self._known_at = image.stamp
        fitting = self._located(graph, self.detection.sightings, image.stamp)
        if self._given is None and self._settings.keyframes.passes(self._keyframe, self.motion.T_map_base):
            self._add(graph, fitting)

    def _located(self, graph: MarkerGraph, sightings: tuple[Sighting, ...], stamp: float) -> list[Sighting]:
        """Take the pose that the known markers give; returns the sightings that fit, or are not known."""
        known, self._fitting = graph.known.known(sightings), 0
        if not known:
            return list(sightings)
        found = self._near(graph, known) if self._settings.planar else self._in_space(graph, known)
        if found is None:
            return list(sightings)
        if found.believable:
            self.motion.correct(found.T_map_base, found.covariance)
            self._lost, self._located_at, self._known_at, self._fitting = False, stamp, stamp, int(found.fits.sum())
            self.sight = Sight(stamp, found.T_map_base, tuple(s for s, fits in zip(known, found.fits.tolist(), strict=True) if fits))
        if self._given is None:
            for marker in graph.watch(known, found):
                self._alarmed[marker] = stamp
        misfits = {s.id for s, fits in zip(known, found.fits.tolist(), strict=True) if not fits}
        return [s for s in sightings if s.id not in misfits]

    def _near(self, graph: MarkerGraph, known: list[Sighting]) -> Location | None:
        """The pose on the floor near the one that odometry leads to, else anywhere."""
        found = None if self._lost else graph.known.locate(known, _prior(self.motion))
        return found if found is not None and found.believable else self._relocated(graph, known) or found

    def _in_space(self, graph: MarkerGraph, known: list[Sighting]) -> Location | None:
        """The pose below the camera, wherever that is; between images it moves along as on a floor."""
        found = locate_camera(graph.known, known, None if self._lost else SE3.from_se2(self.motion.T_map_base) @ self._mount)
        if found is None:
            return None
        location = on_the_floor(found, graph.known.mount)
        self._mount = SE3.from_se2(location.T_map_base).inverse() @ found.T_map_camera
        return location

    def _relocated(self, graph: MarkerGraph, known: list[Sighting]) -> Location | None:
        found = graph.known.relocate(known)
        enough = found is not None and (self._lost or int(found.fits.sum()) > 1)
        return found if enough else None

    def _add(self, graph: MarkerGraph, sightings: list[Sighting]) -> None:
        motion = self.motion
        wheels, told = motion.ego.wheels_cover(motion.stamp), motion.told("keyframes")
        T_odom_base = motion.ego.motion.pose_at(motion.stamp)
        step = self._T_odom_keyframe.inverse() @ T_odom_base if wheels or told is None else told.step
        if graph.add(motion.T_map_base, motion.covariance, step, sightings, None if wheels else told or UNTOLD):
            motion.correct(graph.keyframes[-1].T_map_base, graph.keyframes[-1].covariance)
        self._keyframe, self._T_odom_keyframe = motion.T_map_base, T_odom_base

    def _begun(self, image: RgbdImage) -> MarkerGraph:
        """A graph for this camera, with the given map's markers."""
        graph = MarkerGraph(self._settings.graph, image.colour_info.T_base_camera, self._settings.noise)
        if self._given is not None:
            graph.known.mount = self._given.T_base_camera or graph.known.mount
            for marker in self._given.markers.values():
                graph.known.put(marker.id, marker.T_map_marker, marker.covariance)
        self._graph, self._mount = graph, graph.known.mount
        return graph

    def _estimate(self, frame: SensorFrame) -> Estimate:
        pose, covariance = self.motion.at(frame.stamp)
        reason = self._reason(frame)
        status = Status.LOST if self._lost else Status.DEGRADED if reason else Status.TRACKING
        reason = "no known marker seen yet" if self._lost else reason
        known = self._graph is not None and not self._lost
        camera = SE3.from_se2(pose) @ (self._graph.known.mount if self._graph and self._settings.planar else self._mount) if known else None
        T_map_odom, health = pose @ self.motion.ego.motion.wheels.inverse(), 0.0 if self._lost else 1.0
        return Estimate(frame.stamp, pose, T_map_odom, covariance, status, health, reason, self._sources(frame), camera)

    def _sources(self, frame: SensorFrame) -> tuple[str, ...]:
        recent, motion = frame.stamp - RECENT, self.motion
        telling = {
            "markers": self._located_at > recent,
            "visual odometry": motion.seeing and motion.stamp > recent,
            "wheels": motion.ego.motion.newest > recent,
            "gyro": motion.ego.motion.gyro_turn(frame.stamp - GYRO, frame.stamp) is not None,
        }
        return tuple(name for name, tells in telling.items() if tells)

    def _reason(self, frame: SensorFrame) -> str:
        if self._mapper.full:
            return FULL
        if silent := self._watch.silent(frame):
            return silent
        if self._complaint:
            return self._complaint
        if self.motion.ego.motion.newest < frame.stamp - RECENT and self._known_at < frame.stamp - RECENT:
            return "no wheels, and neither a known marker nor enough texture in view"
        if self._graph is not None and self._graph.suspicion:
            return self._graph.suspicion
        alarms = self._graph.alarms if self._graph else {}
        return "; ".join(alarms[marker] for marker, stamp in self._alarmed.items() if frame.stamp < stamp + SHOWN and marker in alarms)


def _prior(motion: VisualMotion) -> Prior:
    return Prior(motion.T_map_base.as_array(), inverse(motion.covariance + EXACT))


def _fault(image: RgbdImage, step: SE2, again: bool) -> str:
    """What is wrong with an image as a whole, after a step since the last one that was used; empty when nothing is."""
    if image.colour.size == 0 or image.colour[::8, ::8].mean() < BLIND:
        return "the image is black"
    if again and np.hypot(step.x, step.y) + abs(step.yaw) > MOVED:
        return "the camera is frozen: the robot moves and the image does not change"
    return ""
