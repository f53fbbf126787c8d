"""Where a scan may move a belief: along the directions of which it says something, and along no other.

A likelihood field always has an opinion about the way along a corridor: by the roughness of mapped walls, and by the single beams that
pass a door's edge or end on somebody. And of particles that are weighed by the way across, few remain, whose mean along the corridor is
that of a few. The localizability matrix D has no opinion there; so there the belief goes on as the wheels say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slam.se2 import SE2, FloatArray, wrap_angle

FEW = 10.0
"""Beams that meet walls across a direction, of which half is not to be relied on: they may be those on a person or on a door's edge."""
WIDE = 0.15
"""Standard deviation of a set beyond which D, which is that at its mean, does not speak for all of it, and beams that deserve no trust lead
no farther astray than the set already is [m]."""
LEAST_LEVER = 0.1
"""Lever of one beam below which a scan says nothing of the heading [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenDirections:
    """How far a scan is relied on, along the two directions of the plane of which it says least and most."""

    axes: FloatArray
    """(2, 2) unit vectors in its columns, in the map; the one of which least is said comes first."""
    shares: FloatArray
    """(2,) from 0, nothing, to 1."""

    @classmethod
    def of(cls, D: FloatArray, C: FloatArray, beam: float) -> SeenDirections:
        """Those of a localizability matrix D (3, 3), by how many beams it has along each, whatever the heading: n^2 / (n^2 + `FEW`^2).

        Args:
            D: of (x, y, yaw) in the map [1/m^2, 1/rad^2].
            C: covariance (3, 3) of the predicted set [m, rad]; where it is `WIDE`, the scan is relied on.
            beam: what it has of one beam that meets a wall straight on [1/m^2].
        """
        position = D[:2, :2] - np.outer(D[:2, 2], D[:2, 2]) / max(float(D[2, 2]), beam * LEAST_LEVER**2)
        beams, axes = np.linalg.eigh(position / beam)
        squares = np.square(np.maximum(beams, 0.0))
        wide = np.einsum("ik,ij,jk->k", axes, C[:2, :2], axes) > WIDE**2
        return cls(axes, np.where(wide, 1.0, squares / (squares + FEW**2)))

    def level(self, poses: FloatArray, mean: SE2) -> FloatArray:
        """Poses (N, 3) at which the scan is judged: moved as near to their mean along an axis as little is said of it."""
        judged = poses.copy()
        judged[:, :2] = (mean.x, mean.y) + (poses[:, :2] - (mean.x, mean.y)) @ ((self.axes * self.shares) @ self.axes.T)
        return judged

    def fuse(self, P_odo: SE2, P_scan: SE2, C: FloatArray) -> SE2:
        """The pose to which a scan moves the prediction: along an axis of which nothing is said, what the others say about it through C.

        Args:
            P_odo: mean of the predicted set.
            P_scan: mean of the weighed set.
            C: covariance (3, 3) of the prediction [m, rad].
        """
        yaw = wrap_angle(P_scan.yaw - P_odo.yaw)
        weak, strong = (np.array([P_scan.x - P_odo.x, P_scan.y - P_odo.y]) @ self.axes).tolist()
        Q = np.eye(3)
        Q[:2, :2] = self.axes
        R = Q.T @ C @ Q
        strong = _mixed(float(R[1, 2] * yaw / R[2, 2]) if R[2, 2] > 0.0 else 0.0, strong, self.shares[1])
        by_others = float(R[0, 1:] @ np.linalg.pinv(R[1:, 1:], hermitian=True) @ (strong, yaw))
        x, y = self.axes @ (_mixed(by_others, weak, self.shares[0]), strong)
        return SE2(P_odo.x + float(x), P_odo.y + float(y), P_scan.yaw)


def _mixed(without: float, seen: float, share: float) -> float:
    """From the one to the other as the share goes from 0 to 1."""
    return without + share * (seen - without)
