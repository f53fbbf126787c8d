"""The camera's pose in space, six degrees of freedom, from all corners of all known markers in an image: no flat floor is needed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slam.landmarks.corner_pose import CornerPose, Corners, refined
from slam.landmarks.marker_location import DECISIVE, Location, MarkerField
from slam.landmarks.sighting import Sighting, square
from slam.se3 import SE3


def locate_camera(known: MarkerField, sightings: Sequence[Sighting], near: SE3 | None) -> CornerPose | None:
    """The pose that agrees best with sightings of known markers, near a `T_map_camera` if that agrees, else from nothing.

    From nothing both branches of every marker are tried against all; None where that does not decide. The markers' own
    uncertainty is not counted.
    """
    if not sightings:
        return None
    corners = _corners(known, sightings)
    if near is not None and (found := refined(corners, near)).believable:
        return found
    starts = [known.pose_of(sighting.id) @ branch.inverse() for sighting in sightings for branch in sighting.branches]
    best = min((refined(corners, start) for start in starts), key=lambda found: found.cost)
    if not best.believable:
        return None
    lone = int(best.fits.sum()) == 1
    decisive = max(s.ratio for s, fits in zip(sightings, best.fits.tolist(), strict=True) if fits) >= DECISIVE
    return best if not lone or decisive else None


def on_the_floor(found: CornerPose, mount: SE3) -> Location:
    """The robot's pose below a camera, of which the mount is `T_base_camera`."""
    T_map_base = found.T_map_camera @ mount.inverse()
    turned = np.kron(np.eye(2), T_map_base.R) @ mount.adjoint()  # (6, 6) translation and rotation of base, in the map's axes
    J = turned[[0, 1, 5]]
    return Location(T_map_base.to_se2(), J @ found.covariance @ J.T, found.fits, found.chi2)


def _corners(known: MarkerField, sightings: Sequence[Sighting]) -> Corners:
    points = np.array([known.pose_of(s.id).transform(square(s.size)) for s in sightings])
    return Corners(points, np.array([s.rays for s in sightings]), np.array([s.covariances for s in sightings]))
