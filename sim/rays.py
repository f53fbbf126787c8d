"""Ray casters with one face; here `embree` on triangles, elsewhere `grid` on upright solids and `bullet` in the physics itself."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim import lidar_kernel
from sim.errors import SimError
from sim.lidar_kernel import Codes, Met
from sim.scene import Triangles
from slam.se2 import FloatArray

Singles = NDArray[np.float32]


class Rays(Protocol):
    """Something that rays can hit."""

    def cast(self, origins: Singles, directions: Singles, max_range: float) -> Singles:
        """Distance to the first hit (N,) [m] along rays of origins (N, 3) [m] and unit directions (N, 3); inf where nothing is hit."""
        ...

    def meet(self, origins: Singles, directions: Singles, max_range: float) -> Met:
        """As `cast`, with the cosine of the incidence angle and the material of what is hit."""
        ...


class EmbreeRays:
    """Rays against triangles that do not move in the rays' frame, by Intel Embree."""

    def __init__(self, triangles: Triangles, materials: Codes | None = None) -> None:
        try:  # late: the kinematic twin does without it where there is no wheel
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as error:
            raise SimError("rays by Embree need embreex: pip install embreex; the kinematic twin also has rays 'grid'") from error
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, triangles)
        self._planes = planes_of(triangles)
        self._materials = np.zeros(len(triangles), np.int8) if materials is None else materials

    def cast(self, origins: Singles, directions: Singles, max_range: float) -> Singles:
        """See `Rays.cast`; origins and directions in the frame of the triangles."""
        ranges = self._scene.run(origins, directions, dists=max_range, query="DISTANCE")
        ranges[ranges >= np.float32(max_range)] = np.inf
        return ranges

    def meet(self, origins: Singles, directions: Singles, max_range: float) -> Met:
        """See `Rays.meet`."""
        triangles = self._scene.run(origins, directions, dists=max_range, query="INTERSECT")
        return lidar_kernel.planes_met(triangles, self._planes, self._materials, (origins, directions))


def planes_of(triangles: Triangles | FloatArray) -> NDArray[np.float64]:
    """Unit normal and distance from the origin (M, 4) of the triangles' planes."""
    corners = triangles.astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(lengths > 0.0, lengths, 1.0)
    return np.column_stack([normals, (normals * corners[:, 0]).sum(axis=1)])
