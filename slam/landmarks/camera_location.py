"""The camera's pose in space, six degrees of freedom, from all corners of all known markers in an image: no flat floor is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.landmarks.corner_pose import Corners, refined
from slam.landmarks.marker_location import DECISIVE, Location, MarkerField
from slam.landmarks.sighting import Sighting, square
from slam.se2 import FloatArray
from slam.se3 import SE3


@dataclass(frozen=True, slots=True, eq=False)
class CameraLocation:
    """An answer."""

    T_map_camera: SE3
    covariance: FloatArray
    """(6, 6) of the translation and the rotation vector, in the camera's axes [m, rad]."""
    fits: NDArray[np.bool_]
    """Which of the sightings agree with it."""
    chi2: FloatArray
    """Of every sighting; variances include what the markers disagree by, see `slam.landmarks.corner_pose`."""
    excess: float = 0.0
    """What they disagree by beyond the errors of their corners [rad]."""
    cost: float = 0.0
    """The less, the likelier."""

    @property
    def believable(self) -> bool:
        """More sightings agree than do not."""
        return bool(2 * self.fits.sum() > len(self.fits))

    def on_the_floor(self, mount: SE3) -> Location:
        """The robot's pose below the camera, of which the mount is `T_base_camera`."""
        T_map_base = self.T_map_camera @ mount.inverse()
        turned = np.kron(np.eye(2), T_map_base.R) @ mount.adjoint()  # (6, 6) translation and rotation of base, in the map's axes
        J = turned[[0, 1, 5]]
        return Location(T_map_base.to_se2(), J @ self.covariance @ J.T, self.fits, self.chi2)


def locate_camera(known: MarkerField, sightings: Sequence[Sighting], near: SE3 | None) -> CameraLocation | None:
    """The pose that agrees best with sightings of known markers, near a `T_map_camera` if that agrees, else from nothing.

    From nothing both branches of every marker are tried against all; None where that does not decide. The markers' own
    uncertainty is not counted.
    """
    if not sightings:
        return None
    corners = _corners(known, sightings)
    if near is not None and (found := _located(corners, near)).believable:
        return found
    starts = [known.pose_of(sighting.id) @ branch.inverse() for sighting in sightings for branch in sighting.branches]
    best = min((_located(corners, start) for start in starts), key=lambda found: found.cost)
    if not best.believable:
        return None
    lone = int(best.fits.sum()) == 1
    decisive = max(s.ratio for s, fits in zip(sightings, best.fits.tolist(), strict=True) if fits) >= DECISIVE
    return best if not lone or decisive else None


def _corners(known: MarkerField, sightings: Sequence[Sighting]) -> Corners:
    points = np.array([known.pose_of(s.id).transform(square(s.size)) for s in sightings])
    return Corners(points, np.array([s.rays for s in sightings]), np.array([s.covariances for s in sightings]))


def _located(corners: Corners, start: SE3) -> CameraLocation:
    found = refined(corners, start)
    return CameraLocation(found.T_map_camera, found.covariance, found.fits, found.chi2, found.excess, found.cost)
