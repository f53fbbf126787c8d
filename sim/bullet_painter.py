"""Pictures by PyBullet's own renderers, TinyRenderer and OpenGL: pinhole, one moment for all rows, light without levels."""

from __future__ import annotations

import importlib.util
import math
import tempfile
import weakref
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hardware.camera_spec import Imager
from sim.bullet import pybullet
from sim.errors import PhysicsError
from sim.raster.kernels.faces import Ids, Singles
from sim.raster.kernels.views import Views
from sim.raster.painter import RasterPainter
from sim.surfaces import TEXTURES, Faces
from sim.textures import SIZE, TEXEL, surface_texture
from slam.se2 import FloatArray
from slam.se3 import SE3
from worlds.living import Light

NEAR, FAR = 0.05, 50.0
"""Depths between which something is drawn [m]."""
HEADROOM = 0.5
"""Share of white that a repeating texture's mean brightness is stored as: some of it is brighter."""
PRINT_PIXELS = 16
"""Side of a print's cell in its texture."""
PRINT_HEIGHT = 0.002
"""How far prints stand out, so that they win over their wall in a depth buffer of 24 bits [m]."""

Numbers = NDArray[np.int64]


class BulletPainter(RasterPainter):
    """Colours and depths by PyBullet; which face a pixel sees is found out by our own renderer.

    Raises:
        PhysicsError: PyBullet gives no client, or has no OpenGL.
    """

    def __init__(self, faces: Faces, light: Light, *, hardware: bool) -> None:
        super().__init__(faces, light)
        self._light = light
        self._client = pybullet.connect(pybullet.DIRECT)
        if self._client < 0:
            raise PhysicsError("PyBullet gives no more physics clients; close some robots first")
        weakref.finalize(self, pybullet.disconnect, self._client)
        self._renderer = pybullet.ER_BULLET_HARDWARE_OPENGL if hardware else pybullet.ER_TINY_RENDERER
        if hardware:
            self._load_opengl()
        with tempfile.TemporaryDirectory() as folder:
            self._bodies = _add_faces(faces, Path(folder), self._client)

    def colours(self, imager: Imager, views: Views, ids: Ids, level: float) -> Singles:
        """See `Painter.colours`."""
        picture, _ = self._take(imager, views, level)
        sky = super().colours(imager, views, np.full_like(ids, -1), level)
        return np.where((ids < 0)[:, :, None], sky, picture).astype(np.float32)

    def depths(self, imager: Imager, views: Views, ids: Ids) -> Singles:
        """See `Painter.depths`."""
        _, buffer = self._take(imager, views, 1.0)
        depth = FAR * NEAR / (FAR - (FAR - NEAR) * buffer.astype(np.float64))
        return np.where(ids >= 0, depth, 0.0).astype(np.float32)

    def _take(self, imager: Imager, views: Views, level: float) -> tuple[Singles, Singles]:
        """Colours (H, W, 3) and depth buffer (H, W) at the middle row's moment."""
        R, o = views[0][:, views[0].shape[1] // 2], views[1][:, views[0].shape[1] // 2]
        for body, shapes in enumerate(self._bodies):
            T_world_body = SE3(R[0], -R[0] @ o[0]).inverse() @ SE3(R[body], -R[body] @ o[body])
            for shape in shapes:
                pybullet.resetBasePositionAndOrientation(
                    shape, T_world_body.t.tolist(), T_world_body.quaternion().tolist(), physicsClientId=self._client
                )
        light = self._light
        across = math.cos(light.elevation)
        _, _, colours, depth, _ = pybullet.getCameraImage(
            imager.width,
            imager.height,
            viewMatrix=_view_matrix(R[0], o[0]),
            projectionMatrix=_projection_matrix(imager),
            lightDirection=(across * math.cos(light.yaw), across * math.sin(light.yaw), math.sin(light.elevation)),
            lightAmbientCoeff=light.ambient * level,
            lightDiffuseCoeff=light.diffuse * level,
            lightSpecularCoeff=0.0,
            shadow=0,
            renderer=self._renderer,
            physicsClientId=self._client,
        )
        shape = imager.height, imager.width
        return np.asarray(colours, np.float32).reshape(*shape, 4)[:, :, :3], np.asarray(depth, np.float32).reshape(shape)

    def _load_opengl(self) -> None:
        found = importlib.util.find_spec("eglRenderer")
        if found is None or pybullet.loadPlugin(found.origin or "", "_eglRendererPlugin", physicsClientId=self._client) < 0:
            raise PhysicsError("PyBullet has no OpenGL (EGL) here; use the camera raster, embree or tiny")


def _add_faces(faces: Faces, folder: Path, client: int) -> list[list[int]]:
    """Add everything; returns PyBullet's bodies that stand for each of ours."""
    bodies: list[list[int]] = [[] for _ in range(int(faces.bodies.max()) + 1)]
    textures: dict[int, int] = {}
    looks = np.column_stack([faces.bodies, faces.textures, faces.colours])
    for look in np.unique(looks, axis=0):
        index = np.flatnonzero((looks == look).all(axis=1))
        body, texture = int(look[0]), int(look[1])
        if texture not in textures:
            textures[texture] = _load_texture(faces, texture, folder, client)
        bodies[body].append(_add_mesh(faces, index, textures[texture], folder, client))
    return bodies


def _load_texture(faces: Faces, texture: int, folder: Path, client: int) -> int:
    if texture < 0:
        picture = faces.prints[-1 - texture].repeat(PRINT_PIXELS, axis=0).repeat(PRINT_PIXELS, axis=1)[:, :, ::-1]
    else:
        shades = surface_texture(TEXTURES[texture])
        picture = np.repeat(np.clip(shades * HEADROOM * 255.0, 0.0, 255.0).round()[:, :, None], 3, axis=2).astype(np.uint8)
    path = folder / f"{texture}.png"
    cv2.imwrite(str(path), picture)
    return pybullet.loadTexture(str(path), physicsClientId=client)


def _add_mesh(faces: Faces, index: Numbers, texture: int, folder: Path, client: int) -> int:
    """One body of faces of one look."""
    path, printed = folder / f"{index[0]}.obj", bool(faces.textures[index[0]] < 0)
    path.write_text(_wavefront(faces, index))
    own = faces.colours[index[0]] / 255.0 * (1.0 if printed else 1.0 / HEADROOM)
    shape = pybullet.createVisualShape(pybullet.GEOM_MESH, fileName=str(path), rgbaColor=(*own.tolist(), 1.0), physicsClientId=client)
    body = pybullet.createMultiBody(0.0, baseVisualShapeIndex=shape, physicsClientId=client)
    pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=client)
    return body


def _wavefront(faces: Faces, index: Numbers) -> str:
    """The faces of one look as an OBJ file, v of the texture upward."""
    planes, texture = faces.planes[index], int(faces.textures[index[0]])
    corners = faces.corners[index] + (PRINT_HEIGHT if texture < 0 else 0.0) * planes[:, None, :3]
    places = np.einsum("fij,fkj->fki", faces.mappings[index, :, :3], faces.corners[index]) + faces.mappings[index, None, :, 3]
    size: FloatArray = np.array(faces.prints[-1 - texture].shape[1::-1]) if texture < 0 else np.full(2, SIZE * TEXEL)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners.reshape(-1, 3).tolist()]
    lines += [f"vt {u:.9g} {1.0 - v:.9g}" for u, v in (places / size).reshape(-1, 2).tolist()]
    lines += [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in planes[:, :3].tolist()]
    for face in range(len(index)):
        a, b, c, d = range(4 * face + 1, 4 * face + 5)
        lines += [f"f {i}/{i}/{face + 1} {j}/{j}/{face + 1} {k}/{k}/{face + 1}" for i, j, k in ((a, b, c), (a, c, d))]
    return "\n".join(lines) + "\n"


def _view_matrix(R: FloatArray, o: FloatArray) -> list[float]:
    """OpenGL's, column by column: it looks along -z with y up."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag([1.0, -1.0, -1.0]) @ R
    matrix[:3, 3] = -matrix[:3, :3] @ o
    return matrix.T.ravel().tolist()


def _projection_matrix(imager: Imager) -> list[float]:
    """OpenGL's, column by column, whose pixels begin where ours have their centres less a half."""
    (fx, fy), (cx, cy) = imager.focal, imager.centre
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 2] = 2.0 * fx / imager.width, 1.0 - 2.0 * (cx + 0.5) / imager.width
    matrix[1, 1], matrix[1, 2] = 2.0 * fy / imager.height, 2.0 * (cy + 0.5) / imager.height - 1.0
    matrix[2, 2], matrix[2, 3], matrix[3, 2] = -(FAR + NEAR) / (FAR - NEAR), -2.0 * FAR * NEAR / (FAR - NEAR), -1.0
    return matrix.T.ravel().tolist()
