"""Pictures of a scene: what each pixel sees, its colour and its depth."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hardware.camera_spec import Imager
from sim.raster.kernels.depth import depths
from sim.raster.kernels.faces import Ids, Singles
from sim.raster.kernels.shading import Scene, shade
from sim.raster.kernels.views import Floats, Views
from sim.raster.kernels.visibility import Rays, see
from sim.raster.lens import Lens, lens_of
from sim.surfaces import TEXTURES, Faces
from sim.textures import SIZE, TEXEL, Cells, pyramid
from worlds.living import Light

SKY = np.array([[235.0, 238.0, 242.0], [205.0, 208.0, 212.0]])
"""Colour overhead and at the horizon in light of level 1."""


class Painter(Protocol):
    """Something that makes pictures of one scene through any imager."""

    def see(self, imager: Imager, views: Views) -> Ids:
        """Which face each pixel sees (H, W); -1 where there is none."""
        ...

    def colours(self, imager: Imager, views: Views, ids: Ids, level: float) -> Singles:
        """Colours (H, W, 3), 0 to 255, of what was seen from `views`, in light of a level."""
        ...

    def depths(self, imager: Imager, views: Views, ids: Ids) -> Singles:
        """Depth (H, W) [m] of what was seen; 0 where there is nothing."""
        ...


class RasterPainter:
    """Our own: a z-buffer over the faces."""

    def __init__(self, faces: Faces, light: Light) -> None:
        self._looks = faces.textures, faces.mappings, faces.groups
        self._shapes = faces.shapes
        self._lit = (faces.colours * _levels(faces.planes[:, :3], light)[:, None]).astype(np.float32)
        self._textures = np.stack([pyramid(name) for name in TEXTURES]), 1.0 / TEXEL, SIZE
        self._prints = _summed(faces.prints)

    def see(self, imager: Imager, views: Views) -> Ids:
        """See `Painter.see`."""
        return see(self._shapes, views, _rays(lens_of(imager)))

    def colours(self, imager: Imager, views: Views, ids: Ids, level: float) -> Singles:
        """See `Painter.colours`."""
        lens = lens_of(imager)
        looks = self._lit * np.float32(level), *self._looks
        scene: Scene = self._shapes, looks, self._textures, self._prints, (SKY * level).astype(np.float32)
        picture = np.empty((*ids.shape, 3), np.float32)  # here, where NumPy asks for large pages
        shade(ids, scene, views, _rays(lens), lens.step, picture)
        return picture

    def depths(self, imager: Imager, views: Views, ids: Ids) -> Singles:
        """See `Painter.depths`."""
        return depths(ids, self._shapes, views, _rays(lens_of(imager)))


def _rays(lens: Lens) -> Rays:
    return lens.x, lens.y, lens.y_spans


def _levels(normals: Floats, light: Light) -> Floats:
    """Level of the light (F,) on faces of unit normals (F, 3) (Lambert)."""
    across = math.cos(light.elevation)
    towards = np.array([across * math.cos(light.yaw), across * math.sin(light.yaw), math.sin(light.elevation)])
    return light.ambient + light.diffuse * np.maximum(normals @ towards, 0.0)


def _summed(prints: tuple[Cells, ...]) -> tuple[Floats, NDArray[np.int64]]:
    """Summed areas of all prints and where each is among them; see `kernels.shading.Prints`."""
    tables, places, first = [np.zeros((0, 3))], np.zeros((len(prints), 4), np.int64), 0
    for number, cells in enumerate(prints):
        height, width, _ = cells.shape
        table = np.zeros((height + 1, width + 1, 3))
        table[1:, 1:] = cells.astype(np.float64).cumsum(axis=0).cumsum(axis=1)
        tables.append(table.reshape(-1, 3))
        places[number] = first, height, width, 1 if np.all(cells == cells[:, :, :1]) else 3
        first += len(tables[-1])
    return np.concatenate(tables), places
