"""How the camera's two sensors err: blur and noise of the colours, the stereo pair's errors of depth."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from hardware.camera_spec import CameraSpec, Imager
from sim.camera_errors import CameraErrors
from sim.raster.kernels import depth as stereo
from sim.raster.kernels import film
from sim.raster.kernels.faces import Singles
from sim.raster.kernels.views import Views
from sim.raster.lens import lens_of
from sim.raster.painter import Painter
from sim.surfaces import MATERIALS, Faces

NOISE = 1 << 20
"""Numbers of noise that a colour sensor draws once; every row of an image takes another stretch of them."""
ROOM = 256
"""How much larger than the image the field of noise is that every depth image takes another piece of [px]."""
PATCH = 5.0
"""Size of the patches in which the depth is missing on difficult surfaces [px]."""


class Film:
    """The colour sensor."""

    def __init__(self, imager: Imager, errors: CameraErrors, faces: Faces, rng: np.random.Generator) -> None:
        self._imager = imager
        self._errors = errors
        self._shapes = faces.shapes
        self._rng = rng
        self._noise = rng.standard_normal(NOISE, np.float32)

    def draw(self) -> NDArray[np.int64]:
        """The random part of one image."""
        return self._rng.integers(0, NOISE - 3 * self._imager.width, self._imager.height)

    def expose(self, painter: Painter, views: tuple[Views, Views], level: float, drawn: NDArray[np.int64]) -> NDArray[np.uint8]:
        """An image (H, W, 3).

        Args:
            painter: of what is seen.
            views: of every row in the middle of its exposure, and at both ends of the exposure of the middle row.
            level: of the light.
            drawn: from `draw`.
        """
        rows, ends = views
        ids = painter.see(self._imager, rows)
        picture = painter.colours(self._imager, rows, ids, level)
        noise = self._noise, drawn, self._errors.read_noise, self._errors.shot_noise
        if ends[0].shape[1] == 1:
            return film.develop(picture, *noise)
        lens = lens_of(self._imager)
        return film.develop_blurred(picture, (ids, self._shapes, ends), (lens.x, lens.y), 1.0 / lens.step, noise)


class Stereo:
    """The depth camera: the left of two imagers, and what the right one adds."""

    def __init__(self, spec: CameraSpec, errors: CameraErrors, faces: Faces, rng: np.random.Generator) -> None:
        self._imager = spec.depth
        focal = spec.depth.focal[0]
        self._law = focal * spec.baseline, errors.subpixel, errors.disparity_steps, errors.occlusion
        self._limits = spec.range_min, errors.range_max
        self._rng = rng
        by_material = {"matte": errors.lost_matte, "dark": errors.lost_dark, "glossy": errors.lost_glossy, "glass": errors.lost_glass}
        shares = np.array([by_material[material] for material in MATERIALS], np.float32)
        self._lost = np.append(shares[faces.materials], np.float32(0.0))  # the last one is for no face
        size = spec.depth.height + ROOM, spec.depth.width + ROOM
        self._noise = _smooth_noise(rng, size, errors.patch) if errors.subpixel > 0.0 else np.zeros(size, np.float32)
        self._patches = ndtr(_smooth_noise(rng, size, PATCH)) if shares.any() else np.ones(size, np.float32)

    def draw(self) -> NDArray[np.int64]:
        """The random part of one image."""
        return self._rng.integers(0, ROOM, 4)

    def measure(self, painter: Painter, views: Views, drawn: NDArray[np.int64]) -> Singles:
        """Depth (H, W) [m], nan where there is none.

        Args:
            painter: of what is seen.
            views: of the moment.
            drawn: from `draw`.
        """
        ids = painter.see(self._imager, views)
        noise, patches = self._piece(self._noise, drawn[:2]), self._piece(self._patches, drawn[2:])
        return stereo.measure(painter.depths(self._imager, views, ids), ids, self._lost, noise, patches, self._law, self._limits)

    def _piece(self, tile: Singles, corner: NDArray[np.int64]) -> Singles:
        row, column = corner.tolist()
        return tile[row : row + self._imager.height, column : column + self._imager.width]


def _smooth_noise(rng: np.random.Generator, size: tuple[int, int], patch: float) -> Singles:
    """Noise (H, W) of deviation 1 that is alike over `patch` pixels."""
    down, across = np.fft.fftfreq(size[0])[:, None], np.fft.rfftfreq(size[1])
    damping = np.exp(-0.5 * (math.pi * patch) ** 2 * (down**2 + across**2))
    noise = np.fft.irfft2(np.fft.rfft2(rng.standard_normal(size)) * damping, size)
    return (noise / noise.std()).astype(np.float32)
