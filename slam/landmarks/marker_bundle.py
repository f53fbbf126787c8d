"""The least-squares problem of a marker map: robot poses on a floor, markers in space, the camera's mount."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.kernels.marker_bundle import State, Steps, Views, chi_squares, eliminated, normal_equations, substituted
from slam.kernels.planar_pose import rotation
from slam.landmarks.sighting import Sighting
from slam.se2 import FloatArray
from slam.se3 import SE3

LOSS = 40.0
"""Chi-square of a sighting (8 on average) at which it counts half."""
MOUNT_DEVIATION = (0.003, 0.003, 0.003, 0.01, 0.01, 0.01)
"""How far the camera's mount may be from what the robot's description says: translation [m], rotation [rad]."""
SETTLED = 1e-6
"""Relative gain below which an iteration was the last."""
DAMPING = 1e-6
HARDER, SOFTER, HOPELESS = 10.0, 0.2, 1e8


def views_of(sightings: Sequence[Sighting], poses: Sequence[int], markers: Sequence[int]) -> Views:
    """Sightings as the kernels take them: from these poses, of these markers."""
    return (
        np.array(poses, dtype=np.int64),
        np.array(markers, dtype=np.int64),
        np.array([s.rays for s in sightings]).reshape(-1, 4, 2),
        np.array([s.weights for s in sightings]).reshape(-1, 4, 2, 2),
        np.array([0.5 * s.size for s in sightings]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """What is known of the first pose, whatever is seen from it."""

    mean: FloatArray
    """(3,) x, y [m], yaw [rad]."""
    information: FloatArray
    """(3, 3)"""


@dataclass(slots=True, eq=False)
class Bundle:
    """Poses, markers and mount that agree best with sightings, steps and priors. `solve` improves it in place."""

    poses: FloatArray
    """(N, 3) of `T_map_base`: x, y [m], yaw [rad]."""
    rotations: FloatArray
    """(M, 3, 3) rotations of `T_map_marker`."""
    translations: FloatArray
    """(M, 3) translations [m]."""
    mount: SE3
    """`T_base_camera`."""
    views: Views
    steps: Steps
    prior: Prior
    free: NDArray[np.bool_]
    """(M,) whether a marker is an unknown."""
    nominal: SE3 | None = None
    """`T_base_camera` as described, when the mount is an unknown."""

    def solve(self, iterations: int) -> float:
        """Levenberg-Marquardt; returns the cost, robust sum of squares."""
        damping, (normal, cost) = DAMPING, self._linearised()
        for _ in range(iterations):
            before, kept = cost, (self.poses, self.rotations, self.translations, self.mount)
            while damping < HOPELESS:
                self._move(*self._step(normal, damping))
                tried, cost = self._linearised()
                if cost <= before:
                    normal, damping = tried, max(damping * SOFTER, DAMPING)
                    break
                (self.poses, self.rotations, self.translations, self.mount), cost, damping = kept, before, damping * HARDER
            if before - cost <= SETTLED * before:
                break
        return cost

    def chi2(self) -> FloatArray:
        """(S,) of every sighting: squared reprojection errors over their variance."""
        return chi_squares(self._state(), self.views)

    def covariances(self) -> tuple[FloatArray, FloatArray]:
        """(M, 6, 6) of markers (translation, rotation vector in the map) [m, rad], 0 of those that are known; (3, 3) of the last pose."""
        (App, Aoff, B, D, bp, _), _ = self._linearised()
        root, _, Y, _ = eliminated(App, Aoff, B, bp)
        rest = inverse(_reduced(D, Y)) if len(D) else D
        out, at = np.zeros((len(self.translations), 6, 6)), self._places()[0]
        for marker, place in enumerate(at.tolist()):
            if place >= 0:
                out[marker] = rest[place : place + 6, place : place + 6]
        X = root[-1].T @ Y[-1]
        return out, root[-1].T @ root[-1] + X @ rest @ X.T

    def _state(self) -> State:
        return self.poses, self.rotations, self.translations, np.array(self.mount.R), np.array(self.mount.t)

    def _places(self) -> tuple[NDArray[np.int64], int]:
        at = np.where(self.free, 6 * (np.cumsum(self.free) - 1), -1).astype(np.int64)
        return at, 6 * int(self.free.sum()) + (6 if self.nominal is not None else 0)

    def _linearised(self) -> tuple[tuple[FloatArray, ...], float]:
        (App, Aoff, B, D, bp, bd), cost = normal_equations(self._state(), self.views, self.steps, self._places(), LOSS)
        off = self.poses[0] - self.prior.mean
        off[2] = np.remainder(off[2] + np.pi, 2.0 * np.pi) - np.pi
        App[0] += self.prior.information
        bp[0] += self.prior.information @ off
        cost += float(off @ self.prior.information @ off)
        if self.nominal is not None:
            shift = _difference(self.mount, self.nominal)
            weight = np.array(MOUNT_DEVIATION) ** -2.0
            D[-6:, -6:] += np.diag(weight)
            bd[-6:] += weight * shift
            cost += float(weight @ shift**2)
        return (App, Aoff, B, D, bp, bd), cost

    def _step(self, normal: tuple[FloatArray, ...], damping: float) -> tuple[FloatArray, FloatArray]:
        """Steps of the poses (N, 3) and of the rest (n,)."""
        App, Aoff, B, D, bp, bd = normal
        damped = App + damping * App * np.eye(3)
        root, below, Y, y = eliminated(damped, Aoff, B, bp)
        S = _reduced(D + damping * np.diag(np.diag(D)), Y)
        right = bd - np.tensordot(Y, y, axes=((0, 1), (0, 1)))
        rest = -np.asarray(np.linalg.solve(S, right), dtype=np.float64) if len(S) else bd
        return substituted((root, below), Y, y, rest), rest

    def _move(self, poses: FloatArray, rest: FloatArray) -> None:
        self.poses = self.poses + poses
        R, t = self.rotations.copy(), self.translations.copy()
        for marker, place in enumerate(self._places()[0].tolist()):
            if place >= 0:
                t[marker] += rest[place : place + 3]
                R[marker] = rotation(rest[place + 3 : place + 6]) @ R[marker]
        self.rotations, self.translations = R, t
        if self.nominal is not None:
            self.mount = SE3(rotation(rest[-3:].copy()) @ self.mount.R, self.mount.t + rest[-6:-3])


def inverse(A: FloatArray) -> FloatArray:
    """A^-1."""
    return np.asarray(np.linalg.inv(A), dtype=np.float64)


def _reduced(D: FloatArray, Y: FloatArray) -> FloatArray:
    """Schur complement D - Y^T Y of what is left when the poses are eliminated."""
    flat = Y.reshape(-1, Y.shape[2])
    return D - flat.T @ flat


def _difference(T: SE3, nominal: SE3) -> FloatArray:
    """(6,) translation and rotation vector from one mount to another, in base."""
    return np.concatenate([T.t - nominal.t, SE3(T.R @ nominal.R.T).log()[3:]])
