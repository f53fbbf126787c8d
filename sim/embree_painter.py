"""Pictures whose every pixel asks Intel Embree what it sees: slow, exact, what our own renderer is held against."""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from hardware.camera_spec import Imager
from sim.raster.kernels.faces import Ids, Singles
from sim.raster.kernels.views import Views
from sim.raster.lens import lens_of
from sim.raster.painter import RasterPainter
from sim.surfaces import Faces
from worlds.living import Light

FARTHEST = 1000.0
"""How far a ray goes [m]."""


class EmbreePainter(RasterPainter):
    """The same faces, looks and depths; only what a pixel sees is found out by a ray."""

    def __init__(self, faces: Faces, light: Light) -> None:
        super().__init__(faces, light)
        meshes = [faces.triangles(body) for body in range(int(faces.bodies.max()) + 1)]
        self._face_of = [faces_of_triangles for _, faces_of_triangles in meshes]
        self._scenes: list[EmbreeScene] = []
        for triangles, _ in meshes:
            scene = EmbreeScene()
            TriangleMesh(scene, triangles)
            self._scenes.append(scene)

    def see(self, imager: Imager, views: Views) -> Ids:
        """See `Painter.see`."""
        lens = lens_of(imager)
        rays = np.stack([lens.x, lens.y, np.ones_like(lens.x)], axis=-1)  # (H, W, 3)
        nearest, ids = np.full(rays.shape[:2], np.inf, np.float32), np.full(rays.shape[:2], -1, np.int32)
        for body, scene in enumerate(self._scenes):
            origins, directions = _in_body(rays, (views[0][body], views[1][body]))
            depth = scene.run(origins, directions, dists=FARTHEST, query="DISTANCE").reshape(nearest.shape)
            triangle = scene.run(origins, directions, dists=FARTHEST, query="INTERSECT").reshape(nearest.shape)
            closer = (triangle >= 0) & (depth < nearest)
            nearest[closer], ids[closer] = depth[closer], self._face_of[body][triangle[closer]]
        return ids


def _in_body(rays: Singles, view: Views) -> tuple[Singles, Singles]:
    """Origins and directions (H W, 3), of length 1 along the optical axis, of the camera's rays (H, W, 3) in a body's frame."""
    R, o = view
    directions = np.einsum("rij,rci->rcj", np.broadcast_to(R, (len(rays), 3, 3)), rays)
    origins = np.broadcast_to(o[:, None], rays.shape)
    return origins.reshape(-1, 3).astype(np.float32), directions.reshape(-1, 3).astype(np.float32)
