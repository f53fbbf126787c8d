"""Landmarks of known identity, markers, in a particle filter: Thrun, Burgard, Fox, Probabilistic Robotics (2005), tables 6.4 and 6.5."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slam.errors import require_positive
from slam.grid import FREE
from slam.landmarks.marker_map import MarkerMap
from slam.landmarks.marker_map_file import read_marker_map
from slam.landmarks.markers import MarkerImageError, Markers
from slam.localization.known_map import KnownMap
from slam.messages import RgbdImage, SensorFrame
from slam.motion.ego_motion import EgoMotion
from slam.se2 import SE2, FloatArray

SPAN = 0.02
"""Over which the twist at an image is taken [s]."""
NO_CAMERA = "the robot has no camera to see the markers with"
"""Reason of an estimate."""


@dataclass(frozen=True, slots=True)
class Landmarks:
    """Markers that help to localise; without a marker map nobody looks at them."""

    marker_map: str = ""
    """File of the markers, in the frame of the map: both from one run of `visual_slam`, or laid on each other."""
    markers: Markers = field(default_factory=lambda: Markers(quick=True))
    sigma_range: float = 0.03
    """Standard deviation of a range [m] at 1 m; it grows with the square of the range, as a marker's size in the picture falls."""
    sigma_bearing: float = 0.02
    """Standard deviation of a bearing: mount, clock and map [rad]."""
    worst: float = 8.0
    """Deviations, both together, beyond which all are the same: a marker that was moved must not outweigh walls."""
    contradictions: int = 3
    """Images in a row whose markers contradict the pose after which it is looked for by the markers."""
    samples: int = 2000
    """Poses that are drawn about each marker."""
    memory: float = 0.3
    """A sighting counts for so long [s]."""

    def __post_init__(self) -> None:
        require_positive(self, "sigma_range", "sigma_bearing", "worst", "contradictions", "samples", "memory")

    def build(self) -> LandmarkWatch | None:
        """What keeps watch for them; None without a marker map.

        Raises:
            MarkerMapError: the map cannot be read, or is of another dictionary.
        """
        if not self.marker_map:
            return None
        known = read_marker_map(Path(self.marker_map))
        known.require_dictionary([family.dictionary for family in self.markers.families])
        return LandmarkWatch(self, LandmarkEye(self, known))


@dataclass(frozen=True, slots=True, eq=False)
class SeenLandmarks:
    """Known markers that an image shows, N of them."""

    stamp: float
    """[s]"""
    places: FloatArray
    """(N, 2) in the map [m]."""
    seen: FloatArray
    """(N, 2) from base at the stamp [m]."""

    def from_base(self, T_image_now: SE2) -> SeenLandmarks:
        """The same, seen from where base has gone to since."""
        return SeenLandmarks(self.stamp, self.places, T_image_now.inverse().transform(self.seen))

    def without(self, n: int) -> SeenLandmarks:
        """All but one."""
        return SeenLandmarks(self.stamp, np.delete(self.places, n, axis=0), np.delete(self.seen, n, axis=0))


class LandmarkEye:
    """Looks for the markers of a map and says how they fit to poses."""

    def __init__(self, settings: Landmarks, known: MarkerMap) -> None:
        self._settings = settings
        self._known = known
        self._detector = settings.markers.build()
        self.complaint = ""
        """What is wrong with the newest image."""

    def look(self, image: RgbdImage, twist: FloatArray) -> SeenLandmarks:
        """The known markers in an image, taken while base moved by a twist (3,) [m/s, rad/s]."""
        self.complaint = ""
        try:
            sightings = self._detector.detect(image.colour, image.colour_info, twist).sightings
        except MarkerImageError as error:
            self.complaint, sightings = str(error), ()
        known = [s for s in sightings if s.id in self._known.markers]
        mount = self._known.T_base_camera or image.colour_info.T_base_camera
        seen = [(mount @ s.branches[0]).t[:2] for s in known]  # the middle is the same in both branches
        places = [self._known.markers[s.id].T_map_marker.t[:2] for s in known]
        return SeenLandmarks(image.stamp, np.array(places).reshape(-1, 2), np.array(seen).reshape(-1, 2))

    def log_likelihoods(self, poses: FloatArray, landmarks: SeenLandmarks) -> FloatArray:
        """Log-likelihoods (M,) of poses (M, 3), 0 at best: `landmark_model_known_correspondence`, table 6.4, cut at `worst`."""
        return -0.5 * np.minimum(self._squares(poses, landmarks), self._settings.worst**2).sum(axis=1)

    def contradicts(self, pose: SE2, landmarks: SeenLandmarks) -> bool:
        """Whether most of the markers are not where they would be seen from a pose."""
        misfits = self._squares(pose.as_array()[None], landmarks)[0] > self._settings.worst**2
        return bool(2 * misfits.sum() > len(misfits))

    def seeds(self, known_map: KnownMap, landmarks: SeenLandmarks, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Poses (M, 3) in free cells drawn about each marker, `sample_landmark_model`, table 6.5, and their log-weights (M,).

        A pose is weighed by the other markers that are in view.
        """
        poses, weights = [np.empty((0, 3))], [np.empty(0)]
        for n in range(len(landmarks.places)):
            drawn = self._drawn(landmarks.places[n], landmarks.seen[n], rng)
            drawn = drawn[_free(known_map, drawn)]
            poses.append(drawn)
            weights.append(self.log_likelihoods(drawn, landmarks.without(n)))
        return np.concatenate(poses), np.concatenate(weights)

    def _drawn(self, place: FloatArray, seen: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Table 6.5: all round the marker at the measured range, so turned that its bearing is the measured one."""
        s, count = self._settings, self._settings.samples
        r, phi = float(np.hypot(*seen)), math.atan2(seen[1], seen[0])
        gamma = rng.uniform(0.0, math.tau, count)
        r_hat = r + rng.normal(0.0, s.sigma_range * max(r, 0.3) ** 2, count)
        phi_hat = phi + rng.normal(0.0, s.sigma_bearing, count)
        poses = np.column_stack([place[0] + r_hat * np.cos(gamma), place[1] + r_hat * np.sin(gamma), gamma - np.pi - phi_hat])
        poses[:, 2] = np.remainder(poses[:, 2] + np.pi, math.tau) - np.pi
        return poses[r_hat > 0.0]

    def _squares(self, poses: FloatArray, landmarks: SeenLandmarks) -> FloatArray:
        """(M, N) squared deviations of range and bearing."""
        off = landmarks.places - poses[:, None, :2]
        r_hat, phi_hat = np.hypot(off[..., 0], off[..., 1]), np.arctan2(off[..., 1], off[..., 0]) - poses[:, None, 2]
        r, phi = np.hypot(*landmarks.seen.T), np.arctan2(landmarks.seen[:, 1], landmarks.seen[:, 0])
        turn = np.remainder(phi - phi_hat + np.pi, math.tau) - np.pi
        sigma_r = self._settings.sigma_range * np.maximum(r, 0.3) ** 2
        return np.square((r - r_hat) / sigma_r) + np.square(turn / self._settings.sigma_bearing)


class LandmarkWatch:
    """What the eye has seen lately, and how often that contradicted the pose."""

    def __init__(self, settings: Landmarks, eye: LandmarkEye) -> None:
        self._settings = settings
        self.eye = eye
        self._seen: SeenLandmarks | None = None
        self._contradictions = 0

    @property
    def contradicted(self) -> bool:
        """Whether so many images in a row deny the pose that it is to be looked for by the markers."""
        return self._contradictions >= self._settings.contradictions

    def look(self, image: RgbdImage, ego: EgoMotion) -> None:
        """Take in the markers of an image, and whether they contradict the pose."""
        before, now = ego.motion.pose_at(image.stamp - SPAN), ego.motion.pose_at(image.stamp)
        seen = self.eye.look(image, (before.inverse() @ now).log() / SPAN)
        if len(seen.places):
            self._seen = seen
            self._contradictions = self._contradictions + 1 if self.eye.contradicts(ego.at(image.stamp), seen) else 0

    def seen_at(self, stamp: float, ego: EgoMotion) -> SeenLandmarks | None:
        """Those seen lately, from base at a time [s]."""
        if self._seen is None or abs(stamp - self._seen.stamp) > self._settings.memory:
            return None
        return self._seen.from_base(ego.motion.pose_at(self._seen.stamp).inverse() @ ego.motion.pose_at(stamp))

    def weigh(self, stamp: float, ego: EgoMotion) -> Callable[[FloatArray], FloatArray] | None:
        """Log-likelihoods of poses by the markers seen lately (table 6.4)."""
        seen = self.seen_at(stamp, ego)
        return None if seen is None else lambda poses: self.eye.log_likelihoods(poses, seen)

    def believe(self) -> None:
        """The pose is where the markers say."""
        self._contradictions = 0

    def trouble(self, frame: SensorFrame) -> str:
        """What keeps the markers from being seen; empty when nothing does."""
        return self.eye.complaint if "images" in frame.available else NO_CAMERA


def _free(known_map: KnownMap, poses: FloatArray) -> NDArray[np.bool_]:
    """Which of poses (M, 3) lie in free cells."""
    geometry = known_map.grid.geometry
    cells = np.floor(geometry.T_map_grid.inverse().transform(poses[:, :2]) / geometry.resolution).astype(np.int64)[:, ::-1]
    inside = ((cells >= 0) & (cells < (geometry.height, geometry.width))).all(axis=1)
    free = np.zeros(len(poses), np.bool_)
    free[inside] = known_map.grid.states()[tuple(cells[inside].T)] == FREE
    return free
