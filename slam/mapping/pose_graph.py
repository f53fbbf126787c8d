"""The robust pose graph: odometry that is trusted, loop closures that have to agree."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from slam.errors import PoseGraphError
from slam.evaluation.poses import transform
from slam.mapping.chordal import chordal_poses
from slam.mapping.closure_selection import Selection, select
from slam.mapping.least_squares import LeastSquares
from slam.mapping.pose_edges import Edges, IndexArray
from slam.se2 import SE2, FloatArray

LEAST_INFORMATION = 1e-6
"""Added along every axis, so that an axis of which nothing is known has a covariance too [1/m^2, 1/rad^2]."""


class PoseGraph:
    """Poses, trusted edges and loop closures; grows, and is optimised as often as wanted, from the poses that it had last.

    Trusted edges (odometry, matches of neighbours) are never rejected and must connect all nodes; node 0 stays where it is.
    """

    def __init__(self) -> None:
        self._poses: list[FloatArray] = []
        self._nodes: list[tuple[int, int]] = []
        self._measured: list[FloatArray] = []
        self._information: list[FloatArray] = []
        self._closures: list[int] = []
        self._believed: set[int] = set()
        self._rejected: set[int] = set()
        self._contested = 0
        self._solver: LeastSquares | None = None

    def __len__(self) -> int:
        return len(self._poses)

    def add_node(self, T_map_node: SE2) -> int:
        """Add a node at a first guess; returns its number: 0, 1, 2, ..."""
        self._poses.append(T_map_node.as_array())
        self._solver = None
        return len(self._poses) - 1

    def add_edge(self, i: int, j: int, T_i_j: SE2, information: FloatArray, closure: bool) -> int:
        """Add a measured relative pose; returns the edge's number: 0, 1, 2, ...

        Args:
            i: the node that it is measured from.
            j: the node that it is measured to.
            T_i_j: pose of j in i.
            information: (3, 3) of x, y [1/m^2] and yaw [1/rad^2] in the frame of j; an axis of which nothing is known has 0.
            closure: it may be wrong, so it may be rejected.

        Raises:
            PoseGraphError: no such nodes, a pose that is not finite, or an information matrix that cannot be one.
        """
        if not (0 <= i < len(self) and 0 <= j < len(self) and i != j):
            raise PoseGraphError(f"an edge from node {i} to node {j}; must join two of the nodes 0 to {len(self) - 1}")
        measured, matrix = T_i_j.as_array(), np.array(information, dtype=np.float64)
        if not (np.all(np.isfinite(measured)) and _is_information(matrix)):
            raise PoseGraphError(
                f"edge {i}-{j}: pose {measured.tolist()}, information {matrix.tolist()}; must be finite, the matrix (3, 3), not negative"
            )
        self._nodes.append((i, j))
        self._measured.append(measured)
        self._information.append(0.5 * (matrix + matrix.T) + LEAST_INFORMATION * np.eye(3))
        edge = len(self._nodes) - 1
        if closure:
            self._closures.append(edge)
        self._solver = None
        return edge

    def optimise(self) -> FloatArray:
        """Poses (N, 3) x, y [m], yaw [rad] of all nodes in the map: the optimum of the trusted edges and the closures that are believed.

        Every closure is weighed again. Where closures agree with each other but not with what was believed so far, all are weighed
        from nothing, and what costs less is kept.

        Raises:
            PoseGraphError: the trusted edges do not connect all nodes.
        """
        if len(self) < 2:
            return self.poses
        trusted, closures = self._connected(), self._edges(self._closures)
        believed = np.isin(self._closures, list(self._believed))
        chosen = select(Selection.settled(self.poses, trusted, closures, believed))
        if chosen.contested > self._contested:
            scale = chosen.scale
            chosen = min(chosen, self._from_nothing(trusted, closures), key=lambda selection: selection.cost(scale))
        self._contested = chosen.contested
        self._believed = {edge for edge, accepted in zip(self._closures, chosen.accepted, strict=True) if accepted}
        self._rejected = set(self._closures) - self._believed
        self._poses, self._solver = list(chosen.poses), chosen.solver
        return self.poses

    @property
    def poses(self) -> FloatArray:
        """Poses (N, 3) in the map: of the last `optimise`, and the guesses of nodes that came later."""
        return np.array(self._poses).reshape(-1, 3)

    @property
    def rejected(self) -> set[int]:
        """Numbers of the closures that the last `optimise` did not believe; any `optimise` may believe them yet."""
        return set(self._rejected)

    @property
    def chi2(self) -> float:
        """e^T Omega e, summed over the trusted edges and the closures that are believed, at the present poses."""
        return float(self._present().edges.chi2(self.poses).sum())

    def relative_covariances(self, pairs: IndexArray) -> FloatArray:
        """Covariances (K, 3, 3) [m, rad] of T_i_j for pairs (K, 2) of nodes i, j, in the frame of j, as information is given.

        Raises:
            PoseGraphError: the trusted edges do not connect all nodes.
        """
        nothing = Edges(np.asarray(pairs, dtype=np.int64).reshape(-1, 2), np.zeros((len(pairs), 3)), np.zeros((len(pairs), 3, 3)))
        return self._present().foresee(self.poses, nothing)[1]

    def _present(self) -> LeastSquares:
        """The believed edges, those added since the last `optimise` included if they are trusted."""
        if self._solver is None:
            self._solver = LeastSquares(len(self), self._connected().and_(self._edges(sorted(self._believed))))
        return self._solver

    def _from_nothing(self, trusted: Edges, closures: Edges) -> Selection:
        start = transform(SE2.from_array(self._poses[0]), chordal_poses(len(self), trusted))
        return select(Selection.settled(start, trusted, closures, np.zeros(len(closures), np.bool_)))

    def _connected(self) -> Edges:
        closures = set(self._closures)
        trusted = self._edges([edge for edge in range(len(self._nodes)) if edge not in closures])
        i, j = trusted.nodes.T
        _, pieces = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(len(self), len(self))), directed=False)
        if np.any(pieces != pieces[0]):
            raise PoseGraphError(f"node {np.argmax(pieces != pieces[0])} is not connected to node 0 by edges that are no closures; add one")
        return trusted

    def _edges(self, numbers: list[int]) -> Edges:
        return Edges(
            np.array([self._nodes[edge] for edge in numbers], dtype=np.int64).reshape(-1, 2),
            np.array([self._measured[edge] for edge in numbers]).reshape(-1, 3),
            np.array([self._information[edge] for edge in numbers]).reshape(-1, 3, 3),
        )


def _is_information(matrix: FloatArray) -> bool:
    if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)):
        return False
    return bool(np.linalg.eigvalsh(matrix)[0] >= -1e-12 * np.abs(matrix).max())
