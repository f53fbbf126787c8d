"""Measured relative poses, by the thousand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.kernels import pose_graph
from slam.se2 import FloatArray

IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """E edges of a pose graph."""

    nodes: IndexArray
    """(E, 2) of i, j"""
    measured: FloatArray
    """(E, 3) T_i_j: x, y [m], yaw [rad]"""
    information: FloatArray
    """(E, 3, 3), positive definite, of the error T_i_j^-1 T_i^-1 T_j: in the frame of j"""

    def __len__(self) -> int:
        return len(self.nodes)

    def of(self, which: BoolArray | IndexArray) -> Edges:
        """Some of them."""
        return Edges(self.nodes[which], self.measured[which], self.information[which])

    def and_(self, others: Edges) -> Edges:
        """These and others."""
        return Edges(
            np.concatenate([self.nodes, others.nodes]),
            np.concatenate([self.measured, others.measured]),
            np.concatenate([self.information, others.information]),
        )

    def chi2(self, poses: FloatArray) -> FloatArray:
        """e^T Omega e (E,) of each."""
        return pose_graph.edge_chi2(poses, self.arrays)

    def covariance(self) -> FloatArray:
        """(E, 3, 3)."""
        return np.linalg.inv(self.information).astype(np.float64)

    @property
    def arrays(self) -> tuple[IndexArray, FloatArray, FloatArray]:
        """As kernels take them."""
        return self.nodes, self.measured, self.information
