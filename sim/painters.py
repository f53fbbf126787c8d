"""What can draw the camera's images, by name; the reference renderers are imported when they are asked for."""

from __future__ import annotations

from collections.abc import Callable

from sim.raster.painter import Painter, RasterPainter
from sim.scenery import Scenery


def _embree(scenery: Scenery) -> Painter:
    from sim.embree_painter import EmbreePainter

    return EmbreePainter(scenery.faces, scenery.light)


def _bullet(scenery: Scenery, *, hardware: bool) -> Painter:
    from sim.bullet_painter import BulletPainter

    return BulletPainter(scenery.faces, scenery.light, hardware=hardware)


PAINTERS: dict[str, Callable[[Scenery], Painter]] = {
    "raster": lambda scenery: RasterPainter(scenery.faces, scenery.light),
    "embree": _embree,
    "tiny": lambda scenery: _bullet(scenery, hardware=False),
    "egl": lambda scenery: _bullet(scenery, hardware=True),
}
