"""A marker map from all sightings, wheels and gyro: found while driving, polished in batches.

Between batches every marker has its own small filter, fed by poses that were located in all the others. A batch is a bundle
adjustment of all keyframes, all markers and the camera's mount; batches come as the number of keyframes grows, so that their cost
over a whole run stays in proportion to it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from slam.errors import require_positive
from slam.kernels.marker_filter import first_covariance, improve
from slam.landmarks.marker_bundle import LOSS, Bundle, Prior, inverse, views_of
from slam.landmarks.marker_location import Location, MarkerField
from slam.landmarks.marker_map import MappedMarker, MarkerMap
from slam.landmarks.marker_vote import View, Vote, vote
from slam.landmarks.odometry_scales import OdometryScales
from slam.landmarks.sighting import Sighting
from slam.motion.motion_noise import MotionNoise
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

_log = logging.getLogger(__name__)

FIXED = np.eye(3) * 1e12
"""Information of a pose that is the map's anchor [1/m^2, 1/rad^2]."""
SIDEWAYS = 0.002
"""Standard deviation of what wheels slip sideways in one metre [m]."""
LEAST = 1e-8
"""Variance of any step [m^2, rad^2]."""
WITNESSES = 2
"""Other markers that must agree with a pose for it to speak against a marker."""
WRONG_SIZE = 0.06
"""Difference between the ways by markers and by wheels that makes the markers' size doubtful, as a share."""
PATIENCE = 24
"""Views of a marker on which no vote is clear, after which it is inconsistent; older ones are then forgotten."""


@dataclass(frozen=True, slots=True)
class MarkerGraphSettings:
    """How a marker map is made."""

    growth: float = 0.15
    """A batch runs when there are so many more keyframes than at the last, as a share."""
    iterations: int = 6
    """Of a batch while driving."""
    polish: int = 30
    """Iterations of the last batch, at most."""
    misfits: int = 3
    """Frames in a row in which a marker does not fit, after which it has moved."""
    mount: bool = True
    """Whether the camera's mount is an unknown, near what the robot's description says."""

    def __post_init__(self) -> None:
        require_positive(self, "growth", "iterations", "polish", "misfits")


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """A step as the camera tells of it, where no wheels do."""

    step: SE2
    information: FloatArray
    """(3, 3) of its x, y, yaw."""


@dataclass(slots=True, eq=False)
class Keyframe:
    """A pose with what was seen from it."""

    T_map_base: SE2
    step: SE2
    """By wheels and gyro from the keyframe before."""
    covariance: FloatArray
    """(3, 3) of the pose when it was new."""
    sightings: dict[int, Sighting]
    """By marker; those that did not fit are gone."""
    told: Told | None = None
    """The same step where there are no wheels."""


@dataclass(slots=True, eq=False)
class MarkerGraph:
    """The map in the making."""

    settings: MarkerGraphSettings
    T_base_camera: SE3
    noise: MotionNoise
    known: MarkerField = field(init=False)
    keyframes: list[Keyframe] = field(default_factory=list[Keyframe])
    alarms: dict[int, str] = field(default_factory=dict[int, str])
    """Marker -> what is wrong with it."""
    votes: int = 0
    """Markers that were voted into the map."""
    scales: OdometryScales = field(default_factory=OdometryScales)
    """Of what wheels and gyro say, as learnt from the markers."""
    suspicion: str = ""
    """What all the markers together make doubtful; empty when nothing is."""
    _pending: dict[int, list[int]] = field(default_factory=dict[int, list[int]])
    _misfits: dict[int, int] = field(default_factory=dict[int, int])
    _sizes: dict[int, float] = field(default_factory=dict[int, float])
    _batched: int = 0

    def __post_init__(self) -> None:
        self.known = MarkerField.empty(self.T_base_camera)

    def watch(self, sightings: Sequence[Sighting], found: Location) -> list[int]:
        """Markers that have moved, as a frame shows that was located in the others; they leave the map."""
        moved: list[int] = []
        trusted = int(found.fits.sum()) >= WITNESSES and found.believable
        for sighting, fits in zip(sightings, found.fits.tolist(), strict=True):
            if fits or not trusted:
                self._misfits[sighting.id] = 0 if fits else self._misfits.get(sighting.id, 0)
                continue
            self._misfits[sighting.id] = self._misfits.get(sighting.id, 0) + 1
            if self._misfits[sighting.id] >= self.settings.misfits:
                self._forget(sighting.id)
                moved.append(sighting.id)
        return moved

    def add(self, T_map_base: SE2, covariance: FloatArray, step: SE2, sightings: Sequence[Sighting], told: Told | None = None) -> bool:
        """Add a keyframe; returns whether a batch has moved what was known.

        Args:
            T_map_base: where the robot is, as located.
            covariance: (3, 3) of it.
            step: what wheels and gyro say since the keyframe before.
            sightings: of known markers those that fit, and all of markers that are not known.
            told: the step where there are no wheels.
        """
        self.keyframes.append(Keyframe(T_map_base, step, covariance, {s.id: s for s in sightings}, told))
        self._sizes.update({s.id: s.size for s in sightings})
        number = len(self.keyframes) - 1
        self._improve(number)
        for sighting in sightings:
            if sighting.id not in self.known.places:
                self._consider(sighting.id, number)
        if len(self.known.places) == 0 or len(self.keyframes) < self._batched * (1.0 + self.settings.growth) + 1:
            return False
        self.batch(self.settings.iterations)
        return True

    def batch(self, iterations: int) -> None:
        """Adjust all keyframes, all markers and the mount."""
        self._batched = len(self.keyframes)
        bundle, markers = self._bundle()
        bundle.solve(iterations)
        covariances, last = bundle.covariances()
        for keyframe, pose in zip(self.keyframes, bundle.poses, strict=True):
            keyframe.T_map_base = SE2.from_array(pose)
        self.keyframes[-1].covariance = last
        self.known.mount = bundle.mount
        for row, marker in enumerate(markers):
            self.known.put(marker, SE3(_orthonormal(bundle.rotations[row]), bundle.translations[row]), covariances[row])
        if len(self.keyframes) > 1:
            self.scales = OdometryScales.fitted(bundle.poses, np.array([keyframe.step.as_array() for keyframe in self.keyframes[1:]]))
            self._doubt()

    def map(self, dictionary: str) -> MarkerMap:
        """The map so far."""
        counts = {marker: sum(marker in k.sightings for k in self.keyframes) for marker in self.known.places}
        markers = [
            MappedMarker(marker, self._sizes[marker], self.known.pose_of(marker), self.known.covariances[row].copy(), counts[marker])
            for marker, row in self.known.places.items()
        ]
        return MarkerMap.of(markers, dictionary, self.known.mount)

    def _improve(self, number: int) -> None:
        """Feed the known markers' filters from a keyframe."""
        keyframe = self.keyframes[number]
        seen = [s for s in keyframe.sightings.values() if s.id in self.known.places]
        if not seen:
            return
        views = views_of(seen, [0] * len(seen), [self.known.places[s.id] for s in seen])
        state = self._state(keyframe.T_map_base)
        for k in range(len(seen)):
            improve(state, views, k, (self.known.covariances, keyframe.covariance), LOSS)

    def _consider(self, marker: int, number: int) -> None:
        """Let all views of an unknown marker vote."""
        numbers = self._pending.setdefault(marker, [])
        numbers.append(number)
        views = [View(self.keyframes[k].T_map_base, self.keyframes[k].sightings[marker]) for k in numbers]
        elected = vote(views, self.known.mount)
        if elected is not None:
            self._admit(marker, [numbers[k] for k in elected.agreeing], elected, numbers[elected.elected])
        elif len(numbers) >= PATIENCE:
            self._alarm(marker, "is not consistent: it moves, is there twice, or has another size")
            del numbers[: PATIENCE // 2]

    def _admit(self, marker: int, agreeing: list[int], elected: Vote, first: int) -> None:
        """Take a marker into the map."""
        self.votes += 1
        for number in set(self._pending.pop(marker)) - set(agreeing):
            del self.keyframes[number].sightings[marker]
        keyframe = self.keyframes[first]
        self.known.put(marker, elected.T_map_marker, np.eye(6))
        row = self.known.places[marker]
        views = views_of([keyframe.sightings[marker]], [0], [row])
        self.known.covariances[row] = first_covariance(self._state(keyframe.T_map_base), views, 0, keyframe.covariance)
        for number in agreeing:
            if number != first:
                other = self.keyframes[number]
                state, views = self._state(other.T_map_base), views_of([other.sightings[marker]], [0], [row])
                improve(state, views, 0, (self.known.covariances, other.covariance), LOSS)

    def _forget(self, marker: int) -> None:
        """A marker is no longer where it was: what was seen of it says nothing any more."""
        self._alarm(marker, "has moved")
        self.known.drop(marker)
        self._misfits[marker] = 0
        for keyframe in self.keyframes:
            keyframe.sightings.pop(marker, None)

    def _doubt(self) -> None:
        """Compare the map's size with the wheels'."""
        ratio = self.scales.distance
        before, self.suspicion = self.suspicion, ""
        if abs(ratio - 1.0) > WRONG_SIZE:
            self.suspicion = f"by the markers the robot drives {ratio:.2f} times as far as by its wheels: is the markers' size right?"
            if not before:
                _log.warning("%s", self.suspicion)

    def _alarm(self, marker: int, what: str) -> None:
        self.alarms[marker] = f"marker {marker} {what}"
        _log.warning("marker %d %s", marker, what)

    def _state(self, T_map_base: SE2) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        mount = self.known.mount
        return T_map_base.as_array().reshape(1, 3), self.known.rotations, self.known.translations, np.array(mount.R), np.array(mount.t)

    def _by_odometry(self, step: SE2) -> Told:
        corrected = self.scales.corrected(step)
        return Told(corrected, _information(self.noise, corrected))

    def _bundle(self) -> tuple[Bundle, list[int]]:
        markers = list(self.known.places)
        rows = {marker: row for row, marker in enumerate(markers)}
        seen = [(k, s) for k, keyframe in enumerate(self.keyframes) for s in keyframe.sightings.values() if s.id in rows]
        views = views_of([s for _, s in seen], [k for k, _ in seen], [rows[s.id] for _, s in seen])
        places = [self.known.places[marker] for marker in markers]
        told = [keyframe.told or self._by_odometry(keyframe.step) for keyframe in self.keyframes[1:]]
        bundle = Bundle(
            poses=np.array([keyframe.T_map_base.as_array() for keyframe in self.keyframes]),
            rotations=self.known.rotations[places],
            translations=self.known.translations[places],
            mount=self.known.mount,
            views=views,
            steps=(np.array([t.step.as_array() for t in told]).reshape(-1, 3), np.array([t.information for t in told]).reshape(-1, 3, 3)),
            prior=Prior(self.keyframes[0].T_map_base.as_array(), FIXED),
            free=np.ones(len(markers), np.bool_),
            nominal=self.T_base_camera if self.settings.mount and not any(k.told for k in self.keyframes[1:]) else None,
        )
        return bundle, markers


def _information(noise: MotionNoise, step: SE2) -> FloatArray:
    """Information (3, 3) of a step. Wheels hardly slip sideways: that is what tells the camera's yaw in its mount from the robot's."""
    covariance = noise.covariance(step) + np.eye(3) * LEAST
    covariance[1, 1] = SIDEWAYS**2 * np.hypot(step.x, step.y) + LEAST
    return inverse(covariance)


def _orthonormal(R: FloatArray) -> FloatArray:
    """The nearest rotation: a product of many steps is no longer quite one."""
    U, _, Vh = np.linalg.svd(R)
    return U @ Vh
