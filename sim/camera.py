"""The Intel RealSense D435: a colour camera with a rolling shutter and a stereo depth camera. The errors' sources are in docs/camera.md."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hardware.spec import RobotSpec
from sim.camera_errors import CameraErrors
from sim.film import Film, Stereo
from sim.motion import NANOSECONDS, Motion
from sim.raster.painter import Painter
from sim.scenery import Scenery
from slam.messages import RgbdImage

ARRIVAL = 0.05
"""From the middle of the exposure to the arrival of the images [s]: read-out, transfer and the host's matching of the two."""

_POOL = ThreadPoolExecutor(2, "camera")
"""Colour and depth are drawn beside the physics; nothing they do depends on when."""


@dataclass(frozen=True, slots=True, eq=False)
class _Shot:
    """An image in the making."""

    stamp: float
    colour: Future[NDArray[np.uint8]]
    depth: Future[NDArray[np.float32]]


class Camera:
    """Takes an image every `period`; it is drawn when its last row has been exposed, and arrives `ARRIVAL` after its stamp.

    Raises:
        SpecError: the robot has no camera.
    """

    def __init__(self, spec: RobotSpec, errors: CameraErrors, scenery: Scenery, painter: Painter, rng: np.random.Generator) -> None:
        self._infos = spec.camera_infos()
        camera = spec.require_camera()
        self._period, self._exposure = camera.period, errors.exposure
        self._scenery = scenery
        self._painter = painter
        self._film = Film(camera.colour, errors, scenery.faces, rng)
        self._stereo = Stereo(camera, errors, scenery.faces, rng)
        self._rows = camera.colour.row_times()
        self._half = float(self._rows[-1]) + 0.5 * errors.exposure
        self._images = 0
        self._shots: deque[_Shot] = deque()

    @property
    def _stamp(self) -> float:
        return round(self._half + self._images * self._period, NANOSECONDS)

    @property
    def due(self) -> float:
        """End of the next image's exposure [s]."""
        return self._stamp + self._half

    def shoot(self, motion: Motion) -> None:
        """Take the image that is due."""
        stamp = self._stamp
        self._images += 1
        self._shots.append(_Shot(stamp, self._colour(motion, stamp), self._depth(motion, stamp)))

    def arrived(self, now: float) -> list[tuple[float, RgbdImage]]:
        """When images have arrived [s] since the last call, and they, oldest first."""
        images: list[tuple[float, RgbdImage]] = []
        while self._shots and (arrival := round(self._shots[0].stamp + ARRIVAL, NANOSECONDS)) <= now:
            shot = self._shots.popleft()
            images.append((arrival, RgbdImage(shot.stamp, shot.colour.result(), shot.depth.result(), *self._infos)))
        return images

    def _colour(self, motion: Motion, stamp: float) -> Future[NDArray[np.uint8]]:
        """What depends on the present is taken here; the rest is left to the pool."""
        mount, exposure = self._infos[0].T_base_camera, self._exposure * np.array([-0.5, 0.5])
        rows = self._scenery.views(motion, mount, stamp + self._rows)
        ends = self._scenery.views(motion, mount, stamp + exposure)
        return _POOL.submit(self._film.expose, self._painter, (rows, ends), self._scenery.light.level_at(stamp), self._film.draw())

    def _depth(self, motion: Motion, stamp: float) -> Future[NDArray[np.float32]]:
        views = self._scenery.views(motion, self._infos[1].T_base_camera, np.array([stamp]))
        return _POOL.submit(self._stereo.measure, self._painter, views, self._stereo.draw())
