"""The camera's pose in space, six degrees of freedom, from all corners of all known markers in an image: no flat floor is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.landmarks.marker_bundle import LOSS
from slam.landmarks.marker_location import DECISIVE, GATE, Location, MarkerField
from slam.landmarks.sighting import Sighting, square
from slam.se2 import FloatArray
from slam.se3 import SE3

ITERATIONS, SETTLED = 15, 1e-7
NEAR, BEHIND = 0.01, 1e6
"""Least depth of a corner [m], and the chi-square of a marker that has one behind it."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraLocation:
    """An answer."""

    T_map_camera: SE3
    covariance: FloatArray
    """(6, 6) of the translation and the rotation vector, in the camera's axes [m, rad]."""
    fits: NDArray[np.bool_]
    """Which of the sightings agree with it."""
    chi2: FloatArray
    """Of every sighting."""

    @property
    def worth(self) -> tuple[int, float]:
        """How many sightings agree, then how well."""
        return int(self.fits.sum()), -float(np.minimum(self.chi2, GATE).sum())

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
    if near is not None and (found := _refined(known, sightings, near)).fits.sum() * 2 > len(sightings):
        return found
    starts = [known.pose_of(sighting.id) @ branch.inverse() for sighting in sightings for branch in sighting.branches]
    best = max((_refined(known, sightings, start) for start in starts), key=lambda found: found.worth, default=None)
    if best is None or 2 * best.fits.sum() <= len(sightings):
        return None
    lone = int(best.fits.sum()) == 1
    decisive = max(s.ratio for s, fits in zip(sightings, best.fits.tolist(), strict=True) if fits) >= DECISIVE
    return best if not lone or decisive else None


def _refined(known: MarkerField, sightings: Sequence[Sighting], start: SE3) -> CameraLocation:
    """Gauss-Newton with Cauchy's loss over the corners (N, 4) of all markers."""
    points = np.array([known.pose_of(s.id).transform(square(s.size)) for s in sightings])  # (N, 4, 3)
    rays, weights = np.array([s.rays for s in sightings]), np.array([s.weights for s in sightings])
    pose, information = start, np.eye(6)
    for _ in range(ITERATIONS):
        residuals, J, chi2 = _linearised(pose, points, rays, weights)
        shares = np.where(chi2 < BEHIND, 1.0 / (1.0 + chi2 / LOSS), 0.0)
        WJ = shares[:, None, None, None] * (weights @ J)
        information = np.asarray(np.einsum("nkri,nkrj->ij", J, WJ), np.float64) + 1e-9 * np.eye(6)
        gradient = np.asarray(np.einsum("nkri,nkr->i", WJ, residuals), np.float64)
        step = np.asarray(np.linalg.solve(information, -gradient), np.float64)
        pose = pose @ SE3.exp(step * min(1.0, 0.5 / max(float(np.linalg.norm(step)), 1e-12)))
        if float(np.abs(step).max()) < SETTLED:
            break
    chi2 = _linearised(pose, points, rays, weights)[2]
    return CameraLocation(pose, np.asarray(np.linalg.inv(information), np.float64), chi2 < GATE, chi2)


def _linearised(T: SE3, points: FloatArray, rays: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Residuals (N, 4, 2), their Jacobian (N, 4, 2, 6) by T exp(xi), and chi-squares (N,)."""
    q = (points - T.t) @ T.R
    depth = np.maximum(q[..., 2], NEAR)
    seen = q[..., :2] / depth[..., None]
    P = np.zeros((*depth.shape, 2, 3))
    P[..., 0, 0] = P[..., 1, 1] = 1.0 / depth
    P[..., 2] = -seen / depth[..., None]
    cross = np.zeros((*depth.shape, 3, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -q[..., 2], q[..., 1], -q[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    residuals = seen - rays
    chi2 = np.einsum("nki,nkij,nkj->n", residuals, weights, residuals)
    behind = (q[..., 2] <= NEAR).any(axis=1)
    return residuals, np.concatenate([-P, P @ cross], axis=-1), np.where(behind, BEHIND, np.minimum(chi2, BEHIND))
