"""The robot's pose from all corners of all known markers that an image shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.kernels.marker_filter import locate
from slam.landmarks.marker_bundle import LOSS, Prior, inverse, views_of
from slam.landmarks.sighting import Sighting
from slam.se2 import SE2, FloatArray
from slam.se3 import SE3

GATE = 100.0
"""Chi-square beyond which a sighting does not fit (8 numbers; its tails are longer than normal)."""
DECISIVE = 3.0
"""Ratio of the branches' errors from which a lone marker tells where the robot is."""
UNKNOWN = np.diag([1e-6, 1e-6, 1e-6])
"""Information of a pose that is anywhere."""


@dataclass(frozen=True, slots=True, eq=False)
class Location:
    """An answer."""

    T_map_base: SE2
    covariance: FloatArray
    """(3, 3) of (x, y, yaw) in the map."""
    fits: NDArray[np.bool_]
    """Which of the sightings agree with it."""
    chi2: FloatArray
    """Of every sighting."""

    @property
    def believable(self) -> bool:
        """More sightings agree than do not."""
        return bool(2 * self.fits.sum() > len(self.fits))


@dataclass(slots=True, eq=False)
class MarkerField:
    """Markers as arrays that grow: rotations (M, 3, 3), translations (M, 3) and covariances (M, 6, 6) in the map."""

    mount: SE3
    """`T_base_camera`."""
    rotations: FloatArray
    translations: FloatArray
    covariances: FloatArray
    places: dict[int, int]
    """Marker -> its row."""

    @classmethod
    def empty(cls, mount: SE3) -> MarkerField:
        """No markers yet."""
        return cls(mount, np.empty((0, 3, 3)), np.empty((0, 3)), np.empty((0, 6, 6)), {})

    def put(self, marker: int, T_map_marker: SE3, covariance: FloatArray) -> None:
        """Add a marker, or replace it."""
        if marker not in self.places:
            self.places[marker] = len(self.translations)
            self.rotations = np.concatenate([self.rotations, np.empty((1, 3, 3))])
            self.translations = np.concatenate([self.translations, np.empty((1, 3))])
            self.covariances = np.concatenate([self.covariances, np.empty((1, 6, 6))])
        row = self.places[marker]
        self.rotations[row], self.translations[row], self.covariances[row] = T_map_marker.R, T_map_marker.t, covariance

    def drop(self, marker: int) -> None:
        """Forget a marker; its row stays, unused."""
        del self.places[marker]

    def pose_of(self, marker: int) -> SE3:
        """`T_map_marker`."""
        row = self.places[marker]
        return SE3(self.rotations[row], self.translations[row])

    def known(self, sightings: Sequence[Sighting]) -> list[Sighting]:
        """Those of markers in the map."""
        return [s for s in sightings if s.id in self.places]

    def locate(self, sightings: Sequence[Sighting], prior: Prior) -> Location:
        """The pose near a prior that agrees best with sightings of known markers."""
        views = views_of(sightings, [0] * len(sightings), [self.places[s.id] for s in sightings])
        state = (prior.mean.reshape(1, 3).copy(), self.rotations, self.translations, np.array(self.mount.R), np.array(self.mount.t))
        x, information, chi2 = locate(state, views, self.covariances, (prior.mean, prior.information), LOSS)
        covariance = inverse(information)
        return Location(SE2.from_array(x), 0.5 * (covariance + covariance.T), chi2 < GATE, chi2)

    def relocate(self, sightings: Sequence[Sighting]) -> Location | None:
        """The pose in one image, from nothing: both branches of every marker are tried against all (Munoz-Salinas, Medina-Carnicer 2020).

        None where no pose has more than one marker for it, and a lone marker's branches are too alike.
        """
        best: Location | None = None
        for sighting in sightings:
            for branch in sighting.branches:
                T = (self.pose_of(sighting.id) @ branch.inverse() @ self.mount.inverse()).to_se2()
                found = self.locate(sightings, Prior(T.as_array(), UNKNOWN))
                if best is None or _worth(found) > _worth(best):
                    best = found
        if best is None or not best.believable:
            return None
        lone = int(best.fits.sum()) == 1
        decisive = max(s.ratio for s, fits in zip(sightings, best.fits, strict=True) if fits) >= DECISIVE
        return best if not lone or decisive else None


def _worth(found: Location) -> tuple[int, float]:
    """How many sightings agree, then how well."""
    return int(found.fits.sum()), -float(np.minimum(found.chi2, GATE).sum())
