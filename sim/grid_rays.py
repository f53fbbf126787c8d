"""Rays against upright solids, drawn into a polar grid of the beams: exact, and for a sweep faster than any tree."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim import outline_kernel
from sim.lidar_kernel import Met
from sim.rays import Singles
from sim.scene import CODES, box_size, middle, outline
from worlds.parts import Cylinder
from worlds.world import Solid


class GridRays:
    """Rays against solids that stand upright and never move. Cylinders are round."""

    def __init__(self, solids: Sequence[Solid]) -> None:
        rings = [outline(solid) for solid in solids]
        lengths = np.array([len(ring) for ring in rings], np.int64)
        ends = np.cumsum(lengths, dtype=np.int64)
        spans = np.column_stack([ends - lengths, ends, np.array([isinstance(solid, Cylinder) for solid in solids], np.int64)])
        places = np.array([(*middle(solid)[:2], _radius(solid), *solid.z_span) for solid in solids]).reshape(-1, 5)
        sides = np.concatenate([np.empty((0, 4)), *rings])
        along = sides[:, 2:] - sides[:, :2]
        normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
        codes = np.array([CODES[solid.material] for solid in solids], np.int8)
        self._outlines = sides, normals, np.repeat(np.arange(len(solids)), lengths), spans, places, codes

    @property
    def outlines(self) -> outline_kernel.Outlines:
        """What `outline_kernel.meet` takes."""
        return self._outlines

    def cast(self, origins: Singles, directions: Singles, max_range: float) -> Singles:
        """See `sim.rays.Rays.cast`."""
        return self.meet(origins, directions, max_range)[0]

    def meet(self, origins: Singles, directions: Singles, max_range: float) -> Met:
        """See `sim.rays.Rays.meet`."""
        return outline_kernel.meet(self._outlines, origins, directions, max_range)


def _radius(solid: Solid) -> float:
    """Of the circle about its middle [m] that holds it."""
    return solid.radius if isinstance(solid, Cylinder) else 0.5 * float(np.hypot(*box_size(solid)[:2]))
